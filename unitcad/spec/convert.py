"""Plain data to typed tables by msgspec; what it finds wrong is said in our words, with field, value and limit."""

from __future__ import annotations

import datetime
import math
import re
import typing
from collections.abc import Iterator, Mapping
from typing import Any, Literal, TypeVar

import msgspec

from unitcad.errors import Refusal, unknown_key, unknown_name
from unitcad.spec.fields import alternatives, entry_in, fields_of, meaning, named_in, table_in
from unitcad.text import invisible, printable, without_invisible

T = TypeVar("T")
_NAMES = {
    "float": "a number",
    "int": "a whole number",
    "str": "a text",
    "bool": "true or false",
    "array": "a list",
    "object": "a table",
    "null": "nothing",
}
_BOUND = re.compile(r"Expected `(?P<kind>\w+)`(?P<length> of length)? (?P<sign>[<>]=) (?P<limit>\S+)")
_LENGTH = re.compile(r"Expected `array` of length (?P<length>\d+)")
_KIND = re.compile(r"Expected `(?P<kinds>[^`]+)`")
_STEP = re.compile(r"\.([^.\[]+)|\[(\d+|\.\.\.)\]")
_HALF_PAIR = re.compile(r"[\ud800-\udfff]")
"""What stands for a byte that is not UTF-8."""
_MOST_KEYS = 5
"""Keys of a table that a refusal names."""
_LARGEST_INT = 2**63 - 1
_SIGNS = {">=": "at least", "<=": "at most"}
SOURCE = "design_source"
"""The field whose text has lines."""
DEEPEST = 20
"""Tables in tables that data may have: more than any spec or sweep needs."""


def convert(data: Mapping[str, Any], kind: type[T], field: str = "") -> T:
    """`data`, the table at `field`, as a `kind`, types strict. Raises Refusal for the first value that can't be one.

    A number that is infinite, huge or none is refused wherever it stands, and so is what nests too deeply. A kind's
    numbers have limits that they may reach (ge, le), so that a limit is what a refusal can offer.
    """
    check_plain(data, field)
    try:
        return msgspec.convert(data, kind)
    except msgspec.ValidationError as error:
        if str(error).startswith("Object contains unknown"):
            raise next(_unknown(data, kind, field)) from None
        before, _, last = str(error).rpartition(" - at `$")
        raise _refusal(before or last, last.removesuffix("`") if before else "", data, kind, field) from None


def check_plain(node: Any, field: str = "", depth: int = 0) -> None:
    """Raise Refusal for what no key takes: huge numbers and NaN, dates, characters that nobody sees, deep nesting."""
    if isinstance(node, str) and SOURCE not in field.split("."):
        _check_text(node, field)
    if isinstance(node, float) and not math.isfinite(node):
        raise Refusal(field, node, "must be a finite number")
    if isinstance(node, int) and abs(node) > _LARGEST_INT:
        raise Refusal(field, node, "is too large for a number here")
    if isinstance(node, str) and _HALF_PAIR.search(node):
        raise Refusal(field, node, "is not text in UTF-8")
    if isinstance(node, datetime.date | datetime.time):
        raise Refusal(field, node, "is a date or time, which nothing here takes; put quotes round a text")
    if isinstance(node, Mapping | list | tuple):
        if depth > DEEPEST:
            raise Refusal(".".join(field.split(".")[:3]), "...", f"nests more than {DEEPEST} tables deep")
        for key, below in node.items() if isinstance(node, Mapping) else enumerate(node):
            if isinstance(key, str):
                _check_text(key, printable(_below(field, key)))
            check_plain(below, _below(field, key), depth + 1)


def _check_text(text: str, field: str) -> None:
    found = invisible(text)
    if found is not None:
        limit = f"holds {found!a}: control characters and those that turn the direction of text are refused"
        raise Refusal(field, text, limit, without_invisible(text).strip() or None)


def _below(field: str, key: object) -> str:
    return f"{field}.{key}" if field else str(key)


