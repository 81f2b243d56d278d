"""Command lines of several rooms: a wrong one is refused in one line, and a file of another kind by its command."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.test_cli import check_wrong, run
from tests.test_help import GROUPS
from unitcad.rooms import commands
from unitcad.validation import templates

WRONG = {
    "batch x -j abc": "--jobs = 'abc': takes a whole number, such as 1",
    "batch a b": "SWEEP = 'b': a batch takes one sweep; build this one by another command",
    "material a.csv --width-mm nan": "--width-mm: nan is not a finite number; see unitcad material --help",
}


@pytest.mark.parametrize("words", WRONG)
def test_a_wrong_command_line_is_one_plain_line_and_json_where_asked(words: str) -> None:
    check_wrong(words, WRONG[words])


def test_a_refused_argument_is_called_as_in_the_help(tmp_path: Path) -> None:
    done = run("batch", "publishd", "--json", cwd=tmp_path)
    assert done.stderr.startswith("error: SWEEP = 'publishd': ")
    assert json.loads(done.stdout)["error"]["field"] == "SWEEP"


def test_a_file_of_another_kind_is_named_with_its_command_and_a_bare_name_finds_its_file(tmp_path: Path) -> None:
    for name, text in (("walls", 'base = "embedded"\n[sweep]\ndiameter_mm = [14, 15]\n'), ("mine", None)):
        template = Path(str(templates()["single-embedded"]))
        (tmp_path / f"{name}.toml").write_text(text or template.read_text("utf-8"), "utf-8")
    for words, told in (
        ("build walls", "SPEC = 'walls.toml': is a sweep: run unitcad batch walls.toml"),
        ("estimate thickness", "SPEC = 'thickness': is a sweep: run unitcad batch thickness"),
        ("batch mine.toml", "SWEEP = 'mine.toml': is a spec: run unitcad build mine.toml"),
        ("batch forearm-patch", "SWEEP = 'forearm-patch': is an array: run unitcad build forearm-patch"),
        ("design walls", "TARGET = 'walls.toml': is a sweep: run unitcad batch walls.toml"),
        ("phantom mine", "PHANTOM = 'mine.toml': is a spec: run unitcad build mine.toml"),
    ):
        done = run(*words.split(), cwd=tmp_path)
        assert (done.returncode, done.stderr) == (2, f"error: {told}\n"), words
    done = run("build", "mine", "--only", "unit", "--formats", "stl", cwd=tmp_path)
    assert done.returncode == 0
    assert done.stdout.startswith(str(Path("out", "single-embedded-")))


def test_commands_are_in_five_groups() -> None:
    assert sorted({command.group for command in commands().values()}) == sorted(GROUPS)
