"""Changes that make a refused text acceptable: a value for the changed field, or a key removed."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import tomlkit
from msgspec.structs import replace
from tomlkit.exceptions import TOMLKitError

from unitcad.errors import NEAREST, Refusal, UnitcadError, format_value
from unitcad.serve.messages import Edit, Fault
from unitcad.validation import put
from unitcad.validation.plain_data import ABSENT, at, drop
from unitcad.validation.suggestions import find_refusal, follow, is_number, nearest_number

Judge = Callable[[dict[str, Any]], Mapping[str, Any]]
"""Validates plain data and returns it settled; raises UnitcadError for a fault."""


def add_remedies(
    faults: Sequence[Fault], data: Mapping[str, Any], since: Sequence[Edit], judge: Judge, whole: Judge
) -> list[Fault]:
    """Return the faults of plain data, each with its remedies: changes that `judge` accepts, if possible `whole` too.

    `since` reverts the changes since the data was accepted, newest first. If one of these changes caused a fault of
    another field, the fault is `at` the changed one. `whole` also refuses units without possible tools.
    """
    changed = {edit.path for edit in since}
    blamed = None
    if any(fault.field not in changed for fault in faults):
        blamed = next((edit for edit in since if _is_accepted(_after(data, edit), judge)), None)
    own = {edit.path: edit for edit in since}
    alone = len(faults) == 1
    told = [
        _with_remedy(one, data, None if one.field in own else blamed, own.get(one.field), alone, judge, whole)
        for one in faults
    ]
    return _mark_removable(told, data, judge)


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
        if _is_accepted(_rename(data, fault.field, fault.rename[0]), judge):
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
    if fault.nearest is None and at(data, fault.field) is not ABSENT:
        without = copy.deepcopy(dict(data))
        if drop(without, fault.field) and _is_accepted(without, judge):
            return replace(fault, leave_out=True)
    return fault


def _with_ring(data: Mapping[str, Any], blamed: Edit | None, least: float, judge: Judge, whole: Judge) -> float:
    """Return the diameter at which the ring of air round the motor is as wide as before a change; else the least."""
    if blamed is None:
        return least
    try:
        before = _ring(judge(_after(data, blamed)))
        kept = round(least + 2 * (before - _ring(judge(_after(data, Edit(path="diameter_mm", value=least))))), 3)
    except (UnitcadError, KeyError, TypeError):
        return least
    return kept if kept > least and _is_accepted(_after(data, Edit(path="diameter_mm", value=kept)), whole) else least


def _ring(settled: Mapping[str, Any]) -> float:
    """Return the width of the ring of air of a settled spec."""
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
    whole_too = _onwards(data, fault.field, fault.nearest, whole)
    if whole_too is not None:
        return whole_too
    if own and (nearest := _nearest(data, own, judge, whole)) is not None:
        return nearest
    # If no change makes all of it acceptable, or the former data is unknown, it cures its own fault.
    cures = not alone or not own or _is_accepted(_after(data, Edit(path=fault.field, value=fault.nearest)), judge)
    return fault.nearest if cures else None


def _onwards(data: Mapping[str, Any], path: str, value: Any, judge: Judge) -> Any:
    """Return a value that is accepted at a path: the given one, or the one that its refusals offer in its place."""
    changes, _ = follow(Refusal(path, None, "", value), data, judge)
    return changes[path] if set(changes) == {path} else None


def _rename(data: Mapping[str, Any], path: str, right: str) -> dict[str, Any]:
    """Return plain data whose key at a path has the name at another path."""
    changed = copy.deepcopy(dict(data))
    value = at(changed, path)
    if at(changed, right) is ABSENT and drop(changed, path):
        put(changed, right, value)
    return changed


def _mark_removable(faults: Sequence[Fault], data: Mapping[str, Any], judge: Judge) -> list[Fault]:
    """Return the faults, marked to remove their keys together if the text is accepted without all of them."""
    fields = [fault.field for fault in faults]
    without = copy.deepcopy(dict(data))
    if len(fields) < 2 or not all([drop(without, field) for field in fields]) or not _is_accepted(without, judge):
        return list(faults)
    return [replace(one, leave_out=True, together=[field for field in fields if field != one.field]) for one in faults]


def _nearest(data: Mapping[str, Any], edit: Edit, judge: Judge, whole: Judge) -> float | None:
    """Return the accepted number nearest to the refused one, on the way from the one that was accepted before."""
    bad, good = at(data, edit.path), edit.value
    if edit.remove:
        try:
            good = at(judge(_after(data, edit)), edit.path)
        except UnitcadError:
            return None
    if not is_number(bad) or not is_number(good):
        return None
    for strict in (whole, judge):
        if find_refusal(data, {edit.path: good}, strict) is None:
            return nearest_number(data, edit.path, good, bad, strict)
    return None


def _after(data: Mapping[str, Any], edit: Edit) -> dict[str, Any]:
    """Return plain data after an edit; unchanged if its path leads nowhere."""
    changed = copy.deepcopy(dict(data))
    try:
        if edit.remove:
            drop(changed, edit.path)
        else:
            put(changed, edit.path, tomlkit.value(str(edit.value)).unwrap() if edit.toml else edit.value)
    except (Refusal, TOMLKitError, ValueError, RecursionError):
        pass
    return changed


def _is_accepted(data: Mapping[str, Any], judge: Judge) -> bool:
    return find_refusal(data, {}, judge) is None
