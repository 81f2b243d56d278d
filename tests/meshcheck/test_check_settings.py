"""Settings of `unitcad check` in unitcad.toml: found upwards, beaten by the command line."""

import json
from pathlib import Path

import pytest
from shapes import box, model_xml, package, stl
from test_check_command import run

HOLE, WARN, FILM = stl(box()[2:]), stl(box()) + bytes(16), stl(box((20, 20, 0.35)))


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "sub" / "deep").mkdir(parents=True)
    (tmp_path / "sub" / "hole.stl").write_bytes(HOLE)
    (tmp_path / "sub" / "warn.stl").write_bytes(WARN)
    (tmp_path / "sub" / "deep" / "film.stl").write_bytes(FILM)
    return tmp_path


def codes(result):
    files = json.loads(result.stdout)["files"]
    return {Path(entry["path"]).name: [found["code"] for found in entry["findings"]] for entry in files}


def test_the_nearest_file_upwards_is_used_and_named(folder):
    name, head = "unitcad.toml", "[check]"
    (folder / name).write_text(f'{head}\nselect = ["F006"]\n')
    result = run(".", "--json", cwd=folder / "sub" / "deep")
    assert json.loads(result.stdout)["config"] == f"../../{name}"
    assert codes(run(".", "--json", cwd=folder)) == {"hole.stl": [], "warn.stl": ["F006"], "film.stl": []}
    (folder / "sub" / name).write_text(f'{head}\nselect = ["T"]\n')
    assert codes(run(".", "--json", cwd=folder / "sub")) == {"hole.stl": ["T001"], "warn.stl": [], "film.stl": []}
    assert json.loads(run("..", "--json", cwd=folder / "sub").stdout)["config"] == name


def test_files_without_our_table_are_passed_over(folder):
    (folder / "unitcad.toml").write_text('[check]\nignore = ["T"]\n')
    (folder / "sub" / "deep" / "unitcad.toml").write_text('design = "embedded"\nselect = "a spec is no settings"\n')
    assert json.loads(run(".", "--json", cwd=folder / "sub" / "deep").stdout)["config"] == "../../unitcad.toml"
    assert run("hole.stl", cwd=folder / "sub").returncode == 0


def test_every_key_does_what_its_option_does_and_the_command_line_beats_it(folder):
    def both(setting, file, *beaten):
        (folder / "unitcad.toml").write_text(f"[check]\n{setting}\n")
        return run(file, "--json", cwd=folder), run(file, "--json", *beaten, cwd=folder)

    hole, warn, film = "sub/hole.stl", "sub/warn.stl", "sub/deep/film.stl"
    set_, beaten = both('select = ["F"]', hole, "--select", "T")
    assert (codes(set_)["hole.stl"], codes(beaten)["hole.stl"]) == ([], ["T001"])
    set_, beaten = both('ignore = ["T001"]', hole, "--ignore", "F")
    assert (codes(set_)["hole.stl"], codes(beaten)["hole.stl"]) == ([], ["T001"])
    set_, beaten = both('fail-on = "warning"', warn, "--fail-on", "error")
    assert (set_.returncode, beaten.returncode) == (1, 0)
    set_, beaten = both('printer = "fdm-0.4"', film, "--printer", "sla")
    assert "D001" in codes(set_)["film.stl"]
    assert "D001" not in codes(beaten)["film.stl"]
    set_, beaten = both('unit = "m"', film, "--unit", "mm")
    assert (codes(set_)["film.stl"], codes(beaten)["film.stl"]) == (["S001"], [])
    for key, option, low, high in (("max-faces", "--max-faces", "5", "100"), ("timeout", "--timeout", "0.001", "600")):
        set_, beaten = both(f"{key} = {low}", film, option, high)
        assert (codes(set_)["film.stl"], codes(beaten)["film.stl"]) == (["F011"], [])
    (folder / "a.3mf").write_bytes(package(model_xml(attributes='unit="millimeter" vendor="x"')))
    set_, beaten = both("3mf-strict = true", "a.3mf", "--no-3mf-strict")
    assert (set_.returncode, beaten.returncode) == (1, 0)
    assert both("memory = 4000", film)[0].returncode == 0


@pytest.mark.parametrize(
    ("pattern", "ignored"),
    [("sub/*.stl", True), ("sub/hole.stl", True), ("hole.stl", True), ("ho*", True), ("*.3mf", False), ("su?", False),
     ("*/hole.stl", True), ("deep/*", False), ("sub/deep/*", False)],
)  # fmt: skip
def test_per_file_ignores_are_globs_from_the_files_folder(folder, pattern, ignored):
    (folder / "unitcad.toml").write_text(f'[check]\nselect = ["T001"]\nper-file-ignores = {{ "{pattern}" = ["T"] }}\n')
    for here, name in ((folder, "sub/hole.stl"), (folder / "sub" / "deep", "../hole.stl")):
        assert codes(run(name, "--json", cwd=here)) == {"hole.stl": [] if ignored else ["T001"]}


