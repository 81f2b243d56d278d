"""TOML and JSON. This module parses all of it, and bounds it before another module sees the data.

A file or a message from outside may be made to do harm: a key of thousands of parts, lists within lists, a number of a
million digits. Its text is measured before it is parsed, and its data after that. The data is then a tree of dicts,
lists, texts, numbers, dates and None, at most `DEEPEST` deep. `expect_bounded` is the same check for data of a caller.
"""

from __future__ import annotations

import json
import os
import re
import tomllib
from collections.abc import Iterator, Mapping
from functools import lru_cache
from itertools import islice
from math import isfinite
from pathlib import Path
from typing import Any

from unitcad.errors import Refusal, UnitcadError
from unitcad.files import LARGEST, read, read_text
from unitcad.text import printable

DEEPEST = 20
"""Tables and lists in each other that data may have: more than any spec, sweep or result needs."""
MOST = 20_000
"""Keys, tables and list entries that a TOML text, or data of a caller, may have, together."""
LONGEST_KEY = 1000
"""Characters that a key may have, and a bare word of TOML."""
LONGEST_TEXT = 8_000_000
"""Characters that a text may have: more than a design's code or bodies have."""
LARGEST_INT = 2**63 - 1
MOST_LINES = 1_000_000
"""Lines that a TOML text may have, and escapes in its texts."""
_BYTES_A_TABLE = 64
"""Bytes of JSON for each table or list that it may have: a table of one key takes up to 240 bytes of memory."""
_STRING = r'"""(?:\\.|[^\\])*?(?:"{3,5}|\Z)|' + r"'''.*?(?:'{3,5}|\Z)|" + r'"(?:\\.|[^"\\\n]++)*+"?|' + r"'[^'\n]*+'?"
"""A text in quotes; one that does not end goes to the end of its line, or of all: no place is looked at twice."""
_TOKEN = re.compile(_STRING + r"|#[^\n]*|[\[\]{}=,\n]", re.DOTALL)
_MARK = re.compile(_STRING + r"|#[^\n]*|([\[=,.])|([\w+-]++)", re.DOTALL)
_KEY = re.compile(rf"[\[{{\s]*({_STRING}|[\w-]+)\s*(\.?)\s*", re.DOTALL)
_DEEPER = {"[": 1, "{": 1, "]": -1, "}": -1}
_PLACE = re.compile(r" \(at line (\d+), column (\d+)\)")


def expect_bounded(data: Any, field: str = "", most: int = MOST) -> None:
    """Raise Refusal for data, at `field`, that is no small tree.

    It may nest `DEEPEST` deep, which a table in itself exceeds, and have `most` entries, which tables that are shared
    again and again exceed. Keys, texts and whole numbers have their limits too.
    """
    left = most

    def look(node: Any, path: str, depth: int) -> None:
        nonlocal left
        if fields := getattr(node, "__struct_fields__", ()):  # a spec that Python code made
            node = {name: getattr(node, name) for name in fields}
        left -= len(node)
        if left < 0:
            raise Refusal(path or field, None, f"has more than {most:,} keys, tables and list entries")
        named = isinstance(node, Mapping)
        for key, value in node.items() if named else enumerate(node):
            if named and isinstance(key, str) and len(key) > LONGEST_KEY:
                limit = f"a key has at most {LONGEST_KEY} characters"
                raise Refusal(_below(path, f"{printable(key[:20])}..."), len(key), limit)
            if isinstance(value, float) or value is None:
                continue
            if isinstance(value, str):
                if len(value) > LONGEST_TEXT:
                    limit = f"a text has at most {LONGEST_TEXT:,} characters, not {len(value):,}"
                    raise Refusal(_below(path, key), None, limit)
            elif isinstance(value, int):
                if not -LARGEST_INT <= value <= LARGEST_INT:
                    raise Refusal(_below(path, key), value, "is too large for a number here")
            elif _holds(value):
                below = _below(path, key)
                if depth == DEEPEST:
                    raise Refusal(".".join(below.split(".")[:3]), "...", f"nests more than {DEEPEST} tables deep")
                look(value, below, depth + 1)

    if _holds(data):
        look(data, field, 0)
    else:
        look({field: data}, "", 0)


def _holds(value: object) -> bool:
    return isinstance(value, Mapping | list | tuple) or hasattr(value, "__struct_fields__")


def _below(path: str, key: object) -> str:
    return f"{path}.{key}" if path else str(key)


def read_toml(path: Path, links: bool = True) -> dict[str, Any]:
    """Return a TOML file's data.

    Raises UnitcadError with line and column if it does not parse, for a special file, and for one that is larger
    than `unitcad.files.LARGEST`; without `links` for a symbolic link too. Else as `parse_toml`.
    """
    return parse_toml(read_text(path, links=links), str(path))


def parse_toml(text: str, name: str) -> dict[str, Any]:
    """Return a TOML text's data.

    Raises UnitcadError, which begins with `name`: with the place if the text does not parse, and if it is too large.
    Raises Refusal, with `name` and line, for data that is out of bounds.
    """
    try:
        _measure(text, name)
        data = tomllib.loads(text)
        expect_bounded(data)
    except tomllib.TOMLDecodeError as error:
        place = _PLACE.search(str(error))
        line, column = (int(place[1]), int(place[2])) if place else (text.count("\n") + 1, 1)
        advice = _advice(text, line, column)
        why = _PLACE.sub("", str(error)).replace(" (at end of document)", ": the file ends too early")
        why = why.replace("Illegal character '\\n'", "the quotes do not end in their line")
        why = re.sub(r"Cannot (declare|overwrite) .*", "the line sets a key or table for the second time", why)
        raise UnitcadError(f"{name}:{line}:{column}: not TOML: {why}{advice}") from None
    except Refusal as refusal:
        refusal.file, refusal.line = name, refusal.line or line_of(text, refusal.field)
        raise
    except RecursionError:
        raise UnitcadError(f"{name}: nests too deeply") from None
    return data


