"""What makes a refused text accepted: a value for the field that was changed, or leaving a key out."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeGuard

import tomlkit
from msgspec.structs import replace
from tomlkit.exceptions import TOMLKitError

from unitcad.errors import Refusal, UnitcadError
from unitcad.serve.messages import Edit, Fault
from unitcad.validation import put
from unitcad.validation.dotted import ABSENT, at, drop

_HALVINGS = 24


Judge = Callable[[dict[str, Any]], Mapping[str, Any]]
"""Validates plain data and returns it settled; raises UnitcadError for a fault."""


def remedied(faults: Sequence[Fault], data: Mapping[str, Any], since: Sequence[Edit], judge: Judge) -> list[Fault]:
    """Return the faults of plain data, each with its remedies: what `judge` accepts.

    `since` takes back what was changed since the data was accepted, newest first. Where one of these changes alone is
    to blame for a fault of another field, the fault stands `at` the changed one.
    """
    changed = {edit.path for edit in since}
    blamed = None
    if any(fault.field not in changed for fault in faults):
        blamed = next((edit for edit in since if _accepted(_after(data, edit), judge)), None)
    own = {edit.path: edit for edit in since}
    told = [_remedied(one, data, None if one.field in own else blamed, own.get(one.field), judge) for one in faults]
    return _left_out(told, data, judge)


def _remedied(fault: Fault, data: Mapping[str, Any], blamed: Edit | None, own: Edit | None, judge: Judge) -> Fault:
    """Return a fault with its remedy; `own` takes back the change of its field, `blamed` that of another one."""
    if fault.rename is not None:
        if _accepted(_renamed(data, fault.field, fault.rename[0]), judge):
            return fault
        fault = replace(fault, rename=None)
    if blamed is not None:
        back = blamed.value if isinstance(blamed.value, str) and not blamed.toml else _nearest(data, blamed, judge)
        return replace(fault, at=blamed.path, at_nearest=back)
    enough = fault.nearest is not None and _accepted(_after(data, Edit(path=fault.field, value=fault.nearest)), judge)
    if own and not enough and (nearest := _nearest(data, own, judge)) is not None:
        # Something else refuses what this field's own fault would accept.
        return replace(fault, nearest=nearest)
    if fault.nearest is None and at(data, fault.field) is not ABSENT:
        without = copy.deepcopy(dict(data))
        if drop(without, fault.field) and _accepted(without, judge):
            return replace(fault, leave_out=True)
    return fault


def _renamed(data: Mapping[str, Any], path: str, right: str) -> dict[str, Any]:
    """Return plain data whose key at a path has the name at another path."""
    changed = copy.deepcopy(dict(data))
    value = at(changed, path)
    if at(changed, right) is ABSENT and drop(changed, path):
        put(changed, right, value)
    return changed


def _left_out(faults: Sequence[Fault], data: Mapping[str, Any], judge: Judge) -> list[Fault]:
    """Return the faults, told to leave their keys out where the text is accepted once all of them are gone."""
    fields = [fault.field for fault in faults]
    without = copy.deepcopy(dict(data))
    if len(fields) < 2 or not all([drop(without, field) for field in fields]) or not _accepted(without, judge):
        return list(faults)
    return [replace(one, leave_out=True, together=[field for field in fields if field != one.field]) for one in faults]


def _nearest(data: Mapping[str, Any], edit: Edit, judge: Judge) -> float | None:
    """Return the accepted number nearest to the refused one, on the way from the one that was accepted before."""
    refused, accepted = at(data, edit.path), edit.value
    if edit.remove:
        try:
            accepted = at(judge(_after(data, edit)), edit.path)
        except UnitcadError:
            return None
    if not _is_float(refused) or not _is_float(accepted):
        return None

    def taken(value: float) -> bool:
        return _accepted(_after(data, Edit(path=edit.path, value=value)), judge)

    if not taken(accepted):
        return None
    least, most = sorted((accepted, refused))
    low, high = float(accepted), float(refused)
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        low, high = (middle, high) if taken(middle) else (low, middle)
    rounded = (round(low + shift, digits) for digits in (2, 3, 4) for shift in (0.0, -(10.0**-digits), 10.0**-digits))
    return next((value for value in rounded if least <= value <= most and taken(value)), low)


def _is_float(value: object) -> TypeGuard[float]:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _after(data: Mapping[str, Any], edit: Edit) -> dict[str, Any]:
    """Return plain data after an edit; unchanged where its path leads nowhere."""
    changed = copy.deepcopy(dict(data))
    try:
        if edit.remove:
            drop(changed, edit.path)
        else:
            put(changed, edit.path, tomlkit.value(str(edit.value)).unwrap() if edit.toml else edit.value)
    except (Refusal, TOMLKitError, ValueError, RecursionError):
        pass
    return changed


def _accepted(data: dict[str, Any], judge: Judge) -> bool:
    try:
        judge(data)
    except UnitcadError:
        return False
    return True