def test_per_file_ignores_hide_no_file_that_was_not_judged(folder):
    (folder / "cut.stl").write_bytes(HOLE[:-80])
    (folder / "unitcad.toml").write_text('[check.per-file-ignores]\n"*" = ["F", "T", "G"]\n')
    assert run("cut.stl", cwd=folder).returncode == 1


BAD = [
    ('[check]\nselct = ["T"]', "unitcad.toml: check.selct = [\"T\"]: unknown key; ", "'check.select'"),
    ("[check]\nfail_on = 'error'", "unitcad.toml: check.fail_on = 'error': unknown key; ", "'check.fail-on'"),
    ('[check]\nselect = "T"', "unitcad.toml: check.select = 'T': takes a list", ""),
    ("[check]\nselect = [1]", "unitcad.toml: check.select.0 = 1: takes a text", ""),
    ("[check]\nselect = ['T0001']", "unitcad.toml: check.select = 'T0001': unknown code; ", "'T00"),
    ("[check]\nignore = ['Q']", "unitcad.toml: check.ignore = 'Q': unknown code", ""),
    ("[check]\nfail-on = 'never'", "unitcad.toml: check.fail-on = 'never': unknown name; ", "error"),
    ("[check]\nprinter = 'fdm-0.5'", "unitcad.toml: check.printer = 'fdm-0.5': unknown name; ", "'fdm-0."),
    ("[check]\nunit = 'mmm'", "unitcad.toml: check.unit = 'mmm': unknown name; ", ""),
    ("[check]\nmax-faces = 0", "unitcad.toml: check.max-faces = 0: must be at least 1; nearest accepted: 1", ""),
    ("[check]\nmax-faces = 1.5", "unitcad.toml: check.max-faces = 1.5: takes a whole number", ""),
    ("[check]\ntimeout = 0", "unitcad.toml: check.timeout = 0: must be at least 0.001; nearest accepted: 0.001", ""),
    ("[check]\ntimeout = nan", "unitcad.toml: check.timeout = nan: must be a finite number", ""),
    ("[check]\ntimeout = 1e9", "unitcad.toml: check.timeout = 1e+09: must be a number of seconds below 1e7; ", "600"),
    ("[check]\nmemory = 10", "unitcad.toml: check.memory = 10: must be at least 200; nearest accepted: 200", ""),
    ("[check]\n3mf-strict = 1", "unitcad.toml: check.3mf-strict = 1: takes true or false", ""),
    ("[check.per-file-ignores]\n'*.stl' = 'T'", "unitcad.toml: check.per-file-ignores.*.stl = 'T': takes a list", ""),
    ("[check.per-file-ignores]\n'a' = ['X']", "unitcad.toml: check.per-file-ignores.a = 'X': unknown code", ""),
    ("check = 3", "unitcad.toml: check = 3: takes a table", ""),
    ("[chekc]\nselect = []", "unitcad.toml: chekc = { select = [] }: unknown key; ", "'check'"),
    ("select = ['T']", "unitcad.toml: select = [\"T\"]: unknown key; known here: check", ""),
    ("[check\n", "unitcad.toml:1:7: not TOML: ", ""),
]  # fmt: skip


@pytest.mark.parametrize(("content", "said", "near"), BAD)
def test_a_wrong_setting_is_one_clear_error(folder, content, said, near):
    (folder / "unitcad.toml").write_text(content)
    result = run("sub/warn.stl", cwd=folder)
    assert result.returncode == 2
    assert result.stdout == ""
    (line,) = result.stderr.splitlines()
    assert line.startswith(f"error: {said}")
    assert near in line


def test_config_names_a_file(folder):
    (folder / "unitcad.toml").write_text('[check]\nignore = ["T"]\n')
    (folder / "strict.toml").write_text('[check]\nfail-on = "warning"\n[other]\nkey = 1\n')
    (folder / "empty.toml").write_text("")
    result = run("sub/hole.stl", "--json", "--config", "strict.toml", cwd=folder)
    assert (json.loads(result.stdout)["config"], result.returncode) == ("strict.toml", 1)
    for more in (["none.toml"], ["empty.toml"], ["sub"]):
        result = run("sub/hole.stl", "--config", *more, cwd=folder)
        assert (result.returncode, len(result.stderr.splitlines())) == (2, 1)


def test_the_settings_printer_counts_as_named_with_a_manifest(folder):
    part = {"name": "film", "role": "tool", "volume_mm3": 140.0, "files": {"stl": {"path": "sub/deep/film.stl"}}}
    (folder / "manifest.json").write_text(json.dumps({"parts": [part], "printer": "sla"}))
    assert "D001" not in codes(run("--manifest", ".", "--json", cwd=folder))["film.stl"]
    (folder / "unitcad.toml").write_text('[check]\nprinter = "fdm-0.4"\n')
    assert "D001" in codes(run("--manifest", ".", "--json", cwd=folder))["film.stl"]
    (folder / "unitcad.toml").write_text(
        '[check]\nprinter = "fdm-0.4"\nper-file-ignores = { "film.stl" = ["D", "M"] }\n'
    )
    assert codes(run("--manifest", ".", "--json", cwd=folder))["film.stl"] == []
