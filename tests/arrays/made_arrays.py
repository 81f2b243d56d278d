"""Moulds of arrays, made once for all tests that only look at them, and tools drawn otherwise."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from typing import Any

import pytest

from unitcad.arrays.array import Array
from unitcad.arrays.array_file import load_array
from unitcad.arrays.array_procedure import array_procedure
from unitcad.arrays.patch import PatchMoulds, patch_moulds
from unitcad.casting.procedure import Procedure, procedure
from unitcad.checks import check_moulds
from unitcad.checks.finding import MouldFinding
from unitcad.errors import Refusal
from unitcad.moulds.mould_set import MouldSet
from unitcad.shape import Shape, cut, union

Change = Callable[[Shape], Shape]


@cache
def made(name: str, *overrides: str) -> PatchMoulds:
    """The moulds of a template."""
    return patch_moulds(load_array(name, overrides))


@cache
def findings(name: str, *overrides: str) -> Sequence[MouldFinding]:
    """What all checks find on them."""
    return check_moulds(made(name, *overrides))


def refusal_of(source: Any, changes: Any = ()) -> Refusal:
    """The refusal of an array or of its moulds."""
    with pytest.raises(Refusal) as refused:
        patch_moulds(load_array(source, changes)).plan  # noqa: B018
    return refused.value


def with_tool(moulds: PatchMoulds, name: str, change: Change) -> PatchMoulds:
    """The moulds with one tool drawn otherwise."""
    plan = moulds.plan
    tools = tuple(replace(tool, shape=change(tool.shape)) if tool.name == name else tool for tool in plan.tools)
    return patch_moulds(moulds.arranged, replace(plan, tools=tools))


def less(*tools: Shape) -> Change:
    return lambda shape: cut(shape, tools)


def more(*parts: Shape) -> Change:
    return lambda shape: union((shape, *parts))


def notch(inner: float, outer: float, half: float = 1.7) -> float:
    """Area of a strip on one side between two circles."""

    def inside(r: float) -> float:
        return half * math.sqrt(r**2 - half**2) + r**2 * math.asin(half / r)

    return inside(outer) - inside(inner)


def pockets_cast(array: Array) -> tuple[Procedure, Procedure]:
    """The procedures of an array's only unit and of its sheet, all layers of 1 cm3."""
    spec = MouldSet(array.unit)
    unit = procedure(spec, [1000.0] * len(spec.plan.steps), 1000.0)
    return unit, array_procedure(patch_moulds(array), [1000.0], 1000.0, {"units/encapsulating": unit})
