"""The examples of README.md and docs/: where they are, and how a page's commands are run."""

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path
from unittest.mock import patch

from tests.in_process import unitcad

ROOT = Path(__file__).parents[2]
BLOCK = re.compile(r"^```(\w+(?: \w+)?)\n(.*?)^```", re.MULTILINE | re.DOTALL)

FILE = "# file: "
ALL_OF_THEM = re.compile(r"\b(\d+) of \1\b")
"""A page need not change if somebody adds a check that passes."""


def pages(root=ROOT):
    """Return README.md and the pages of docs/ and of its folders."""
    return [root / "README.md", *sorted((root / "docs").rglob("*.md"))]


def blocks(page, language):
    """Return the fenced blocks of one language."""
    return [text for found, text in BLOCK.findall(page.read_text("utf-8")) if found == language]


def missing(shown, output):
    """Return the first line of `shown` that `output` lacks at its place, or a line that is not shown.

    The line "..." stands for any lines, "..." within a line for any words. "61 of 61" fits any other number of all.
    """
    shown, output = ([ALL_OF_THEM.sub("all of them", line) for line in lines] for lines in (shown, output))
    at, anywhere = 0, False
    for line in shown:
        if line == "...":
            anywhere = True
            continue
        found = next((i for i in range(at, len(output)) if _fits(line, output[i])), None)
        if found is None or (found > at and not anywhere):
            return line
        at, anywhere = found + 1, False
    return None if anywhere or at == len(output) else output[at]


def _fits(shown, line):
    return re.fullmatch(re.escape(shown).replace(re.escape("..."), ".*"), line) is not None


def run_console(page, folder):
    """Run the commands of a page's console blocks in their order in one folder; return how many ran.

    A block that begins with "# file: NAME" is written as that file first.
    A command that ends in "# exit 2" must exit with 2, others with 0; "# not run: REASON" is left out. Lines below a
    command are its output; if there are none, the output is not compared.
    """
    parts, count = [], 0
    for language, text in BLOCK.findall(page.read_text("utf-8")):
        parts += re.split(r"(?m)^\$ ", text)[1:] if language == "console" else []
        if text.startswith(FILE):
            (folder / text.partition("\n")[0].removeprefix(FILE)).write_text(text, "utf-8")
    for part in parts:
        line, *shown = part.splitlines()
        if "# not run: " in line:
            continue
        command, _, code = line.partition("# exit ")
        done = run(shlex.split(command, comments=True), folder)
        output = done.stderr + done.stdout
        where = f"{page.name}: {line}\n{output}"
        assert done.returncode == int(code or 0), where
        assert "Traceback" not in output, where
        if shown:
            lost = missing([text.rstrip() for text in shown], [text.rstrip() for text in output.splitlines()])
            assert lost is None, f"not in the output: {lost!r}\n{where}"
        count += 1
    return count


def run(words, folder):
    """Run a command in a folder: unitcad's own ones in this process."""
    with patch.dict(os.environ, COLUMNS="100", NO_COLOR="1"):
        if words[0] == "unitcad":
            return unitcad(*words[1:], cwd=folder)
        words[0] = shutil.which(words[0], path=Path(sys.executable).parent) or words[0]
        return subprocess.run(words, cwd=folder, capture_output=True, text=True, timeout=600, check=False)
