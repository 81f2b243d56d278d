"""Changes that make a refused text acceptable: a value for the changed field, or a key removed."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from msgspec.structs import replace

from unitcad.documents import parse_value
from unitcad.errors import NEAREST, Refusal, UnitcadError, UnknownKey, format_value
from unitcad.serve.messages import Edit, Fault
from unitcad.text import join_words
from unitcad.validation.plain_data import ABSENT, at, drop
from unitcad.validation.suggestions import (
    MOST,
    Changes,
    find_refusal,
    follow,
    is_number,
    nearest_number,
    with_changes,
    write_changes,
)

Judge = Callable[[dict[str, Any]], Mapping[str, Any]]
"""Validates plain data and returns it settled; raises UnitcadError for a fault."""


def add_remedies(
    faults: Sequence[Fault], data: Mapping[str, Any], since: Sequence[Edit], judge: Judge, whole: Judge
) -> list[Fault]:
    """Return the faults of plain data, each with its remedies: changes that `judge` accepts, if possible `whole` too.

    `since` reverts the changes since the data was accepted, newest first. If one of these changes caused a fault of
    another field, the fault is `at` the changed one. `whole` also refuses units without possible tools.
    """
    own = {edit.path: edit for edit in since}
    blamed = None
    if any(fault.field not in own for fault in faults):
        blamed = next((edit for edit in since if not find_refusal(data, _changes(edit), judge)), None)
    alone = len(faults) == 1
    told = [
        _with_remedy(one, data, None if one.field in own else blamed, own.get(one.field), alone, judge, whole)
        for one in faults
    ]
    fields, without = [fault.field for fault in faults], copy.deepcopy(dict(data))
    if len(fields) < 2 or not all([drop(without, field) for field in fields]) or find_refusal(without, {}, judge):
        return told
    return [replace(one, leave_out=True, together=[field for field in fields if field != one.field]) for one in told]


def changes_of_pick(
    picked: str, data: Mapping[str, Any], judge: Judge, whole: Judge, sound: Mapping[str, Any]
) -> Changes:
    """Return the other changes that a picked design needs; {} if none are found.

    A value takes its nearest accepted one, a key that the design lacks goes, and a missing key comes from `sound`, a
    file of that design. `whole` also refuses units without possible tools.
    """
    changes: dict[str, Any] = {}
    for _ in range(MOST):
        refusal = find_refusal(data, changes, judge) or find_refusal(data, changes, whole)
        if refusal is None:
            return changes
        field, value = refusal.field, None if isinstance(refusal, UnknownKey) else refusal.nearest
        if field == picked:
            field, value = next((key for key in data if _is_in_the_way(key, picked, data, changes, judge)), ""), None
        elif at(with_changes(data, changes), field) is ABSENT and (known := at(sound, field)) is not ABSENT:
            value = known
        if not field or isinstance(value, dict) or (field in changes and changes[field] == value):
            return {}
        changes = {path: each for path, each in changes.items() if not path.startswith(f"{field}.")} | {field: value}
    return {}


def _is_in_the_way(key: str, picked: str, data: Mapping[str, Any], changes: Changes, judge: Judge) -> bool:
    """Tell whether a picked design is refused for a table that it lacks."""
    if not isinstance(data[key], dict) or key in changes:
        return False
    after = find_refusal(data, {**changes, key: None}, judge)
    return after is None or after.field.partition(".")[0] not in (picked, key)


def in_words(changes: Changes) -> str:
    """Write the changes that a design needed."""
    gone = [path for path, value in changes.items() if value is None]
    put = [
        f"{path} ({len(value)} entries)"
        if isinstance(value, list) and len(value) > 4
        else write_changes({path: value}, "")
        for path, value in changes.items()
        if value is not None
    ]
    lists = (("Left out", gone), ("Set", put))
    return " ".join(f"{word}: {join_words(each)}." for word, each in lists if each)


def _with_remedy(
    fault: Fault,
    data: Mapping[str, Any],
    blamed: Edit | None,
    own: Edit | None,
    alone: bool,
    judge: Judge,
    whole: Judge,
) -> Fault:
    """Return a fault with its remedy; `own` takes back the change of its field, `blamed` that of another one."""
    if fault.rename is not None:
        renamed = {fault.field: None, fault.rename[0]: at(data, fault.field)}
        if at(data, fault.rename[0]) is ABSENT and not find_refusal(data, renamed, judge):
            return fault
        fault = replace(fault, rename=None)
    if fault.nearest is not None:
        fault = _with_offer(fault, _offer(fault, data, own, alone, judge, whole))
    elif own and (nearest := _nearest(data, own, judge, whole)) is not None:
        fault = _with_offer(fault, nearest)
    if fault.field == "diameter_mm" and own is None and isinstance(fault.nearest, float):
        fault = _with_offer(fault, _with_ring(data, blamed, fault.nearest, judge, whole))
    if blamed is not None:
        back = blamed.value if isinstance(blamed.value, str) and not blamed.toml else None
        back = _nearest(data, blamed, judge, whole) if back is None else back
        return replace(fault, at=blamed.path, at_nearest=back)
    if fault.nearest is None and not find_refusal(data, {fault.field: None}, judge):
        return replace(fault, leave_out=True)
    return fault


def _with_ring(data: Mapping[str, Any], blamed: Edit | None, least: float, judge: Judge, whole: Judge) -> float:
    """Return the diameter at which the ring of air round the motor is as wide as before a change; else the least."""
    if blamed is None:
        return least
    try:
        before, now = (_ring(data, changes, judge) for changes in (_changes(blamed), {"diameter_mm": least}))
    except (UnitcadError, KeyError, TypeError):
        return least
    kept = round(least + 2 * (before - now), 3)
    return kept if kept > least and not find_refusal(data, {"diameter_mm": kept}, whole) else least


def _ring(data: Mapping[str, Any], changes: Changes, judge: Judge) -> float:
    """Return the width of the ring of air after changes. Raises UnitcadError, KeyError or TypeError without one."""
    settled = judge(with_changes(data, changes))
    walls = sum(layer["wall_mm"] for layer in settled["layers"])
    return settled["diameter_mm"] / 2 - settled["motor"]["diameter_mm"] / 2 - walls


def _with_offer(fault: Fault, nearest: Any) -> Fault:
    """Return a fault that offers a value, in its sentence too."""
    if nearest == fault.nearest:
        return fault
    message, _, _ = fault.message.partition(NEAREST)
    return replace(
        fault, nearest=nearest, message=message if nearest is None else message + NEAREST + format_value(nearest)
    )


def _offer(fault: Fault, data: Mapping[str, Any], own: Edit | None, alone: bool, judge: Judge, whole: Judge) -> Any:
    """Return the value to offer for a fault, whose nearest value meets only its own limit; None for nothing."""
    accepted, _ = follow(Refusal(fault.field, None, "", fault.nearest), data, whole)
    if set(accepted) == {fault.field}:
        return accepted[fault.field]
    if own and (nearest := _nearest(data, own, judge, whole)) is not None:
        return nearest
    # If no change makes all of it acceptable, or the former data is unknown, it cures its own fault.
    cures = not alone or not own or not find_refusal(data, {fault.field: fault.nearest}, judge)
    return fault.nearest if cures else None


def _nearest(data: Mapping[str, Any], edit: Edit, judge: Judge, whole: Judge) -> float | None:
    """Return the accepted number nearest to the refused one, on the way from the one that was accepted before."""
    bad, good = at(data, edit.path), edit.value
    if edit.remove:
        try:
            good = at(judge(with_changes(data, {edit.path: None})), edit.path)
        except UnitcadError:
            return None
    if not is_number(bad) or not is_number(good):
        return None
    for strict in (whole, judge):
        if find_refusal(data, {edit.path: good}, strict) is None:
            return nearest_number(data, edit.path, good, bad, strict)
    return None


def _changes(edit: Edit) -> Changes:
    """Return an edit as a change of data; none for a text that is no TOML value."""
    if edit.remove or not edit.toml:
        return {edit.path: None if edit.remove else edit.value}
    try:
        return {edit.path: parse_value(str(edit.value))}
    except UnitcadError:
        return {}
