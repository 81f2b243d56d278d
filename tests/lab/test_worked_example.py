"""docs/lab.md as a new user follows it: its commands in order, in an empty folder, give what the page shows."""

import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[2] / "docs" / "lab.md"
BLOCK = re.compile(r"^```console lab\n(.*?)^```", re.MULTILINE | re.DOTALL)


def missing(shown, output):
    """Return the first line of `shown` that `output` does not have where it is due; "..." stands for any lines."""
    at, anywhere = 0, False
    for line in shown:
        if line == "...":
            anywhere = True
            continue
        found = next((i for i in range(at, len(output)) if output[i] == line), None)
        if found is None or (found > at and not anywhere):
            return line
        at, anywhere = found + 1, False
    return None if anywhere or at == len(output) else output[at]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Run the page in a fresh folder, comparing what each command prints."""
    folder = tmp_path_factory.mktemp("lab")
    commands = [part.splitlines() for block in BLOCK.findall(PAGE.read_text("utf-8")) for part in block.split("$ ")[1:]]
    assert [lines[0].split()[1] for lines in commands] == ["-c", "measure", "material", "fit", "estimate"]
    for line, *shown in commands:
        words = shlex.split(line)
        here = Path(sys.executable).parent
        words[0] = sys.executable if words[0] == "python" else shutil.which("unitcad", path=str(here)) or "unitcad"
        done = subprocess.run(words, cwd=folder, capture_output=True, text=True, timeout=300, check=False)
        assert done.returncode == 0, f"{line}\n{done.stdout}{done.stderr}"
        output = [text.rstrip() for text in done.stdout.splitlines()]
        assert missing(shown, output) is None, f"{line}\n{done.stdout}"
    return folder


def test_the_commands_of_the_page_give_what_it_shows(folder):
    made = {"measured/measured.toml", "blend/material.toml", "fit/lab-fit.toml", "fit/fit.md"}
    assert all((folder / name).is_file() for name in made)


def test_the_pasted_table_is_the_one_that_was_made(folder):
    tables = [
        tomllib.loads((folder / name).read_text())
        for name in ("blend/material.toml", "lab/bench.toml", "lab/wish.toml")
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
