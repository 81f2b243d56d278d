"""Offers for a refused array: changes that were tried and accepted."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from unitcad.errors import Refusal, format_value
from unitcad.validation.plain_data import at
from unitcad.validation.suggestions import (
    Judge,
    bare,
    culprit_of,
    find_refusal,
    follow,
    good_numbers,
    is_number,
    nearest_number,
    numbers,
    write_changes,
)

MOST_TRIED, _LARGE = 4_000, 400
"""Places of all tried arrays together, at most, and of one: a try of an array of so many takes a second."""
_PITCH = "layout.pitch_mm"
_OF_TAIL = ("fpcb.tail_length_mm", "wires.length_mm")
_WIDEST = 16
"""How much wider a pitch may be that needs no other change, mm."""
_PITCHES = 3
"""Pitches to either side of the present one that are tried."""
_MANY = 64
"""Of an array with more places no other pitch or slot is tried: a try takes seconds."""
_FEW = 16
"""Of an array with more places no smaller bed is looked for than the tools of it ask for one by one."""
_OF_BED, _OF_CIRCUIT = "moulds.bed_", "circuit."
_COUNTS: dict[str, dict[str, str]] = {
    "grid": {"moulds.bed_x_mm": "columns", "moulds.bed_y_mm": "rows"},
    "hex": {"moulds.bed_x_mm": "rings", "moulds.bed_y_mm": "rings"},
    "ring": {"moulds.bed_x_mm": "count", "moulds.bed_y_mm": "bands"},
}
"""Keys that shorten an array of a kind of layout along each side of the bed."""


def suggest_for_array(refusal: Refusal, data: Mapping[str, Any], judge: Judge, sound: Mapping[str, Any]) -> Refusal:
    """Return the refusal of plain data with a suggestion that was tried; `sound` is the data of a shipped array.

    The nearest value is accepted, or the limit names the other values that it needs.
    """
    if type(refusal) is not Refusal or (refusal.value is None and refusal.nearest is None):
        return refusal
    judge = _patient(judge)
    field, limit = refusal.field, refusal.limit
    if field.endswith(_OF_TAIL):
        pitch = at(data, _PITCH)
        present = {_PITCH: pitch} if is_number(pitch) else dict(numbers(pitch, _PITCH))
        if wider := _wider(present, data, judge):
            limit += f"; with {write_changes(wider, 'and')} it is accepted as it is"
    changes, met = follow(refusal, data, judge)
    if isinstance(refusal.nearest, str) and changes.get(field) not in (None, refusal.nearest):
        own = [one.limit for one in met if one.field == field]
        return Refusal(field, refusal.value, f"{limit}; then {own[-1]}", refusal.nearest)
    if set(changes) != {field}:
        pitches = {path: value for path, value in changes.items() if path.startswith(_PITCH) and is_number(value)}
        if not pitches and field.startswith(_PITCH) and is_number(refusal.nearest):
            pitches = {field: refusal.nearest}
        if field in pitches and (wider := _wider(pitches, data, judge)):
            if changes:
                rest = {path: value for path, value in changes.items() if path not in pitches}
                limit += f"; {write_changes(pitches, 'and')} would also need {write_changes(rest, 'and')}"
            changes = wider
    if not changes:
        return _otherwise(Refusal(field, refusal.value, limit), met, data, judge, sound)
    nearest = changes.pop(field, None)
    if field.startswith(_OF_BED) and not changes and _places(data) <= _FEW:
        nearest = _nearer(refusal, nearest, data, judge)
    if changes:
        limit += f"; the value offered here also needs {write_changes(changes, 'and')}"
    return Refusal(field, refusal.value, limit, nearest)


def _otherwise(
    refusal: Refusal, met: Sequence[Refusal], data: Mapping[str, Any], judge: Judge, sound: Mapping[str, Any]
) -> Refusal:
    """Return a refusal whose offers lead nowhere with another value, or with the key that is to blame."""
    field, value, limit = refusal.field, refusal.value, refusal.limit
    own = [one for one in met if one.field == field]
    bad = next((one for one in (own[-1].nearest, value) if is_number(one)), None)
    good = None if bad is None else next(good_numbers(data, field, judge, sound), None)
    if bad is not None and good is not None:
        if met[-1] is not own[-1]:
            limit += f"; at {format_value(bad)}, {bare(met[met.index(own[-1]) + 1])}"
        return Refusal(field, value, limit, nearest_number(data, field, good, bad, judge))
    if culprit := culprit_of(data, judge, sound):
        limit += f"; {write_changes(culprit, 'and')} would do"
    return Refusal(field, value, limit)


def _patient(judge: Judge) -> Judge:
    """Return a judge that refuses everything once it has been asked for MOST_TRIED places."""
    left = MOST_TRIED

    def judged(data: dict[str, Any]) -> object:
        nonlocal left
        left -= min(max(_places(data), 1), _LARGE)
        if left < 0:
            raise Refusal("", None, "not tried")
        return judge(data)

    return judged


def _nearer(refusal: Refusal, nearest: Any, data: Mapping[str, Any], judge: Judge) -> object:
    """Return a bed that is accepted and smaller than the one that was found, if tries between find one."""
    low, high, same = float(str(refusal.value)), float(nearest), 0
    while (middle := math.floor((low + high) * 5) / 10) > low:
        met = find_refusal(data, {refusal.field: middle}, judge)
        if met is None:
            high = middle
            continue
        low, asked = middle, met.nearest if met.field == refusal.field else None
        same += asked == high
        if same > 1:
            break  # its tools ask for no less
        if isinstance(asked, float) and asked < high and find_refusal(data, {refusal.field: asked}, judge) is None:
            high, same = asked, 0
    return high


def _places(data: Mapping[str, Any]) -> int:
    """Return how many places a layout has by its counts, which nobody checked."""
    layout = at(data, "layout")
    rings, points = at(layout, "rings"), at(layout, "points_mm")
    if isinstance(rings, int):
        return 3 * rings * (rings + 1) + 1
    if isinstance(points, list | tuple):
        return len(points)
    counts = (at(layout, key) for key in ("columns", "rows", "count", "bands"))
    return math.prod(count for count in counts if isinstance(count, int))


def _wider(pitches: Mapping[str, Any], data: Mapping[str, Any], judge: Judge) -> dict[str, object]:
    """Return pitches raised together, by as few tenths of a mm as can be, that need no other change; {}: none found."""

    if not pitches or _places(data) > _MANY:
        return {}

    def raised(tenths: int) -> dict[str, object]:
        return {path: (math.ceil(pitch * 10 - 1e-6) + tenths) / 10 for path, pitch in pitches.items()}

    for whole in range(10, 10 * _WIDEST + 1, 10):
        met = find_refusal(data, raised(whole), judge)
        if met is None:
            nearer = (raised(tenths) for tenths in range(whole - 9, whole))
            return next((each for each in nearer if find_refusal(data, each, judge) is None), raised(whole))
    return {}


def with_other_ways(refusal: Refusal, data: Mapping[str, Any], judge: Judge) -> Refusal:
    """Return the refusal of a bed or a circuit, its limit naming pitch, strap slot or fewer units that fit."""
    bed, circuit = (refusal.field.startswith(table) for table in (_OF_BED, _OF_CIRCUIT))
    found: dict[str, object] = {}
    if (bed or circuit) and _places(data) <= _MANY:
        found = next((each for each in _pitches(refusal, data) if find_refusal(data, each, judge) is None), {})
        found |= _shorter_slot(data, judge) if bed else {}
    word = "or"
    if bed and not found:
        found, word = _fewer(refusal, data, judge), "and"
    if not found:
        return refusal
    limit = f"{refusal.limit}; {'on this bed' if bed else 'with this circuit'} {write_changes(found, word)} would do"
    return Refusal(refusal.field, refusal.value, limit, refusal.nearest)


def _pitches(refusal: Refusal, data: Mapping[str, Any]) -> Iterator[dict[str, object]]:
    """Yield other pitches in whole mm, the nearest first: of a grid's two, the one along the bed that is too short."""
    path = _PITCH
    pitch = at(data, path)
    if isinstance(pitch, list | tuple):
        axis = int(refusal.field == "moulds.bed_y_mm")
        path, pitch = f"{path}.{axis}", pitch[axis]
    if isinstance(pitch, int | float):
        for by in range(1, _PITCHES + 1):
            yield {path: float(round(pitch) - by)}
            yield {path: float(round(pitch) + by)}


