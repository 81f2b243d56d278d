"""Make the silicones' moduli again from published tensile curves: `python docs/make_moduli.py FOLDER`.

FOLDER has the curves, such as Tensile-Tests-Data of https://github.com/LucMarechal/Soft-Robotics-Materials-Database.
A value whose source is a command, `unitcad material "NAME.csv" ...`, is made by that command, in the catalogue's file.
"""

from __future__ import annotations

import argparse
import json
import re
import shlex
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from typer.testing import CliRunner

from unitcad.cli import app
from unitcad.text import toml

MATERIALS = Path(__file__).parent.parent / "unitcad" / "catalogue" / "materials.toml"
_COMMAND = re.compile(r'unitcad (material "[^"]+\.csv" [^;]*);')


def made(command: str, folder: Path) -> dict[str, Any]:
    """Return the entry that a command of a source makes, with the curves of a folder."""
    verb, curve, *options = shlex.split(command)
    result = CliRunner().invoke(app, [verb, str(folder / curve), *options, "--json"])
    if result.exit_code:
        raise SystemExit(f"{command}: {result.output}")
    return json.loads(result.stdout)["table"]


def commands(text: str) -> Iterator[tuple[str, str, dict[str, Any], str]]:
    """Yield silicone, key, value and command of every value that a command makes."""
    for name, entry in tomllib.loads(text).items():
        for key, value in entry.items():
            if isinstance(value, dict) and (command := _COMMAND.match(value["source"])):
                yield name, key, value, command[1].strip()


def again(text: str, folder: Path) -> str:
    """Return the catalogue's text with the values of all curves that are in the folder."""
    for name, key, value, command in commands(text):
        if not (folder / shlex.split(command)[1]).exists():
            continue
        new = made(command, folder)[key]
        kept = {"status": value["status"], "method": new["method"], "source": value["source"]}
        ends = {end: new[end] for end in ("value", "low", "high")}
        start = text.index(f"[{name}]\n")
        at = text.index(f"\n{key} = ", start) + 1
        text = f"{text[:at]}{key} = {toml({**ends, **kept})}{text[text.index(chr(10), at) :]}"
    return text


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    text = MATERIALS.read_text("utf-8")
    MATERIALS.write_text(again(text, parser.parse_args().folder), "utf-8")
