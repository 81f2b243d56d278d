"""Plain data to typed tables by msgspec; what it finds wrong is said in our words, with field, value and limit."""

from __future__ import annotations

import math
import re
import typing
from collections.abc import Iterator, Mapping
from typing import Any, Literal, TypeVar

import msgspec

from unitcad.errors import Refusal, unknown_key, unknown_name
from unitcad.spec.fields import alternatives, entry_in, fields_of, notes, table_in

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
_BOUND = re.compile(r"Expected `(?P<kind>\w+)`(?P<length> of length)? (?P<sign>[<>]=?) (?P<limit>\S+)")
_LENGTH = re.compile(r"Expected `array` of length (?P<length>\d+)")
_KIND = re.compile(r"Expected `(?P<kinds>[^`]+)`")
_STEP = re.compile(r"\.([^.\[]+)|\[(\d+|\.\.\.)\]")
_SIGNS = {">": "more than", ">=": "at least", "<": "less than", "<=": "at most"}
_LEAST = 0.001
"""What is offered in place of a number that must be above zero: the step in which lengths are typed. A kind may name
another one (`nearest` in the extra of its Meta)."""


def convert(data: Mapping[str, Any], kind: type[T], field: str = "") -> T:
    """`data`, the table at `field`, as a `kind`, types strict. Raises Refusal for the first value that can't be one.

    An infinite number or one that is none is refused wherever it stands.
    """
    for place, value in _numbers(data, field):
        if not math.isfinite(value):
            raise Refusal(place, value, "must be a finite number")
    try:
        return msgspec.convert(data, kind)
    except msgspec.ValidationError as error:
        if str(error).startswith("Object contains unknown"):
            raise next(_unknown(data, kind, field)) from None
        before, _, last = str(error).rpartition(" - at `$")
        raise _refusal(before or last, last.removesuffix("`") if before else "", data, kind, field) from None


def _numbers(node: Any, field: str) -> Iterator[tuple[str, float]]:
    if isinstance(node, float):
        yield field, node
    elif isinstance(node, Mapping | list | tuple):
        for key, below in node.items() if isinstance(node, Mapping) else enumerate(node):
            yield from _numbers(below, _below(field, key))


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
                yield unknown_key(place, below, fields)
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
        return Refusal(_below(field, missing), "nothing", "is required")
    if what.startswith("Invalid enum value"):
        return unknown_name(field, value, _words(kind))
    shown = value if isinstance(value, int | float | str) else str(value)[:60]
    if bound := _BOUND.match(what):
        limit = float(bound["limit"])
        limit = int(limit) if bound["kind"] != "float" else limit
        if bound["length"]:
            of = "characters" if bound["kind"] == "str" else "entries"
            empty = bound["sign"] == ">="
            return Refusal(field, shown, "must not be empty" if empty else f"must have at most {limit} {of}")
        least = max((note.extra["nearest"] for note in notes(kind) if note.extra), default=_LEAST)
        nearest = least if bound["sign"] == ">" else limit
        return Refusal(field, shown, f"must be {_SIGNS[bound['sign']]} {limit:g}", nearest)
    if length := _LENGTH.match(what):
        return Refusal(field, shown, f"must have {length['length']} entries")
    if kinds := _KIND.match(what):
        names = [_NAMES.get(name, name) for name in kinds["kinds"].split(" | ") if name != "null"]
        return Refusal(field, shown, f"takes {' or '.join(names)}")
    return Refusal(field, shown, what.lower())


def _followed(path: str, node: Any, kind: Any) -> tuple[list[str], Any, Any]:
    """The steps of a path, what lies there and what should. msgspec names no key of a free table: it is found again."""
    steps: list[str] = []
    for name, index in _STEP.findall(path):
        table = table_in(kind)
        if index == "...":
            kind = next(typing.get_args(k)[1] for k in alternatives(kind) if typing.get_origin(k) is dict)
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