def parse_value(text: str) -> Any:
    """Return the value of a text in TOML syntax, such as [2, 3]. Raises UnitcadError, also for more than a value."""
    data = parse_toml(f"value = {text}", "the value")
    if len(data) > 1:
        raise UnitcadError("the value: is more than one value")
    return data["value"]


def _measure(text: str, name: str) -> None:
    """Raise UnitcadError, which begins with `name`, for a TOML text that would cost much to parse.

    tomllib takes a kilobyte for each part of a key, a time that grows as the square of a key's parts, and a loop's turn
    for each line and escape.
    """
    for mark, noun in (("\n", "lines"), ("\\", "escapes")):
        if text.count(mark) > MOST_LINES:
            raise UnitcadError(f"{name}: has more than {MOST_LINES:,} {noun}")
    marks = dots = words = row = 0
    for token in _MARK.finditer(text) if len(text) > DEEPEST else ():
        if token[1] == ".":
            dots, row = dots + 1, row + 1
            if row > DEEPEST:
                raise _deep_key(text, token.start())
        elif token[1]:
            marks, row = marks + 1, 0
        elif token[2]:
            words += 1
            if len(token[2]) > LONGEST_KEY:
                line = text.count("\n", 0, token.start()) + 1
                raise UnitcadError(f"{name}:{line}: a key or number of more than {LONGEST_KEY} characters")
        if max(marks, dots / 2, words / 5) > MOST:  # a mark has at most a key and a value beside it, with one dot each
            raise UnitcadError(f"{name}: has more than {MOST:,} keys, tables and list entries")


def _deep_key(text: str, at: int) -> Refusal:
    """Return the refusal of a key of too many parts, of which one ends at a place in the text."""
    begin = max(text.rfind(mark, 0, at) + 1 for mark in "\n=,")
    first = islice(_keys(text[begin : begin + 4 * LONGEST_KEY]), 3)
    refusal = Refusal(".".join(printable(part[:40]) for part in first), "...", f"nests more than {DEEPEST} tables deep")
    refusal.line = text.count("\n", 0, at) + 1
    return refusal


def _advice(text: str, line: int, column: int) -> str:
    """Return the advice for a usual mistake at the place of a parser's error; "" for another one."""
    statement = text.split("\n")[line - 1]
    before, after = statement[: column - 1][-200:], statement[column - 1 :][:200]  # a pattern takes the square of it
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


def editable_toml(text: str, name: str) -> Any:
    """Return a TOML text as a document of tomlkit (extra `serve`), whose comments stay. Raises as `parse_toml`."""
    import tomlkit
    from tomlkit.exceptions import TOMLKitError

    parse_toml(text, name)
    try:
        return tomlkit.parse(text)
    except (TOMLKitError, RecursionError, ValueError):
        raise UnitcadError(f"{name}: has TOML that can't be edited value by value; change the text") from None


def read_json(path: str | os.PathLike[str], *, largest: int = LARGEST, links: bool = True) -> Any:
    """Return the data of a JSON file of at most `largest` bytes, all of its numbers finite.

    Raises NotThere if there is no such file, UnitcadError for any other reason; without `links` for a symbolic link.
    """
    return parse_json(read(path, largest=largest, links=links), os.fspath(path), largest=largest)


def parse_json(content: bytes | str, name: str, *, largest: int = LARGEST) -> Any:
    """Return the data of JSON, all of its numbers finite; `largest` is that of its kind of file.

    Raises UnitcadError, which begins with `name`, for text that is not JSON, and for data that is out of bounds.
    """
    content = content.encode("utf-8", "surrogatepass") if isinstance(content, str) else content
    tables = content.count(b"[") + content.count(b"{")
    if tables > max(MOST, largest // _BYTES_A_TABLE):
        raise UnitcadError(f"{name}: has more than {largest // _BYTES_A_TABLE:,} tables and lists")
    try:
        data = json.loads(content.decode(), parse_constant=_finite, parse_float=_finite)
        if _SURROGATE.search(content):
            json.dumps(data, ensure_ascii=False).encode()  # half of a pair is no text
        expect_bounded(data, most=len(content))
    except UnicodeDecodeError as error:
        raise UnitcadError(f"{name}: not UTF-8 (byte {error.start})") from None
    except UnicodeEncodeError:
        raise UnitcadError(f"{name}: not JSON: it has half of a surrogate pair") from None
    except RecursionError:
        raise UnitcadError(f"{name}: not JSON: nests too deeply") from None
    except Refusal as refusal:
        raise UnitcadError(f"{name}: {refusal}") from None
    except ValueError as error:
        why = "a number has thousands of digits" if "integer string" in str(error) else str(error)
        raise UnitcadError(f"{name}: not JSON: {why}") from None
    return data


_SURROGATE = re.compile(rb"\\u[dD][89a-fA-F]")


def _finite(text: str) -> float:
    if not isfinite(value := float(text)):
        raise ValueError(f"{text[:30]} is not a finite number")
    return value
