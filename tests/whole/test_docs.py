"""Every example in README.md and in docs/ and its folders runs, and every link leads somewhere."""

import doctest
import os
import re
import tomllib
from importlib import import_module
from pathlib import Path

import pytest
from page_examples import BLOCK, ROOT, blocks, missing, pages, run_console

from docs.generated import pages as generated_pages
from docs.readme import first_output
from unitcad.arrays.array_file import load_array
from unitcad.validation import from_data

RUN = ("toml", "python", "python notebook", "python brep", "console")
NOT_RUN = ("sh", "text", "json", "yaml")


def _blocks(language):
    return [
        pytest.param(text, id=f"{page.relative_to(ROOT).with_suffix('')}-{i}")
        for page in pages()
        for i, text in enumerate(blocks(page, language))
    ]


def _pages_with(language):
    return [pytest.param(page, id=page.stem) for page in pages() if blocks(page, language)]


def test_no_example_drops_out(tmp_path):
    """An independent walk, line by line, counts the fences; a page in a new folder is found."""
    fences = [
        line.removeprefix("```").strip()
        for folder, _, files in [("", [], [str(ROOT / "README.md")]), *os.walk(ROOT / "docs")]
        for file in files
        if file.endswith(".md")
        for line in Path(folder, file).read_text("utf-8").splitlines()
        if line.startswith("```") and line != "```"
    ]
    assert set(fences) <= {*RUN, *NOT_RUN}
    for language in RUN:
        assert fences.count(language) == len(_blocks(language)) > 0, language
    (tmp_path / "docs" / "a" / "b").mkdir(parents=True)
    page = tmp_path / "docs" / "a" / "b" / "c.md"
    page.write_text("# C\n\n```console\n$ python -c 'raise SystemExit(3)'\n```\n")
    assert page in pages(tmp_path)
    with pytest.raises(AssertionError, match="SystemExit"):
        run_console(page, tmp_path)


def test_shown_output_is_compared(tmp_path):
    output = ["a", "b", "c", "d"]
    assert missing(["a", "...", "c", "d"], output) is None
    assert missing(["a", "..."], output) is None
    assert missing(["a", "c", "..."], output) == "c"
    assert missing(["...", "c", "...", "b", "..."], output) == "b"
    assert missing(["a", "b", "c"], output) == "d"
    assert missing(["1 of ... made"], ["1 of 2 made"]) is None
    assert missing(["1 of ... made"], ["1 of 2 lost"]) == "1 of ... made"
    assert missing(["61 of 61 passed"], ["62 of 62 passed"]) is None
    assert missing(["61 of 61 passed"], ["61 of 62 passed"]) is not None
    page = tmp_path / "page.md"
    page.write_text("```console\n$ python -c 'print(1)'\n1\n$ python -c 'print(1)'\n```\n")
    assert run_console(page, tmp_path) == 2
    page.write_text("```console\n$ python -c 'print(1)'\n2\n```\n")
    with pytest.raises(AssertionError, match="not in the output: '2'"):
        run_console(page, tmp_path)


@pytest.mark.parametrize("text", _blocks("toml"))
def test_toml_examples_are_specs(text):
    data = tomllib.loads(text)
    if data.get("design") in ("embedded", "encapsulating"):
        from_data(data)
    if "array" in data:
        assert load_array(data).places


@pytest.mark.parametrize("text", _blocks("python"))
def test_python_examples_run(text, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    exec(compile(text, "example", "exec"), {"__name__": "__main__"})


@pytest.mark.parametrize("room", ["shape", "meshcheck", "sweeps", "arrays"])
def test_examples_of_docstrings_run(room, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    module, finder = import_module(f"unitcad.{room}"), doctest.DocTestFinder(recurse=False)
    found = [test for name in module.__all__ for test in finder.find(getattr(module, name), name) if test.examples]
    assert found
    assert not any(doctest.DocTestRunner().run(test).failed for test in found)


@pytest.mark.parametrize(
    "page", [page for page in pages() if blocks(page, "python notebook")], ids=lambda page: page.stem
)
def test_notebook_pages_run_from_top_to_bottom(page, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = {"__name__": "__main__"}
    for i, cell in enumerate(blocks(page, "python notebook")):
        exec(compile(cell, f"cell {i}", "exec"), names)


@pytest.mark.parametrize("text", _blocks("python brep"))
def test_examples_with_a_brep_library_run(text, tmp_path, monkeypatch):
    pytest.importorskip("build123d")
    monkeypatch.chdir(tmp_path)
    exec(compile(text, "example", "exec"), {"__name__": "__main__"})


@pytest.mark.parametrize("page", _pages_with("console"))
def test_console_examples_run(page, tmp_path):
    run_console(page, tmp_path)


def test_the_readme_shows_the_output_of_its_first_command(tmp_path):
    """The text block, and nothing before or between its lines; the folder follows."""
    [shown] = blocks(ROOT / "README.md", "text")
    lost = missing(shown.splitlines(), first_output(tmp_path).splitlines())
    assert lost is None, f"{lost!r}: python -m docs.readme writes the block of README.md again"


LINK = re.compile(r"\]\(([^)\s#]*)(?:#([^)\s]+))?\)")


def _anchors(text):
    """The headings of a page as GitHub writes them in links, or by the name that a generated page gives them."""
    headings = re.findall(r"^#+ +(.+?) *$", re.sub(BLOCK, "", text), re.MULTILINE)
    given = {name for heading in headings for name in re.findall(r"\{#([\w-]+)\}$", heading)}
    plain = [re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).lower() for heading in headings]
    return given | {re.sub(r"[^\w\- ]", "", heading).replace(" ", "-") for heading in plain}


GENERATED = {(ROOT / "docs" / name).resolve(): text for name, text in generated_pages().items()}


def _lost(page, text):
    """The links of a page's text to files or headings that are not there."""
    lost = []
    for match in LINK.finditer(BLOCK.sub("", text)):
        target, anchor = match.groups()
        if ":" in target:  # of the web
            continue
        file = (page.parent / target).resolve() if target else page
        content = GENERATED.get(file)
        if content is None and file.is_file() and file.suffix == ".md":
            content = file.read_text("utf-8")
        if not (file.exists() or content) or (anchor and content is not None and anchor not in _anchors(content)):
            lost.append(match[0])
    return lost


def test_links_within_the_pages_lead_to_a_file_and_a_heading():
    written = {page: page.read_text("utf-8") for page in [*ROOT.glob("*.md"), *pages()[1:]]}
    assert {str(page): lost for page, text in {**written, **GENERATED}.items() if (lost := _lost(page, text))} == {}
    python = ROOT / "docs" / "reference" / "python.md"
    there = "../how-to/sweep.md#run-it"
    assert _lost(python, f"[a]({there}) [b](https://a.b/#c) [c](mesh-rules.md#file)") == []
    gone = ["](../how-to/sweep.md#of-ones-own)", "](nowhere.md)", "](mesh-rules.md#nothing)"]
    assert _lost(python, "".join(f"[a{link}" for link in gone)) == gone


def test_the_citation_names_this_version():
    version = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["version"]
    assert f"\nversion: {version}\n" in (ROOT / "CITATION.cff").read_text("utf-8")


def test_no_page_waits_for_a_figure():
    waiting = re.compile(r"\b(?:TODO|TBD|FIXME|XXX|ESTIMATES|MEASURED_[A-Z]+)\b")
    for page in pages():
        prose = re.sub(r"`[^`\n]*`", "", BLOCK.sub("", page.read_text("utf-8")))
        assert waiting.findall(prose) == [], page
