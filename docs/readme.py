"""The output that README.md and the home of the docs show: `python -m docs.readme` writes their text blocks again."""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from pathlib import Path

README = Path(__file__).parents[1] / "README.md"
HOME = Path(__file__).parent / "index.md"
_BLOCK = re.compile(r"(?ms)^```text\n.*?^```$")


def first_output(folder: Path) -> str:
    """Return the lines that README's first command prints before those with the folder of its result."""
    command = [sys.executable, "-m", "unitcad", "build", "encapsulating", "-o", str(folder)]
    printed = subprocess.run(command, capture_output=True, text=True, encoding="utf-8", check=True).stderr
    return "".join(line for line in printed.splitlines(keepends=True) if str(folder) not in line)


def home_block(shown: str) -> str:
    """Return README's text block as the home of the docs has it: without the name that begins each line."""
    return re.sub(r"(?m)^encapsulating: ", "", shown)


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        shown = f"```text\n{first_output(Path(folder))}```"
    README.write_text(_BLOCK.sub(lambda _: shown, README.read_text("utf-8"), count=1), "utf-8")
    HOME.write_text(_BLOCK.sub(lambda _: home_block(shown), HOME.read_text("utf-8"), count=1), "utf-8")
