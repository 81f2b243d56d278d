"""Introspection of the spec's tables: their keys, the values that a key takes, the meaning of a key."""

from __future__ import annotations

import inspect
import json
import types
import typing
from collections.abc import Iterator, Mapping
from functools import cache
from typing import Annotated, Any

import msgspec

_UNIONS = (typing.Union, types.UnionType)
PLAIN_KINDS: dict[type, str] = {
    bool: "true or false",
    int: "a whole number",
    float: "a number",
    str: "a text",
    list: "a list",
    dict: "a table",
}
"""Kinds of plain data in words, in the order in which a refusal lists them."""
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
    classes = (k for k in alternatives(kind) if isinstance(typing.get_origin(k) or k, type))
    return next((k for k in classes if issubclass(typing.get_origin(k) or k, msgspec.Struct)), None)


def named_in(kind: Any) -> Any:
    """Return the kind of any name's value in a free table that `kind` allows; None if it allows none."""
    return next((typing.get_args(k)[1] for k in alternatives(kind) if typing.get_origin(k) is dict), None)


def is_value(kind: Any) -> bool:
    """Tell whether `kind` takes no table, nor a list of tables: its key comes before every header of a file."""
    return not (table_in(kind) or named_in(kind) or table_in(entry_in(kind)))


def plain_kinds(kind: Any) -> set[type]:
    """Return the kinds of plain data that a `kind` is made from."""
    kinds: set[type] = set()
    for one in alternatives(kind):
        of = typing.get_origin(one) or one
        if of is typing.Literal:
            kinds |= {type(word) for word in typing.get_args(one)}
        elif of in (list, tuple):
            kinds.add(list)
        elif of is dict or table_in(one):
            kinds.add(dict)
        elif of in PLAIN_KINDS:
            kinds.add(of)
    return kinds


def takes_none(kind: Any) -> bool:
    """Tell whether a resolved spec may lack a value of this kind."""
    return bool({type(None), msgspec.UnsetType} & set(alternatives(kind)))


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
        yield from reversed(kind.__metadata__)  # the outer ones first
        yield from notes(typing.get_args(kind)[0])
    elif typing.get_origin(kind) in _UNIONS:
        for member in typing.get_args(kind):
            yield from notes(member)


def title_of(kind: Any) -> str:
    """Return the title that a kind is annotated with, or nothing."""
    return next((note.title for note in notes(kind) if note.title), "")


def meaning(kind: Any) -> str:
    """Return the description that a kind is annotated with, or nothing."""
    return next((note.description for note in notes(kind) if note.description), "")


def default_of(field: msgspec.structs.FieldInfo) -> str:
    """Return a key's default as JSON; "" for none, an empty one or a table."""
    value = field.default if field.default is not msgspec.NODEFAULT else field.default_factory()
    if value in (None, msgspec.UNSET) or isinstance(value, msgspec.Struct) or value in ((), {}, ""):
        return ""
    return json.dumps(value, default=list)


def values_of(kind: Any) -> str:
    """Return the values that a key takes in words: words, a range, or a type."""
    words: list[str] = []
    for one in alternatives(kind):
        origin = typing.get_origin(one)
        if origin is typing.Literal:
            words += [json.dumps(value) for value in typing.get_args(one)]
        elif one in (int, float):
            words.append(_range(kind, one))
        elif one in (str, bool):
            words.append("text" if one is str else "true, false")
        elif origin in (tuple, list):
            words.append(f"list of {values_of(entry_in(one))}")
        elif one not in (type(None), msgspec.UnsetType):
            words.append("table")
    return ", ".join(dict.fromkeys(words))


def _range(kind: Any, number: type) -> str:
    low = next((note.ge for note in notes(kind) if note.ge is not None), None)
    high = next((note.le for note in notes(kind) if note.le is not None), None)
    if low is None or high is None:
        name = "whole number" if number is int else "number"
        return name if low is None else f"{name} from {low:g}"
    if low == high:
        return f"{low:g}"
    return f"{low:g} to {high:g}{', whole' if number is int else ''}"


def document(table: type[msgspec.Struct]) -> str:
    """Return the docstring of a table with its keys as the parameters of numpydoc."""
    about, _, examples = inspect.cleandoc(table.__doc__ or "").partition("Examples\n")
    lines = [about.rstrip(), "", "Parameters", "----------"]
    for key, field in fields_of(table).items():
        default = "" if field.required else f", default {default_of(field)}" if default_of(field) else ", optional"
        text = meaning(field.type)
        lines += [f"{key} : {values_of(field.type)}{default}", f"    {text[:1].upper()}{text[1:]}."]
    raises = ["", "Raises", "------", "Refusal", "    When a Spec is made of a value that is not valid."]
    return "\n".join([*lines, *raises, *(["", "Examples", examples] if examples else [])])