def _unknown(node: Any, kind: Any, field: str) -> Iterator[Refusal]:
    """Keys that their tables do not have: found here, since a key in a message may look like anything."""
    table = table_in(kind)
    if isinstance(node, Mapping) and table:
        fields = fields_of(table)
        for key, below in node.items():
            place = _below(field, key)
            if key in fields:
                yield from _unknown(below, fields[key].type, place)
            else:
                yield unknown_key(place, below, fields, "`unitcad schema`")
    elif isinstance(node, Mapping):
        for key, below in node.items():
            yield from _unknown(below, named_in(kind), _below(field, key))
    elif isinstance(node, list):
        for i, below in enumerate(node):
            yield from _unknown(below, entry_in(kind, i), _below(field, i))


def _refusal(what: str, path: str, data: Any, kind: Any, above: str) -> Refusal:
    """What msgspec says is wrong at `path` of `data`, in our words."""
    steps, value, kind = _followed(path, data, kind)
    field = ".".join([above, *steps] if above else steps)
    table = table_in(kind)
    if what.startswith("Object ") and table:
        fields = fields_of(table)
        missing = next(name for name, entry in fields.items() if entry.required and name not in value)
        return Refusal(_below(field, missing), None, "is required")
    if what.startswith("Invalid enum value"):
        return unknown_name(field, value, _words(kind))
    if bound := _BOUND.match(what):
        limit = float(bound["limit"])
        limit = int(limit) if bound["kind"] != "float" else limit
        if bound["length"]:
            of = "characters" if bound["kind"] == "str" else "entries"
            empty = bound["sign"] == ">="
            return Refusal(field, value, _needs(kind) if empty else f"must have at most {limit} {of}")
        return Refusal(field, value, f"must be {_SIGNS[bound['sign']]} {limit:g}", limit)
    if length := _LENGTH.match(what):
        return Refusal(field, value, f"must have {length['length']} entries")
    if kinds := _KIND.match(what):
        names = [_name(name, kind) for name in kinds["kinds"].split(" | ") if name != "null"]
        return Refusal(field, value, f"takes {', or '.join(names) if table else ' or '.join(names)}")
    return Refusal(field, value, what.lower())


def _name(plain: str, kind: Any) -> str:
    """A kind of plain data in words, with a table's keys: those it requires, else the first ones."""
    table = table_in(kind)
    if plain != "object" or not table:
        return _NAMES.get(plain, plain)
    fields = fields_of(table)
    required = [name for name, entry in fields.items() if entry.required]
    optional = [name for name in fields if name not in required][:_MOST_KEYS]
    if not required:
        return f"a table, with keys such as {', '.join(optional)}"
    return f"a table with {', '.join(required)}{' and, where wanted, ' if optional else ''}{', '.join(optional)}"


def _needs(kind: Any) -> str:
    """What an empty text, list or table must hold."""
    entry = named_in(kind) or entry_in(kind)
    words = f"one or more of {', '.join(_words(entry))}" if entry and _words(entry) else ""
    needed = meaning(kind) or words or ("one entry or more" if entry else "one character or more")
    return f"must not be empty: needs {needed}"


def _followed(path: str, node: Any, kind: Any) -> tuple[list[str], Any, Any]:
    """The steps of a path, what lies there and what should. msgspec names no key of a free table: it is found again."""
    steps: list[str] = []
    for name, index in _STEP.findall(path):
        table = table_in(kind)
        if index == "...":
            kind = named_in(kind)
            step = next(key for key, below in node.items() if not _fits(below, kind))
        elif index:
            step, kind = index, entry_in(kind, int(index))
        else:
            assert table is not None
            step, kind = name, fields_of(table)[name].type
        steps.append(step)
        node = node[int(step)] if isinstance(node, list | tuple) else node[step]
    return steps, node, kind


def _fits(value: Any, kind: Any) -> bool:
    try:
        msgspec.convert(value, kind)
    except msgspec.ValidationError:
        return False
    return True


def _words(kind: Any) -> list[str]:
    return [str(word) for k in alternatives(kind) if typing.get_origin(k) is Literal for word in typing.get_args(k)]
