"""The command line: exit codes, one JSON object, no traceback."""

import json
import os
from pathlib import Path

import pytest
from typer.main import get_command
from typer.testing import CliRunner

from tests.in_process import unitcad as run
from unitcad import cli
from unitcad.casting.steps import duration
from unitcad.cli import app


@pytest.mark.parametrize("kind", ["templates", "designs", "materials", "motors", "printers", "tissue", "rules"])
def test_list_names_what_is_shipped(kind):
    done = run("list", kind)
    assert done.returncode == 0
    data = json.loads(run("list", kind, "--json").stdout)
    assert list(data) == [kind]
    assert kind in run("list").stdout.split()
    for name in data[kind]:
        assert name in done.stdout
    if kind in ("materials", "motors", "printers", "tissue"):
        for entry in data[kind].values():
            assert all(value["status"] and value["source"] for value in entry.values())


def test_a_folder_that_can_not_be_written_is_one_line(tmp_path):
    if os.geteuid() == 0:
        target = "/proc/none"
    else:
        (tmp_path / "locked").mkdir(mode=0o500)
        target = str(tmp_path / "locked" / "out")
    done = run("build", "embedded", "--formats", "stl", "-o", target)
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "Traceback" not in done.stderr


def test_estimate_says_that_build_would_refuse_the_moulds(tmp_path):
    setting = "layers.0.cap_mm=500"
    estimated = run("estimate", "encapsulating", "--set", setting, "--model", "published", "--json")
    built = run("build", "encapsulating", "--set", setting, cwd=tmp_path)
    assert (estimated.returncode, built.returncode) == (0, 2)
    reason = built.stderr.removeprefix("error: ")
    assert reason.startswith("layers.0.cap_mm = ")
    assert estimated.stderr == f"warning: encapsulating: its moulds can't be made: {reason}"
    assert json.loads(estimated.stdout)["models"]["published"]


WRONG = {
    "build --nope": "--nope: unknown option; see unitcad build --help",
    "build": "SPEC...: is required; see unitcad build --help",
    "build a --out": "--out: requires an argument; see unitcad build --help",
    "cache gc --limit -1": "--limit = -1: must be from 0 to 1e+12; nearest accepted: 0",
}


@pytest.mark.parametrize("words", WRONG)
def test_a_wrong_command_line_is_one_plain_line_and_json_where_asked(words):
    check_wrong(words, WRONG[words])


def check_wrong(words, told):
    """Check that a command line is refused in one line, the same in JSON."""
    command, *rest = words.split()
    below = rest[:1] if command == "cache" else []
    plain = run(command, *rest)
    as_json = run(command, *below, "--json", *rest[len(below) :])
    assert plain.returncode == as_json.returncode == 2
    assert plain.stdout == ""
    (line,) = plain.stderr.splitlines()
    assert line == f"error: {told}"
    assert f"error: {json.loads(as_json.stdout)['error']['message']}" == line


def _commands():
    whole = get_command(app)
    shown = {name: whole.get_command(None, name) for name in whole.list_commands(None)}
    return {
        "": whole,
        **shown,
        **{f"cache {name}": below for name, below in shown["cache"].commands.items()},
    }


@pytest.mark.parametrize("command", _commands())
def test_help_cuts_no_option_s_name_and_no_square_bracket(command):
    lines = CliRunner().invoke(app, [*command.split(), "--help"], env={"COLUMNS": "80"}).stdout.splitlines()
    assert not [line for line in lines[1:] if line.endswith(("\u2026", "..."))], "a summary is cut"
    shown = " ".join(" ".join(lines[1:]).split())
    for parameter in _commands()[command].params:
        if getattr(parameter, "hidden", False):
            continue
        for option in (*parameter.opts, *parameter.secondary_opts):
            assert not option.startswith("-") or option in shown.replace(",", " ").split()
        assert " ".join((getattr(parameter, "help", None) or "").split()) in shown


def test_help_and_version():
    assert "build" in run("--help").stdout
    assert run("--version").stdout.startswith("unitcad 0.")


