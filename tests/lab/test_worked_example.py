"""docs/tutorials/lab-data-to-estimate.md as a new user follows it, in an empty folder."""

import re
import tomllib

import pytest

from tests.whole.page_examples import ROOT, run_console

PAGE = ROOT / "docs" / "tutorials" / "lab-data-to-estimate.md"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Run the page in a fresh folder, comparing the output of each command."""
    folder = tmp_path_factory.mktemp("lab")
    assert run_console(PAGE, folder) == 6
    return folder


def test_the_commands_of_the_page_give_what_it_shows(folder):
    made = {"measured/measured.toml", "blend/material.toml", "fit/lab-fit.toml", "fit/fit.md"}
    assert all((folder / name).is_file() for name in made)


def test_the_pasted_table_is_the_one_that_was_made(folder):
    tables = [
        tomllib.loads((folder / name).read_text())
        for name in ("blend/material.toml", "lab/bench.toml", "lab/next-unit.toml")
    ]
    page = re.search(r"^```toml\n(.*?)^```", PAGE.read_text("utf-8"), re.MULTILINE | re.DOTALL)
    assert page
    made, *pasted = [table["materials"]["our-blend"] for table in (*tables, tomllib.loads(page[1]))]
    for entry in pasted:
        assert entry["like"] == made["like"]
        for key in ("value", "low", "high", "status"):
            assert entry["quasistatic_modulus_kpa"][key] == made["quasistatic_modulus_kpa"][key]


def test_the_example_says_that_it_is_synthetic(folder):
    for file in (folder / "lab").iterdir():
        if file.suffix in (".toml", ".csv"):
            assert "ynthetic" in file.read_text(), file.name
    assert "Synthetic" in (folder / "fit" / "fit.md").read_text()
