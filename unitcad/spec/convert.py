"""Plain data to typed tables by msgspec; a value that is not valid is refused with field, value and limit."""

from __future__ import annotations

import datetime
import math
import re
import typing
from collections.abc import Iterator, Mapping
from typing import Any, Literal, TypeVar

import msgspec

from unitcad.documents import expect_bounded
from unitcad.errors import Refusal, UnknownKey, unknown_key, unknown_name
from unitcad.spec.fields import (
    PLAIN_KINDS,
    alternatives,
    entry_in,
    fields_of,
    is_value,
    meaning,
    named_in,
    notes,
    plain_kinds,
    table_in,
)
from unitcad.spec.paths import EXACT, bare, in_words, lone_path, meant
from unitcad.text import invisible, measured, printable, without_invisible

T = TypeVar("T")
_HALF_PAIR = re.compile(r"[\ud800-\udfff]")
"""Replacement of a byte that is not UTF-8."""
_MOST_KEYS, _MOST_WORDS = 5, 8
"""Keys of a table, and words of a key, that a refusal names."""
_SWITCH = {"true": True, "yes": True, "on": True, "false": False, "no": False, "off": False}
"""Texts that mean true or false."""
SOURCES = frozenset({"design_source", "file_source", "fit_source"})
"""The fields whose text has lines."""
_MOST = 1_000_000
"""Entries of the largest record."""
LONGEST_NAME = 120
"""Characters that the name of a key or of a table may have."""


def convert(data: Mapping[str, Any], kind: type[T], field: str = "") -> T:
    """Return `data`, the table at `field`, as a `kind`, types strict. Raises Refusal for the first unfit value.

    Data out of the bounds of `unitcad.documents` is refused, and a number that is infinite or none at any place. A
    kind's numbers have limits that they may reach (ge, le), so that a refusal can offer the limit. A key whose value is
    None counts as missing.
    """
    expect_bounded(data, field, most=_MOST)
    check_plain(data, field)
    data = without_none(data)
    try:
        return msgspec.convert(data, kind)
    except msgspec.ValidationError:
        refusal = next(_refusals(data, kind, field))
        key = refusal.field.rpartition(".")[2]
        top = fields_of(table).get(key) if not field and (table := table_in(kind)) else None
        if isinstance(refusal, UnknownKey) and key != refusal.field and top and is_value(top.type):
            limit = f"unknown key; {key} belongs above the first [table]"
            raise UnknownKey(refusal.field, refusal.value, limit) from None
        raise _by_meaning(refusal, data, kind) if isinstance(refusal, UnknownKey) and not field else refusal from None


def _by_meaning(refusal: UnknownKey, data: Mapping[str, Any], kind: Any) -> UnknownKey:
    """Return the refusal of a key with the paths that it may mean, if a path of the file means more than its spelling.

    An exact key of another table comes before one of like spelling in its own, a word of a description after it. The
    spelling of a key with an entry's number in brackets says nothing. `printer.layer_mm` is moulds.layer_mm.
    """
    path, value = lone_path(refusal.field, refusal.value)
    spelt = refusal.nearest is not None and "[" not in refusal.field
    close = None if refusal.settled else meant(path, value, kind, data, least=EXACT if spelt else 1)
    if (
        not close and not refusal.settled and path != refusal.field
    ):  # a key of another table, below a name that is no table
        found = meant(path.rpartition(".")[2], value, kind, data, least=EXACT)
        close = found if len(found) == 1 else None
    if not close:
        return refusal
    if close == [refusal.nearest]:
        return UnknownKey(refusal.field, refusal.value, refusal.limit, refusal.nearest, tuple(close))
    limit = f"unknown key; known: {in_words(close)}"
    return UnknownKey(path, value, limit, close[0] if len(close) == 1 else None, tuple(close), refusal.field)


def without_none(node: Any) -> Any:
    """Return plain data without the keys whose value is None."""
    if isinstance(node, Mapping):
        return {key: without_none(value) for key, value in node.items() if value is not None}
    return [without_none(value) for value in node] if isinstance(node, list | tuple) else node


