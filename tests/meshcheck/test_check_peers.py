"""Our verdicts beside those of other programs: the page is true, and every disagreement has its sentence."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent / "peers"))

import table

STL = [path for path in table.frozen() if path.startswith("numpy-stl/")]


def test_the_page_is_what_we_say_now():
    assert table.PAGE.read_text("utf-8") == table.page()


@pytest.mark.parametrize("path", STL)
def test_each_disagreement_is_explained(path):
    differs = table.disagrees(table.ours(path).verdict, table.frozen()[path])
    assert differs == (path.removeprefix("numpy-stl/") in table.WHY)


def test_every_file_of_the_corpus_is_frozen():
    there = {path.relative_to(table.CORPUS).as_posix() for path in table.CORPUS.rglob("*.stl")}
    there |= {path.relative_to(table.CORPUS).as_posix() for path in table.CORPUS.rglob("*.3mf")}
    assert there == set(table.frozen())
