"""Command lines of several rooms: a wrong one is refused in one line, and a bare name finds its file."""

import json
from pathlib import Path

import pytest

from tests.test_cli import check_wrong, run
from unitcad.validation import templates

WRONG = {
    "batch x -j abc": "--jobs = 'abc': takes a whole number, such as 1",
    "batch a b": "SWEEP = 'b': a batch takes one sweep; run a second batch for this one",
    "material a.csv --width-mm nan": "--width-mm: nan is not a finite number; see unitcad material --help",
}


@pytest.mark.parametrize("words", WRONG)
def test_a_wrong_command_line_is_one_plain_line_and_json_where_asked(words):
    check_wrong(words, WRONG[words])


def test_a_refused_argument_is_called_as_in_the_help(tmp_path):
    done = run("batch", "publishd", "--json", cwd=tmp_path)
    assert done.stderr.startswith("error: SWEEP = 'publishd': ")
    assert json.loads(done.stdout)["error"]["field"] == "SWEEP"


def test_a_bare_name_finds_its_file(tmp_path):
    (tmp_path / "mine.toml").write_text(templates()["single-embedded"].read_text("utf-8"), "utf-8")
    done = run("build", "mine", "--only", "unit", "--formats", "stl", cwd=tmp_path)
    assert done.returncode == 0
    assert done.stdout.startswith(str(Path("out", "single-embedded-")))