def check_plain(node: Any, field: str = "") -> None:
    """Raise Refusal for values that no key takes: infinity and NaN, dates, invisible characters, long names."""
    if isinstance(node, str) and not SOURCES.intersection(field.split(".")):
        _check_text(node, field)
    if isinstance(node, float) and not math.isfinite(node):
        raise Refusal(field, node, "must be a finite number")
    if isinstance(node, str) and _HALF_PAIR.search(node):
        raise Refusal(field, node, "is not text in UTF-8")
    if isinstance(node, datetime.date | datetime.time):
        raise Refusal(field, node, "is a date or time, which nothing here takes; put quotes round a text")
    if isinstance(node, Mapping | list | tuple):
        for key, below in node.items() if isinstance(node, Mapping) else enumerate(node):
            if isinstance(key, str):
                if len(key) > LONGEST_NAME:
                    name = f"{printable(key[:20])}..."
                    raise Refusal(_below(field, name), len(key), f"a name has at most {LONGEST_NAME} characters")
                _check_text(key, printable(_below(field, key)))
            check_plain(below, _below(field, key))


def _check_text(text: str, field: str) -> None:
    refused = invisible(text)
    if refused is not None:
        limit = f"has {refused!a}: control characters and those that turn the direction of text are refused"
        raise Refusal(field, text, limit, without_invisible(text).strip() or None)


def _below(field: str, key: object) -> str:
    return f"{field}.{key}" if field else str(key)


def _refusals(node: Any, kind: Any, field: str) -> Iterator[Refusal]:
    """Yield the refusals of `node` as a `kind`, in the order of the data.

    msgspec reports place and reason only in a sentence, so place and limit are looked up in the types again.
    """
    if _fits(node, kind):
        return
    table, named, entry = table_in(kind), named_in(kind), entry_in(kind)
    if isinstance(node, Mapping) and table:
        fields = fields_of(table)
        for key, below in node.items():
            if key in fields:
                yield from _refusals(below, fields[key].type, _below(field, key))
            else:
                gone = getattr(table, "removed", {}).get(key, "")
                instead = gone if not gone or gone in fields else f"it went: {gone}"
                instead = instead or getattr(table, "elsewhere", {}).get(bare(key), "")
                yield unknown_key(_below(field, key), below, fields, "`unitcad schema`", instead)
        missing = (name for name, entry in fields.items() if entry.required and name not in node)
        yield from (Refusal(_below(field, name), None, "is required") for name in missing)
        return
    inside: Iterator[tuple[object, Any, Any]] = iter(())
    if isinstance(node, Mapping) and named:
        inside = ((key, below, named) for key, below in node.items())
    elif isinstance(node, list | tuple) and entry:
        inside = ((i, below, entry_in(kind, i)) for i, below in enumerate(node) if entry_in(kind, i))
    for key, below, of in inside:
        yield from _refusals(below, of, _below(field, key))
    yield _refusal(node, kind, field)