def test_the_summary_of_a_gang_speaks_of_each_unit(tmp_path):
    gang = ("--set", "moulds.cavities=[2,1]", "--only", "unit,casting", "--no-report", "--set", "motor.thickness_mm=2")
    done = run("build", "embedded", *gang, "-o", str(tmp_path))
    assert done.stderr.startswith("embedded: 2 units, each 14 mm across, 2.11 mm high with its circuit, 2 without, ")
    assert "measure first; assumed: fpcb.thickness_mm = 0.11 (usual stock)\n" in done.stderr


def test_build_ends_with_a_summary_on_standard_error_and_the_folder_on_standard_output(tmp_path):
    """Every figure is that of a file in the folder."""
    done = run("build", "embedded", "--formats", "stl", "-o", str(tmp_path))
    folder = Path(done.stdout.strip())
    assert done.stdout.count("\n") == 1
    assert folder.is_dir()
    lines = [line.removeprefix("embedded: ") for line in done.stderr.splitlines()]
    procedure = json.loads((folder / "casting.json").read_text())
    manifest = json.loads((folder / "manifest.json").read_text())
    assert lines[0].startswith("14 mm across")
    assert lines[1].startswith("measure first; assumed: motor.thickness_mm = 2 (2 to 2.65)")
    minutes = duration(procedure["printing"]["minutes"])
    how = f"layers 0.2, first layer 0.2 mm; about {minutes}, at most "
    assert lines[2].startswith(f"print each STL of moulds/ (no 3MF was asked for): {how}")
    assert lines[2].endswith(". Mix 2 g of ecoflex-00-10, 2 g of dragon-skin-30.")
    out, bench = duration(procedure["earliest_finish_min"]), duration(procedure["bench_min"])
    assert lines[3] == (
        f"2 pours, {bench} at the bench. Out of the mould {out} after the print. Motor in: 5 min more at the bench, then "
        "24 h to let the adhesive cure."
    )
    checks = manifest["mould_checks"]
    assert lines[0].endswith(f"; checks: {sum(one['ok'] for one in checks)} of {len(checks)}")
    assert lines[4] == manifest["estimate"]["line"]
    assert lines[5] == f"open {folder / 'bench.html'} to cast; report.html is next to it"
    assert len(lines) == 6
    assert (folder / "report.html").is_file()
    without = run("build", "embedded", "--formats", "stl", "-o", str(tmp_path / "b"), "--no-report")
    assert not (Path(without.stdout.strip()) / "report.html").exists()
    assert "open " not in without.stderr


@pytest.mark.parametrize(
    ("error", "said"),
    [
        (MemoryError(), "error: out of memory"),
        (
            SystemError("<built-in method x> returned NULL without setting an exception"),
            "error: out of memory: <built-in method x> returned NULL without setting an exception",
        ),
        (SystemError("error return without exception set"), "error: out of memory: error return without exception set"),
        (
            ImportError("libjpeg.so.62: failed to map segment from shared object"),
            "error: out of memory: libjpeg.so.62: failed to map segment from shared object",
        ),
        (ImportError("no x"), "error: internal error: ImportError: no x (a bug; UNITCAD_TRACEBACK=1 shows where)"),
    ],
    ids=lambda value: type(value).__name__ if isinstance(value, Exception) else "",
)
def test_a_library_without_memory_is_no_bug(error, said, monkeypatch, capsys):
    def run(words):
        raise error

    monkeypatch.delenv("UNITCAD_TRACEBACK", raising=False)
    monkeypatch.setattr(cli.command_line, "run", run)
    with pytest.raises(SystemExit) as left:
        cli.main()
    assert left.value.code == 1
    assert capsys.readouterr().err == f"{said}\n"


def test_a_mould_check_is_explained_next_to_a_mesh_rule():
    done = CliRunner().invoke(app, ["check", "--explain", "c210,T001"])
    assert done.exit_code == 0
    assert done.stdout.startswith("C210 gap\n\nFaces that slide have the printer's clearance.\n")
    assert "\n\nT001 " in done.stdout
    unknown = run("check", "--explain", "C211")
    assert unknown.returncode == 2
    assert unknown.stderr.startswith("error: --explain = 'C211': unknown name; closest: C210")
