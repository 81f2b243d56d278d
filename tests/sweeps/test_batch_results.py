"""Batches: each part once, the same bytes however made, tables, folders, progress; a design of one's own."""

import csv
import json
import re
from pathlib import Path

import pytest
from batching import bytes_of, calls, environment, ring_sweep, rows, summary_of, unitcad

from unitcad.errors import UnitcadError
from unitcad.pipeline.write import build
from unitcad.spec import to_toml
from unitcad.sweeps import BatchOptions, load_sweep, run
from unitcad.sweeps.executors import SerialExecutor
from unitcad.validation import from_data, load, read
from unitcad.validation.load import shipped_files

DOCS = Path(__file__).parent.parent.parent / "docs"


def test_each_geometry_once_whatever_the_workers(tmp_path):
    sweep = ring_sweep(tmp_path / "s", heights=[2.0, 3.0], materials=3)
    outs = []
    for jobs in (0, 2):
        outs.append(tmp_path / f"out{jobs}" / "rings")
        (tmp_path / "s" / "calls").unlink(missing_ok=True)
        summary = summary_of(sweep, "-o", outs[-1].parent, "-j", jobs, "--cache", tmp_path / f"cache{jobs}")
        assert (summary["ok"], summary["geometries"], summary["reused"]) == (6, 2, 4)
        assert sorted(calls(tmp_path / "s")) == ["2.0", "3.0"]
    assert bytes_of(outs[0]) == bytes_of(outs[1])
    assert len(bytes_of(outs[0])) == 6 * 5 + 2


def test_a_variant_is_the_same_as_built_alone_and_its_checks_are_in_the_table(tmp_path):
    sweep = load_sweep("all-materials").overridden(['output.formats=["stl","3mf"]'])
    run(sweep, tmp_path / "b", BatchOptions(("unit", "moulds"), limit=2), SerialExecutor(), workers=1)
    alone = build(sweep.spec(1), tmp_path / "a", only=("unit", "moulds")).folder
    together = tmp_path / "b" / alone.name
    assert bytes_of(alone) == bytes_of(together)
    files = [f for f in together.rglob("*") if f.suffix in (".stl", ".3mf", ".svg")]
    assert len(files) > 8
    assert all(f.stat().st_nlink >= 3 for f in files)  # two variants and the cache
    for row in rows(tmp_path / "b"):
        assert row["mould_checks_passed"] == row["mould_checks"] > 20
        assert row["mould_checks_failed"] == ""
        assert row["check_errors"] == 0


def test_the_table_has_a_row_a_variant_with_what_was_swept_and_what_came_out(tmp_path):
    sweep = ring_sweep(tmp_path / "s", heights=[2.0, 4.0], materials=2)
    assert unitcad("batch", sweep, "-o", tmp_path / "o", "-j", 0).returncode == 0
    with open(tmp_path / "o" / "rings" / "variants.csv", newline="", encoding="utf-8") as file:
        table = list(csv.DictReader(file))
    assert [row["index"] for row in table] == ["0", "1", "2", "3"]
    assert [row["parameters.height_mm"] for row in table] == ["2.0", "2.0", "4.0", "4.0"]
    from math import pi

    for row, density in zip(table, [1.04, 1.07, 1.04, 1.07], strict=True):
        volume = pi * (7.0**2 - 4.5**2) * float(row["parameters.height_mm"])
        assert float(row["layer1_volume_mm3"]) == pytest.approx(volume, rel=1e-8)
        assert float(row["layer1_mass_g"]) == pytest.approx(volume * density / 1000, rel=1e-5)
        assert (tmp_path / "o" / "rings" / row["folder"] / "manifest.json").is_file()
    listed = json.loads((tmp_path / "o" / "rings" / "batch.json").read_text())
    assert listed["columns"] == list(table[0])
    assert [row["layer1_mass_g"] for row in listed["variants"]] == [float(row["layer1_mass_g"]) for row in table]


def test_a_formula_stays_text_in_the_table(tmp_path):
    sweep = ring_sweep(tmp_path / "s", heights=[2.0])
    done = unitcad("batch", sweep, "-o", tmp_path / "o", "-j", 0, "--set", "name='=1+1'")
    assert done.returncode == 0, done.stderr
    assert ",'=1+1," in (tmp_path / "o" / "rings" / "variants.csv").read_text()


def test_the_last_line_s_sums_and_plurals(tmp_path):
    sweep = ring_sweep(tmp_path / "s", "fails", heights=[2.0, 3.0], materials=2)
    done = unitcad("batch", sweep, "-o", tmp_path / "out", "-j", 0, "--keep-going")
    assert done.returncode == 1
    made = done.stdout.splitlines()[0].rpartition("; ")[0]
    assert made == "2 of 4 variants made; 2 failed; 1 geometry, 1 variant without a new part"
    again = unitcad("batch", sweep, "-o", tmp_path / "out", "-j", 0, "--limit", 1)
    made = again.stdout.splitlines()[0].rpartition("; ")[0]
    assert made == "1 of 1 variant made (1 from before); 0 failed"


