"""Dotted paths into a spec: those that exist, and the closest to one that does not."""

from __future__ import annotations

import difflib
import re
import typing
from collections import Counter
from collections.abc import Iterator, Mapping
from typing import Any

from unitcad.errors import Refusal, UnknownKey
from unitcad.rooms import load
from unitcad.spec.fields import alternatives, entry_in, fields_of, index_in, table_in
from unitcad.spec.raw import RawSpec
from unitcad.validation import compound_kind


def check_path(path: str, base: dict[str, Any], place: str = "sweep") -> None:
    """Refuse a path that no spec has, or that names a list entry which `base` (a spec's data) lacks.

    `place` is the table of the sweep file that has it. "layers.0.wall_mm", "estimate.frequency_hz" and whole tables
    ("fpcb", "layers") are paths.
    """
    kind: Any = _kind(base)
    node: Any = base
    steps = path.split(".")
    for i, step in enumerate(steps):
        table, entry = table_in(kind), entry_in(kind)
        if table is not None:
            if step not in fields_of(table):
                raise _unknown(path, base, place)
            kind = fields_of(table)[step].type
        elif entry is not None:
            there = node if isinstance(node, list) else []
            if index_in(step, len(there)) is None:
                limit = f"the base has no entry {step} of {'.'.join(steps[:i])}: {_entries(len(there))}"
                raise UnknownKey(f"{place}.{path}", None, limit)
            kind = entry
        elif any(typing.get_origin(k) is dict or k is Any for k in alternatives(kind)):
            return
        else:
            raise _unknown(path, base, place)
        node = node[int(step)] if isinstance(node, list) else node.get(step) if isinstance(node, dict) else None


_LABEL = 36
"""Characters of a label at most: a folder's name has 50 before its hash."""
_UNIT = re.compile(r"_(mm|deg|percent|hz|um|c|g|pct|kpa|kg_m3)$")


def label(values: Mapping[str, Any]) -> str:
    """Return the swept values as a variant's name has them, such as wall1.2-cap1: keys without units.

    A word, such as the name of a silicone, has no key. Keys that end alike have their entry's number: wall1-1.2.
    """
    short = {path: _UNIT.sub("", path.rpartition(".")[2]).replace("_", "-") for path in values}
    often = Counter(short.values())
    parts: list[str] = []
    for path, value in values.items():
        key, entry = short[path], re.search(r"\.([0-9]+)\.[^.]*$", path)
        if often[key] > 1 and entry:
            key = f"{key}{int(entry[1]) + 1}-"
        if isinstance(value, str):
            parts.append(value)
        elif isinstance(value, bool):
            parts.append(f"{'' if value else 'no-'}{short[path]}")
        elif isinstance(value, int | float):
            parts.append(f"{key}{value:.6g}")
        elif isinstance(value, list) and all(isinstance(each, int | float) for each in value):
            parts.append(f"{key}{'x'.join(f'{each:g}' for each in value)}")
    return "-".join(parts)[:_LABEL].rstrip("-.")


def _entries(count: int) -> str:
    """Say how the entries of a list are numbered."""
    if count < 2:
        return "its only one is 0" if count else "it is empty"
    return f"they are 0 to {count - 1}"


def known_paths(base: dict[str, Any]) -> list[str]:
    """List every path of a spec like `base`, tables and values, in the models' order."""
    return list(_walk(_kind(base), "", base))


def _kind(base: dict[str, Any]) -> Any:
    kind = compound_kind(base)
    return load(kind.model) if kind else RawSpec


def _walk(kind: Any, prefix: str, node: Any) -> Iterator[str]:
    table, entry = table_in(kind), entry_in(kind)
    if table is not None:
        for name, field in fields_of(table).items():
            yield f"{prefix}{name}"
            yield from _walk(field.type, f"{prefix}{name}.", node.get(name) if isinstance(node, dict) else None)
    elif entry is not None:
        for i, below in enumerate(node if isinstance(node, list) else []):
            yield from _walk(entry, f"{prefix}{i}.", below)


def _unknown(path: str, base: dict[str, Any], place: str) -> Refusal:
    known = known_paths(base)
    begun = sorted((name for name in known if path and name.startswith(path)), key=len)
    close = begun or difflib.get_close_matches(path, known, n=1, cutoff=0.0)
    return UnknownKey(f"{place}.{path}", None, "unknown key", close[0] if close else None)
