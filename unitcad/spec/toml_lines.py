"""The statements of a TOML text: whether it has too many, and the line on which each key is."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from functools import lru_cache
from itertools import islice

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