def _refusal(value: Any, kind: Any, field: str) -> Refusal:
    """Return why a value itself can't be a `kind`: its type, its word, its size or its length."""
    table, known, words = table_in(kind), plain_kinds(kind), _words(kind)
    given = next((plain for plain in (bool, float, str, dict) if isinstance(value, plain)), type(value))
    if isinstance(value, str) and words:
        unknown = unknown_name(field, value, words)
        others = [_name(plain, kind) for plain in PLAIN_KINDS if plain in known - {str}]
        meant = [int(one) for one in re.findall(r"\d+", value)] if list in known else None
        nearest = meant if meant is not None and _fits(meant, kind) else unknown.nearest
        return Refusal(field, value, " or ".join([unknown.limit, *others]), nearest)
    if not (given in known or (given is int and float in known)):
        names = [_name(plain, kind) for plain in PLAIN_KINDS if plain in known]
        limit = f"takes {', or '.join(names) if table else ' or '.join(names)}"
        meant = (
            [value] * _length(kind)  # a single value may be meant as the list
            if list in known
            else measured(value, field.rpartition("_")[2])
            if known & {int, float}
            else _SWITCH.get(str(value))
            if bool in known
            else None
        )
        return Refusal(field, value, limit, meant if _fits(meant, kind) else None)
    if isinstance(value, int | float):
        return next(_out_of_range(value, kind, field))
    tuples = [typing.get_args(k) for k in alternatives(kind) if typing.get_origin(k) is tuple]
    fixed = [len(entries) for entries in tuples if Ellipsis not in entries]
    most = [note.max_length for note in notes(kind) if note.max_length is not None]
    least = [note.min_length for note in notes(kind) if note.min_length is not None]
    if not value and not fixed:
        content = named_in(kind) or entry_in(kind)
        entries = f"one or more of {', '.join(_words(content))}" if content and _words(content) else ""
        needed = entries or meaning(kind) or ("one entry or more" if content else "one character or more")
        return Refusal(field, value, f"must not be empty: needs {needed}")
    things = "characters" if given is str else "entries"
    if least and len(value) < least[0]:
        return Refusal(field, value, f"must have at least {least[0]} {things}")
    if most and len(value) > most[0]:
        return Refusal(field, value, f"must have at most {most[0]} {things}")
    if fixed:
        return Refusal(field, value, f"must have {fixed[0]} entries")
    pattern = next(note.pattern for note in notes(kind) if note.pattern is not None)
    written = re.sub(r"[^a-z0-9]+", "-", str(value).lower()).strip("-")
    return Refusal(field, value, f"must be {meaning(kind) or pattern}", written if _fits(written, kind) else None)


def _out_of_range(value: float, kind: Any, field: str) -> Iterator[Refusal]:
    for note in notes(kind):
        for limit, words, broken in ((note.ge, "at least", float.__lt__), (note.le, "at most", float.__gt__)):
            if limit is not None and broken(float(value), float(limit)):
                nearest = limit if float not in plain_kinds(kind) else float(limit)
                yield Refusal(field, value, f"must be {words} {limit:g}", nearest)


def _name(plain: type, kind: Any) -> str:
    """Name a kind of plain data, with a list's entries and a table's keys: the required ones, or the first ones."""
    table = table_in(kind)
    if plain is list:
        return f"a list{_list_of(kind)}"
    if plain is str and _words(kind):
        return " or ".join(f'"{word}"' for word in _words(kind)[:_MOST_WORDS])
    if plain is not dict or not table:
        return PLAIN_KINDS[plain]
    fields = fields_of(table)
    required = [name for name, entry in fields.items() if entry.required]
    optional = [name for name in fields if name not in required][:_MOST_KEYS]
    if not required:
        return f"a table, with keys such as {', '.join(optional)}"
    return f"a table with {', '.join(required)}{' and optionally ' if optional else ''}{', '.join(optional)}"


def _list_of(kind: Any) -> str:
    """Describe a list of tables by its meaning or their keys, another list by an example."""
    entry = entry_in(kind)
    if table_in(entry):
        return f": {meaning(kind)}" if meaning(kind) else f", each entry {_name(dict, entry)}"
    examples = {str: '"a"', int: "1", float: "1.5", bool: "true", dict: "{}"}
    if list in plain_kinds(entry):
        return f" such as [{_list_of(entry).removeprefix(' such as ')}]"
    one = f'"{_words(entry)[0]}"' if _words(entry) else next(examples[k] for k in examples if k in plain_kinds(entry))
    return f" such as [{', '.join([one] * _length(kind))}]"


def _length(kind: Any) -> int:
    """Return the number of entries of a list; one if it is not fixed."""
    tuples = [typing.get_args(k) for k in alternatives(kind) if typing.get_origin(k) is tuple]
    return next((len(entries) for entries in tuples if Ellipsis not in entries), 1)


def _fits(value: Any, kind: Any) -> bool:
    try:
        msgspec.convert(value, kind)
    except msgspec.ValidationError:
        return False
    return True


def _words(kind: Any) -> list[str]:
    return [str(word) for k in alternatives(kind) if typing.get_origin(k) is Literal for word in typing.get_args(k)]