def test_folders_that_are_not_ours(tmp_path):
    sweep = ring_sweep(tmp_path / "s", heights=[2.0])
    (tmp_path / "mine" / "rings").mkdir(parents=True)
    (tmp_path / "mine" / "rings" / "letter").write_text("keep")
    (tmp_path / "file").mkdir()
    (tmp_path / "file" / "rings").write_text("keep")
    for out, message in (("mine", "no batch's result"), ("file", "is a file")):
        done = unitcad("batch", sweep, "-o", tmp_path / out)
        assert done.returncode == 2
        assert message in done.stderr
    assert [p.name for p in (tmp_path / "mine" / "rings").iterdir()] == ["letter"]
    assert unitcad("batch", sweep, "-o", tmp_path / "o", "-j", 0).returncode == 0
    changed = tmp_path / "published.toml"
    changed.write_text('base = "embedded"\nname = "rings"\n[sweep]\ndiameter_mm = [14, 15]\n')
    other = unitcad("batch", changed, "-o", tmp_path / "o")
    assert other.returncode == 2
    assert "has another batch (rings" in other.stderr
    # A variant's place taken by something else: that one fails, nothing is overwritten.
    folder = next((tmp_path / "o" / "rings").glob("ring-*"))
    (folder / "spec.toml").write_text(to_toml(from_data(read("embedded"))))
    (folder / "manifest.json").unlink()
    again = unitcad("batch", sweep, "-o", tmp_path / "o", "-j", 0)
    assert again.returncode == 1
    assert "has the result of another spec" in again.stderr


def test_progress_is_lines_for_machines_and_nothing_in_a_pipe(tmp_path):
    sweep = ring_sweep(tmp_path / "s", heights=[2.0, 3.0])
    done = unitcad("batch", sweep, "-o", tmp_path / "o", "-j", 1, "--json-lines")
    events = [json.loads(line) for line in done.stdout.splitlines()]
    assert [event["event"] for event in events] == ["variant", "variant", "end"]
    assert sorted(event["index"] for event in events[:2]) == [0, 1]
    assert done.stderr == ""
    refused = unitcad("batch", sweep, "-o", tmp_path / "p", "--json-lines", "--scheduler", "x", "--only", "estimate")
    (event,) = [json.loads(line) for line in refused.stdout.splitlines()]
    assert (refused.returncode, event["event"], event["error"]["field"]) == (2, "error", "--scheduler")
    unknown = unitcad("batch", sweep, "--json-lines", "--slow")
    assert json.loads(unknown.stdout)["error"]["message"].startswith("--slow: unknown option")
    quiet = unitcad("batch", sweep, "-o", tmp_path / "o", "-j", 1)
    assert quiet.stderr == ""
    assert quiet.stdout.splitlines()[-1] == str(tmp_path / "o" / "rings")


def test_the_bar_on_a_terminal_shows_rate_reused_failed(monkeypatch):
    import io
    import sys

    from unitcad.sweeps import Summary
    from unitcad.sweeps.batch_command import watching

    class Terminal(io.StringIO):
        def isatty(self):
            return True

    shown = Terminal()
    monkeypatch.setattr(sys, "stderr", shown)
    with watching(False) as watch:
        watch(Summary(10, done=4, reused=3, failed=1), None)
    assert re.search(r"4/10.*/s.*reused 3.*failed 1", shown.getvalue(), re.DOTALL)


def test_cache_ls_and_gc(tmp_path, own_cache):
    sweep = ring_sweep(tmp_path / "s", heights=[2.0])
    unitcad("batch", sweep, "-o", tmp_path / "o", "-j", 0, env=environment())  # the cache has no user any more
    before = bytes_of(tmp_path / "o" / "rings")
    listed = json.loads(unitcad("cache", "ls", "--json").stdout)
    assert listed["cache"] == str(own_cache)
    assert listed["bytes"] > 0
    gone = json.loads(unitcad("cache", "gc", "--limit", 0, "--json").stdout)
    assert gone["bytes"] == listed["bytes"]
    assert json.loads(unitcad("cache", "ls", "--json").stdout)["bytes"] == 0
    assert bytes_of(tmp_path / "o" / "rings") == before
    assert unitcad("cache", "ls", "--cache", tmp_path).returncode == 2


def test_a_batch_keeps_its_cache_within_the_limit(tmp_path, own_cache):
    sweep = ring_sweep(tmp_path / "s", heights=[2.0, 3.0, 4.0])
    unitcad("batch", sweep, "-o", tmp_path / "o", "-j", 1, "--cache-limit", "0.02")
    assert 0 < json.loads(unitcad("cache", "ls", "--json").stdout)["bytes"] <= 20_000


