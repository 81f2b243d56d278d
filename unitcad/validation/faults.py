"""Every fault of a spec, each with its line in the file, and a value to offer that is then accepted.

Validation stops at the first fault. To find the next one another value is put in its place: the nearest accepted one,
else that of the shipped template of the same design. What is refused then stands in the data as it was
typed, so it is no consequence of the change.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterator
from typing import Any

from unitcad.errors import Refusal, UnitcadError, UnknownKey
from unitcad.validation.dotted import ABSENT, at, drop, put

Judge = Callable[[dict[str, Any]], object]
"""Validates plain data; raises Refusal for the first fault."""
MOST = 20
"""Faults that are looked for, at most."""
_MOST_LIMITS = 5
"""Limits of one field that are tried out in turn for a value to offer."""


def settled(refusal: Refusal, data: dict[str, Any], judge: Judge, sound: dict[str, Any]) -> Refusal:
    """Return the refusal, offering a value that passes every check of its field: one limit may lie beyond another.

    A fault of another field that is met first is passed over as in `faults`.
    """
    nearest, limit = refusal.nearest, refusal.limit
    for _ in range(_MOST_LIMITS):
        if nearest is None:
            break
        try:
            tried = copy.deepcopy(data)
            put(tried, refusal.field, nearest)
        except Refusal:
            return Refusal(refusal.field, refusal.value, limit, nearest)
        other = next((each for each in _found(tried, judge, sound) if each.field == refusal.field), None)
        if other is None:
            return Refusal(refusal.field, refusal.value, limit, nearest)
        nearest, limit = other.nearest, f"{refusal.limit}, and {other.limit}"
    return Refusal(refusal.field, refusal.value, refusal.limit)


def every_fault(first: Refusal, data: dict[str, Any], judge: Judge, sound: dict[str, Any]) -> list[Refusal]:
    """Return the faults of plain data, `first` among them, the one that was met; arguments as of `faults`."""
    try:
        every = faults(data, judge, sound)
    except RecursionError:  # nested too deeply to be looked through again
        return [first]
    if not any(str(one) == str(first) for one in every):
        every = [first, *(one for one in every if one.field != first.field)]
    return every


def faults(data: dict[str, Any], judge: Judge, sound: dict[str, Any]) -> list[Refusal]:
    """Return the faults of a spec's plain data, in the order in which they are met; `sound` is a template's data."""
    found = []
    for refusal in _found(data, judge, sound):
        there = at(data, refusal.field)
        missing = refusal.value is None and there is ABSENT
        if missing or isinstance(refusal, UnknownKey) or (there is not ABSENT and there == refusal.value):
            found.append(refusal if isinstance(refusal, UnknownKey) else settled(refusal, data, judge, sound))
    return found


def _found(data: dict[str, Any], judge: Judge, sound: dict[str, Any]) -> Iterator[Refusal]:
    """Yield one fault after the other, each passed over before the next; stops at one that can't be."""
    tried, seen = copy.deepcopy(data), set[str]()
    while len(seen) < MOST:
        refusal = _first(tried, judge)
        if refusal is None or refusal.field in seen:
            return
        yield refusal
        seen.add(refusal.field)
        changed = next((one for one in _changes(tried, refusal, sound) if _met(one, judge, refusal.field)), None)
        if changed is None:
            return
        tried = changed


def _met(data: dict[str, Any], judge: Judge, field: str) -> bool:
    refusal = _first(data, judge)
    return refusal is None or refusal.field != field


def _first(data: dict[str, Any], judge: Judge) -> Refusal | None:
    try:
        judge(data)
    except Refusal as refusal:
        return refusal
    except UnitcadError:
        return None
    return None


def _changes(data: dict[str, Any], refusal: Refusal, sound: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """Yield copies of the data with another value in the refused one's place, or without it."""
    values = [ABSENT if refusal.nearest is None else refusal.nearest, at(sound, refusal.field)]
    for value in () if isinstance(refusal, UnknownKey) else values:
        changed = copy.deepcopy(data)
        if value is not ABSENT:
            try:
                put(changed, refusal.field, value)
            except Refusal:
                continue
            yield changed
    # A word of a list of words: the list's default takes its place.
    for path in (refusal.field, refusal.field.rpartition(".")[0]):
        changed = copy.deepcopy(data)
        if path and drop(changed, path):
            yield changed
