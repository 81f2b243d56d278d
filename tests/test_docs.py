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

from unitcad.arrays.array_file import load_array
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
    if "array" in data:
        assert load_array(data).places


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


LINK = re.compile(r"\]\(([^)\s#]*)(?:#([^)\s]+))?\)")


def _anchors(page: Path) -> set[str]:
    """The headings of a page as GitHub writes them in links."""
    headings = re.findall(r"^#+ +(.+?) *$", re.sub(BLOCK, "", page.read_text("utf-8")), re.MULTILINE)
    plain = [re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).lower() for heading in headings]
    return {re.sub(r"[^\w\- ]", "", heading).replace(" ", "-") for heading in plain}


def _lost(page: Path, text: str) -> list[str]:
    """The links of a page's text to files or headings that are not there."""
    lost = []
    for match in LINK.finditer(BLOCK.sub("", text)):
        target, anchor = match.groups()
        if ":" in target:  # of the web
            continue
        file = page if not target else page.parent / target
        if not file.exists() or (anchor and file.suffix == ".md" and anchor not in _anchors(file)):
            lost.append(match[0])
    return lost


def test_links_within_the_pages_lead_to_a_file_and_a_heading() -> None:
    pages = [*ROOT.glob("*.md"), *sorted((ROOT / "docs").glob("**/*.md"))]
    assert {str(page): lost for page in pages if (lost := _lost(page, page.read_text("utf-8")))} == {}
    python = ROOT / "docs" / "python.md"
    assert _lost(python, "[a](batch.md#custom-designs) [b](https://a.b/#c)") == []
    assert _lost(python, "[a](batch.md#of-ones-own) [b](nowhere.md)") == ["](batch.md#of-ones-own)", "](nowhere.md)"]


def test_the_citation_names_this_version() -> None:
    version = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["version"]
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text("utf-8")


def test_no_page_waits_for_a_figure() -> None:
    waiting = re.compile(r"\b(?:TODO|TBD|FIXME|XXX|ESTIMATES|MEASURED_[A-Z]+)\b")
    for page in [ROOT / "README.md", *sorted((ROOT / "docs").glob("**/*.md"))]:
        prose = re.sub(r"`[^`\n]*`", "", BLOCK.sub("", page.read_text("utf-8")))
        assert waiting.findall(prose) == [], page
