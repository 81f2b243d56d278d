"""Introspection of the spec's tables: their keys, the kinds of value that a key takes, the meaning of a key."""

from __future__ import annotations

import types
import typing
from collections.abc import Iterator, Mapping
from functools import cache
from typing import Annotated, Any

import msgspec

_UNIONS = (typing.Union, types.UnionType)
Fields = Mapping[str, msgspec.structs.FieldInfo]


@cache
def fields_of(table: type[msgspec.Struct]) -> Fields:
    """Return the keys of a table as typed in a file, in the order of its class; worked out once, since it is slow."""
    return {field.encode_name: field for field in msgspec.structs.fields(table)}


def alternatives(kind: Any) -> tuple[Any, ...]:
    """Return the members of a union, without annotations."""
    if typing.get_origin(kind) is Annotated:
        return alternatives(typing.get_args(kind)[0])
    if typing.get_origin(kind) in _UNIONS:
        return tuple(inner for member in typing.get_args(kind) for inner in alternatives(member))
    return (kind,)


def table_in(kind: Any) -> type[msgspec.Struct] | None:
    """Return the table among the alternatives of `kind`."""
    return next((k for k in alternatives(kind) if _is_table(typing.get_origin(k) or k)), None)


def _is_table(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, msgspec.Struct)


def named_in(kind: Any) -> Any:
    """Return the kind of any name's value in a free table that `kind` allows; None if it allows none."""
    return next((typing.get_args(k)[1] for k in alternatives(kind) if typing.get_origin(k) is dict), None)


def entry_in(kind: Any, index: int = 0) -> Any:
    """Return the kind of entry `index` of a list that `kind` allows; None if it allows no list so long."""
    for member in alternatives(kind):
        if typing.get_origin(member) in (tuple, list):
            entries = typing.get_args(member)
            if typing.get_origin(member) is list or entries[-1] is Ellipsis:
                return entries[0]
            return entries[index] if index < len(entries) else None
    return None


def index_in(step: str, count: int) -> int | None:
    """Return a path's step as an index of a list of `count` entries; None if it is none."""
    if not (step.isascii() and step.isdigit()) or len(step) > len(str(count)):
        return None
    return int(step) if int(step) < count else None


def notes(kind: Any) -> Iterator[msgspec.Meta]:
    """Return the annotations of a kind and of the members of its unions."""
    if typing.get_origin(kind) is Annotated:
        yield from kind.__metadata__
        yield from notes(typing.get_args(kind)[0])
    elif typing.get_origin(kind) in _UNIONS:
        for member in typing.get_args(kind):
            yield from notes(member)


def titled(kind: Any) -> str:
    """Return the title that a kind is annotated with, or nothing."""
    return next((note.title for note in notes(kind) if note.title), "")


def meaning(kind: Any) -> str:
    """Return the description that a kind is annotated with, or nothing."""
    return next((note.description for note in notes(kind) if note.description), "")
