"""Names that rich would take for markup or an emoji are shown as they are, wherever rich draws."""

from __future__ import annotations

import io
import tomllib
from importlib.resources import files

import pytest

from unitcad.cli.estimate_tables import print_estimate, print_frequencies
from unitcad.cli.output import progress
from unitcad.estimating import estimate_spec, frequency_table_of_spec
from unitcad.sweeps.batch_progress import watching
from unitcad.validation import from_data, read

HOSTILE = ["[/x]", "[bold", "a [red]b[/red] c", "[link=file:///x]y[/link]", ":tada:", "\\[/x]", "[@click=f()]z"]


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def _terminal(monkeypatch: pytest.MonkeyPatch) -> Terminal:
    terminal = Terminal()
    monkeypatch.setattr("sys.stderr", terminal)
    monkeypatch.setattr("sys.stdout", terminal)
    for name, value in {"COLUMNS": "400", "TERM": "xterm", "NO_COLOR": "1"}.items():
        monkeypatch.setenv(name, value)
    return terminal


@pytest.mark.parametrize("name", HOSTILE)
def test_the_spinner(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = _terminal(monkeypatch)
    with progress(name) as say:
        say(f"slicing {name}")
    assert name in terminal.getvalue()


def test_the_tables_of_an_estimate(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = _terminal(monkeypatch)
    data = read("encapsulating")
    tissue = tomllib.loads((files("unitcad") / "catalogue" / "tissue.toml").read_text("utf-8"))
    data.setdefault("estimate", {})
    for name in HOSTILE:
        data["name"] = data["layers"][0]["material"] = data["estimate"]["tissue"] = name
        data["materials"] = {name: {"like": "ecoflex-00-10"}}
        data["tissue"] = {name: tissue["forearm"]}
        spec = from_data(data)
        terminal.seek(0)
        terminal.truncate()
        print_estimate(estimate_spec(spec), details=True)
        assert f"{name}\x1b[0m: encapsulating, {name} / " in terminal.getvalue()
        assert f"all-{name} unit's" in terminal.getvalue()
        print_frequencies(frequency_table_of_spec(spec, [100.0, 125.0]))
        assert f"{name}: edge level" in terminal.getvalue()


def test_the_bar_of_a_batch(monkeypatch: pytest.MonkeyPatch) -> None:
    terminal = _terminal(monkeypatch)
    with watching(False):
        pass
    assert "failed 0" in terminal.getvalue()
