"""The text of TOML files: their data, and the lines of their keys."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from functools import lru_cache
from itertools import islice
from pathlib import Path
from typing import Any

from unitcad.errors import UnitcadError
from unitcad.files import read_text

_STRING = r'"""(?:\\.|[^\\])*?"{3,5}|' + r"'''.*?'{3,5}|" + r'"(?:\\.|[^"\\\n]++)*+"|' + r"'[^'\n]*+'"
_TOKEN = re.compile(_STRING + r"|#[^\n]*|[\[\]{}=,\n]", re.DOTALL)
_KEY = re.compile(rf"[\[\s]*({_STRING}|[\w-]+)\s*(\.?)\s*", re.DOTALL)
_DEEPER = {"[": 1, "{": 1, "]": -1, "}": -1}


def has_more(text: str, most: int) -> bool:
    """Return whether a TOML text has more than `most` keys, tables and list entries."""
    if len(text) <= most:
        return False
    marks = (1 for token in _TOKEN.finditer(text) if token[0] in ("=", ",", "["))
    return next(islice(marks, most, None), None) is not None


def line_of(text: str, path: str) -> int | None:
    """Return the line, from 1, of the statement that sets a dotted path; of a missing key, the line of its table."""
    lines = _lines(text.replace("\r\n", "\n"))
    while path and path not in lines:
        path = path.rpartition(".")[0]
    return lines.get(path)


@lru_cache(maxsize=4)
def _lines(text: str) -> dict[str, int]:
    """Return the first line of each path of a TOML text."""
    lines: dict[str, int] = {}
    last: dict[str, int] = {}  # the index of the last table of each array of tables
    table = ""
    for line, statement in _statements(text):
        header, keys = statement.startswith("["), list(_keys(statement))
        path = "" if header else table
        for i, key in enumerate(keys, 1):
            path = f"{path}.{key}" if path else key
            lines.setdefault(path, line)
            if statement.startswith("[[") and i == len(keys):
                last[path] = last.get(path, -1) + 1
            if path in last:
                path = f"{path}.{last[path]}"
                lines.setdefault(path, line)
        if header:
            table = path
    return lines


def _statements(text: str) -> Iterator[tuple[int, str]]:
    """Yield the first line and the text of each header and each key with its value."""
    line, begin, depth = 1, 0, 0
    for token in _TOKEN.finditer(text + "\n"):
        depth += _DEEPER.get(token[0], 0)
        if token[0] == "\n" and depth <= 0:
            statement = text[begin : token.start()]
            if (bare := statement.strip()) and not bare.startswith("#"):
                yield line, bare
            line += statement.count("\n") + 1
            begin = token.end()


def _keys(statement: str) -> Iterator[str]:
    """Yield the keys of a statement's dotted path."""
    at = 0
    while found := _KEY.match(statement, at):
        yield tomllib.loads(f"key = {found[1]}")["key"] if found[1][0] in "\"'" else found[1]
        if not found[2]:
            return
        at = found.end()


_PLACE = re.compile(r" \(at line (\d+), column (\d+)\)")
MOST = 20_000
"""Keys, tables and list entries that a TOML file may have, together."""


def read_toml(path: Path, links: bool = True) -> dict[str, Any]:
    """Return a TOML file's data.

    Raises UnitcadError with line and column if it does not parse, for a special file, and for one that is larger
    than `unitcad.files.LARGEST`; without `links` for a symbolic link too.
    """
    return parse_toml(read_text(path, links=links), str(path))


def parse_toml(text: str, name: str) -> dict[str, Any]:
    """Return a TOML text's data.

    Raises UnitcadError, which begins with `name`: with the place if the text does not parse, and if it is too large.
    """
    if has_more(text, MOST):
        raise UnitcadError(f"{name}: has more than {MOST:,} keys, tables and list entries")
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        place = _PLACE.search(str(error))
        line, column = (int(place[1]), int(place[2])) if place else (text.count("\n") + 1, 1)
        advice = _advice(text, line, column)
        why = _PLACE.sub("", str(error)).replace(" (at end of document)", ": the file ends too early")
        why = why.replace("Illegal character '\\n'", "the quotes do not end in their line")
        why = re.sub(r"Cannot (declare|overwrite) .*", "the line sets a key or table for the second time", why)
        raise UnitcadError(f"{name}:{line}:{column}: not TOML: {why}{advice}") from None
    except RecursionError:
        raise UnitcadError(f"{name}: nests too deeply") from None
    except ValueError:
        raise UnitcadError(f"{name}: has a number of thousands of digits") from None


def _advice(text: str, line: int, column: int) -> str:
    """Return the advice for a usual mistake at the place of a parser's error; "" for another one."""
    statement = text.split("\n")[line - 1]
    before, after = statement[: column - 1], statement[column - 1 :]
    word = re.match(r"[^\W\d][\w./ -]*", after)
    if word and word[0].lower() in ("true", "false"):
        return f"; write {word[0].lower()} in small letters"
    if word and before.rstrip().endswith(("=", "[", ",")):
        return f'; put quotes round a text: "{word[0].strip()}"'
    if (number := re.search(r"([-+]?\d+)$", before)) and (decimals := re.match(r",(\d+)", after)):
        return f"; write a point in a number: {number[1]}.{decimals[1]}"
    if (number := re.search(r"[-+]?\d[\d.]*\s*$", before)) and word:
        return f"; write a number without its unit: {number[0].strip()}"
    if key := re.match(r"\s*([\w-]+)\s*:", statement):
        return f"; write {key[1]} = ..."
    return '; this is JSON: write name = "value"' if text.lstrip().startswith("{") else ""
