"""Suites whose packages are not installed are left out, each with the reason; the rest runs."""

import json
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from benchmarks.accuracy import runner
from benchmarks.accuracy.command import accuracy
from benchmarks.accuracy.result import Result
from unitcad.errors import Missing

CLONE = Path(__file__).parents[2]


def test_what_is_missing_is_left_out_with_its_reason(monkeypatch, capsys):
    def run(name, quick, say, count, seed):
        if name in ("speed", "models"):
            raise Missing(f"{name} needs what is not here")
        return Result(name, name, "", (), (), (), {})

    monkeypatch.setattr(runner, "run", run)
    accuracy(quick=True, as_json=True)
    shown = capsys.readouterr()
    data = json.loads(shown.out)
    assert [suite["suite"] for suite in data["suites"]] == [n for n in runner.SUITES if n not in ("speed", "models")]
    assert data["left_out"] == {name: f"{name} needs what is not here" for name in ("models", "speed")}
    assert "speed: left out: speed needs what is not here" in shown.err


def test_a_suite_that_is_named_and_lacks_something_is_an_error(monkeypatch):
    def run(name, quick, say, count, seed):
        raise Missing("needs what is not here")

    monkeypatch.setattr(runner, "run", run)
    with pytest.raises(Missing):
        accuracy(["speed"], quick=True)


@pytest.mark.parametrize(
    ("suite", "module", "extra"),
    [("stability", "flint", "test"), ("hankel", "libdlf", "fem"), ("models", "skfem", "fem")],
)
def test_what_a_suite_lacks_is_said_before_any_work(suite, module, extra, monkeypatch):
    """Without python-flint the stability suite once worked for minutes and said so afterwards."""
    monkeypatch.setitem(sys.modules, module, None)
    monkeypatch.setattr(runner, "import_module", lambda name: pytest.fail("worked"))
    monkeypatch.setattr("benchmarks.accuracy.stability.study", lambda *_: pytest.fail("worked"))
    expected = rf"the suite {suite} needs {module}: .*-m pip install .*\[{extra}\]"
    with pytest.raises(Missing, match=expected):
        accuracy([suite], media=9 if suite == "stability" else None)
    with pytest.raises(Missing, match=expected):
        accuracy(["moulds", suite], quick=True)  # nor is the suite before it begun


@pytest.mark.long
def test_a_wheel_has_no_suites(tmp_path):
    pip = [sys.executable, "-m", "pip", "wheel", "--no-deps", "--no-build-isolation", "--quiet", "-w", str(tmp_path)]
    subprocess.run([*pip, str(CLONE)], check=True)
    (wheel,) = tmp_path.glob("*.whl")
    with zipfile.ZipFile(wheel) as packed:
        names = packed.namelist()
    assert "unitcad/py.typed" in names
    assert not [name for name in names if name.startswith(("tests", "benchmarks"))]
