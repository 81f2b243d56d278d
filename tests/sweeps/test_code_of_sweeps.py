"""Code that a sweep or its base brings along runs only if it was named or allowed."""

import json

import pytest

from tests.robustness import test_code_of_others as of_files


@pytest.fixture
def planted(tmp_path):
    planted = of_files.Planted(tmp_path)
    for name, base in (("named", "./named.toml"), ("embedded", "./embedded.toml")):
        text = f'base = "{base}"\n[sweep]\ndiameter_mm = [14.0, 15.0]\n'
        (tmp_path / f"sweep-{name}.toml").write_text(text)
    text = f'base = "./named.toml"\n[sweep]\ndesign_source = [{json.dumps(planted.code + "# other text")}]\n'
    (tmp_path / "sweep-swept.toml").write_text(text)
    return planted


@pytest.mark.parametrize(
    "arguments",
    [
        "batch sweep-named.toml --dry-run",
        "batch sweep-embedded.toml --dry-run",
        "batch sweep-swept.toml --dry-run",
        "batch sweep-embedded.toml -j 1",
        "batch sweep-swept.toml -j 0",
        "batch sweep-embedded.toml --only estimate",
    ],
)
def test_code_that_nobody_named_does_not_run(arguments, planted):
    of_files.test_code_that_nobody_named_does_not_run(arguments, planted)


@pytest.mark.parametrize(
    "arguments",
    [
        "batch sweep-named.toml --only unit -j 1",
        "batch sweep-embedded.toml --only unit -j 1 --allow-code",
        "batch sweep-named.toml --dry-run --allow-code",
    ],
)
def test_code_of_a_file_that_was_named_runs_and_other_code_when_allowed(arguments, planted):
    of_files.test_code_of_a_file_that_was_named_runs_and_other_code_when_allowed(arguments, planted)