def test_the_design_in_the_docs_builds_and_is_complete_in_its_folder(tmp_path):
    blocks = re.findall(
        r"^```(\w+)\n(.*?)^```", (DOCS / "how-to" / "custom-design.md").read_text("utf-8"), re.MULTILINE | re.DOTALL
    )
    code = next(text for kind, text in blocks if kind == "python" and "def " in text)
    spec = next(text for kind, text in blocks if kind == "toml" and "tub.py:" in text)
    (tmp_path / "tub.py").write_text(code)
    (tmp_path / "tub.toml").write_text(spec)
    done = unitcad("build", tmp_path / "tub.toml", "-o", tmp_path / "out", "--formats", "stl,3mf", "--only", "unit")
    assert done.returncode == 0, done.stderr
    folder = Path(done.stdout.splitlines()[-1])
    manifest = json.loads((folder / "manifest.json").read_text())
    assert [part["name"] for part in manifest["parts"]] == ["layer1", "motor"]
    assert manifest["check"]["errors"] == 0
    assert {left["output"] for left in manifest["skipped"]} >= {"moulds", "casting", "estimate"}
    (tmp_path / "tub.py").unlink()
    again = [folder / "spec.toml", "-o", tmp_path / "out", "--formats", "stl,3mf", "--only", "unit"]
    refused = unitcad("build", *again, env=environment())
    assert refused.returncode == 2
    assert "--allow-code" in refused.stderr
    again = unitcad("build", *again, "--allow-code")
    assert Path(again.stdout.splitlines()[-1]) == folder


@pytest.mark.parametrize(
    ("code", "message"),
    [
        ("def unit(spec): return 5", "returns a int"),
        ("def unit(spec):\n    x = 1\n    return 1 / 0", r"line 3\): ZeroDivisionError"),
        ("def unit(spec) return", "line 1"),
        ("def unti(spec): return 5", "has no such function or Design; it has unti"),
        ("from unitcad.shape import ring\ndef unit(spec): return {'Bad name': ring(1, 2, 0, 1)}", "is no name"),
        ("from unitcad.shape import ring\ndef unit(spec): return ring(2, 1, 0, 1)", "line 2"),
        ("import nonsense_there_is_not", "ModuleNotFoundError"),
        ("raise SystemExit(3)", r"line 1\): ends the program \(SystemExit\); it must return"),
        ("import sys\ndef unit(spec): sys.exit()", r"line 2\): ends the program \(SystemExit\)"),
        ("def unit(spec): assert False", r"line 1\): AssertionError without a message"),
    ],
)
def test_a_design_that_does_not_work_says_where(code, message, tmp_path):
    (tmp_path / "d.py").write_text(code)
    layers = [{"material": "ecoflex-00-10", "wall_mm": 1.25}]
    data = {"name": "x", "design": f"{tmp_path / 'd.py'}:unit", "diameter_mm": 14.0, "layers": layers}
    with pytest.raises(UnitcadError, match=message):
        build(from_data(data, tmp_path), tmp_path / "out", only=("unit",), check=False)


def test_a_design_that_is_not_there(tmp_path):
    data = {**read("embedded"), "design": f"{tmp_path / 'no.py'}:unit"}
    with pytest.raises(UnitcadError, match="no such file"):
        from_data(data, tmp_path)
    with pytest.raises(UnitcadError, match="only a custom design"):
        from_data({**read("embedded"), "parameters": {"x": 1}})


def test_the_schema_holds_the_specs_and_sweeps_that_are_shipped():
    import tomllib

    jsonschema = pytest.importorskip("jsonschema")
    from unitcad.validation import templates

    for kind, files in (("spec", templates()), ("sweep", shipped_files("sweeps"))):
        done = unitcad("schema", kind)
        assert done.returncode == 0
        validator = jsonschema.Draft202012Validator(json.loads(done.stdout))
        validator.check_schema(validator.schema)
        for file in files.values():
            validator.validate(tomllib.loads(file.read_text("utf-8")))
        assert list(validator.iter_errors({"base": "x", "sweep": {"mode": "no"}, "name": 5}))
    assert unitcad("schema", "speck").returncode == 2


def test_init_writes_a_spec_that_names_every_key(tmp_path):
    from unitcad.sweeps.sweep import known_paths

    done = unitcad("init", "my-unit", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    text = (tmp_path / "my-unit.toml").read_text()
    spec = load(str(tmp_path / "my-unit.toml"))
    assert spec == load("encapsulating", ["name='my-unit'"])
    for path in known_paths(read("encapsulating")):
        if path not in ("design_source", "body.file_source", "estimate.fit_source"):
            assert re.search(rf"\b{path.rpartition('.')[2]}\b", text), path
    # Taking away one # changes one value, without another word.
    changed = text.replace("# [moulds]", "[moulds]").replace('# printer = "fdm-0.4"', 'printer = "fdm-0.4"')
    changed = changed.replace("# skin_mm = 0.0", "skin_mm = 0.4").replace("# fill = false", "fill = true")
    (tmp_path / "changed.toml").write_text(changed)
    assert load(str(tmp_path / "changed.toml")).motor.fill
    assert load(str(tmp_path / "changed.toml")).skin_mm == 0.4
    assert unitcad("init", "my-unit", cwd=tmp_path).returncode == 2
    assert unitcad("init", "../x", cwd=tmp_path).returncode == 2
    assert unitcad("init", "y", "--template", "nonsense", cwd=tmp_path).returncode == 2
