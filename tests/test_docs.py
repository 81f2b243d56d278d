"""Every example in README.md and docs/ runs."""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from unitcad.validation import from_data

ROOT = Path(__file__).parent.parent
BLOCK = re.compile(r"^```(\w+(?: \w+)?)\n(.*?)^```", re.MULTILINE | re.DOTALL)


def _blocks(language: str) -> list:
    return [
        pytest.param(text, id=f"{page.stem}-{i}")
        for page in [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
        for i, (found, text) in enumerate(BLOCK.findall(page.read_text("utf-8")))
        if found == language
    ]


@pytest.mark.parametrize("text", _blocks("toml"))
def test_toml_examples_are_specs(text: str) -> None:
    data = tomllib.loads(text)
    if data.get("design") in ("embedded", "encapsulating"):
        from_data(data)


@pytest.mark.parametrize("text", _blocks("python"))
def test_python_examples_run(text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    exec(compile(text, "example", "exec"), {"__name__": "__main__"})


def test_the_python_page_runs_from_top_to_bottom(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    page = (ROOT / "docs" / "python.md").read_text("utf-8")
    cells = [text for language, text in BLOCK.findall(page) if language == "python notebook"]
    assert len(cells) > 10
    names: dict[str, object] = {"__name__": "__main__"}
    for i, cell in enumerate(cells):
        exec(compile(cell, f"cell {i}", "exec"), names)


@pytest.mark.parametrize("text", _blocks("python brep"))
def test_examples_with_a_brep_library_run(text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("build123d")
    monkeypatch.chdir(tmp_path)
    exec(compile(text, "example", "exec"), {"__name__": "__main__"})


@pytest.mark.parametrize("text", _blocks("console"))
def test_console_examples_run(text: str, tmp_path: Path) -> None:
    for line in text.splitlines():
        if not line.startswith(("$ unitcad", "$ python")) or "# not run:" in line:
            continue
        command, _, code = line[2:].partition("# exit ")
        words = shlex.split(command, comments=True)
        if words[0] == "unitcad":
            words[0] = shutil.which("unitcad", path=str(Path(sys.executable).parent)) or "unitcad"
        else:
            words[0] = sys.executable
        done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, timeout=300, check=False)
        assert done.returncode == int(code or 0), f"{line}\n{done.stdout}{done.stderr}"
        assert "Traceback" not in done.stderr


def test_no_page_waits_for_a_figure() -> None:
    waiting = re.compile(r"\b(?:TODO|TBD|FIXME|XXX|ESTIMATES|MEASURED_[A-Z]+)\b")
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").glob("**/*.md"))]:
        prose = re.sub(r"`[^`\n]*`", "", BLOCK.sub("", page.read_text("utf-8")))
        assert waiting.findall(prose) == [], page