def _shorter_slot(data: Mapping[str, Any], judge: Judge) -> dict[str, object]:
    """Return the longest strap slot, in whole mm, that leaves room for cuts; {} if slots are not the cause."""
    path = "sheet.strap_slot_mm"
    slot = at(data, path)
    if not isinstance(slot, list | tuple) or find_refusal(data, {path: None}, judge) is not None:
        return {}
    length = _largest(int(slot[1]), lambda mm: find_refusal(data, {f"{path}.1": float(mm)}, judge) is None)
    return {f"{path}.1": float(length)} if length else {path: None}


def _fewer(refusal: Refusal, data: Mapping[str, Any], judge: Judge) -> dict[str, object]:
    """Return fewer columns, rows, rings or units of a band that fit the bed, first along the refused axis; {}: none."""
    keys = _COUNTS.get(str(at(data, "layout.kind")), {})
    changes: dict[str, object] = {}
    for bed in sorted(keys, key=lambda bed: bed != refusal.field):
        path = f"layout.{keys[bed]}"
        count = at(data, path)
        if isinstance(count, int) and _refused_for(bed, data, changes, judge):
            fewer = _largest(
                count, lambda n, bed=bed, more=changes, path=path: not _refused_for(bed, data, {**more, path: n}, judge)
            )
            changes = {**changes, path: fewer}
    return changes if changes and all(changes.values()) and find_refusal(data, changes, judge) is None else {}


def _refused_for(bed: str, data: Mapping[str, Any], changes: Mapping[str, object], judge: Judge) -> bool:
    met = find_refusal(data, changes, judge)
    return met is not None and met.field == bed


def _largest(most: int, fits: Callable[[int], bool]) -> int:
    """Return the largest whole number below `most` that fits, if all below one that fits do; 0 for none."""
    low, high = 0, most
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (middle, high) if fits(middle) else (low, middle)
    return low
