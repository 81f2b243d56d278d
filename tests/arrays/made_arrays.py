"""Moulds of arrays, made once for all tests that only look at them, and tools drawn otherwise."""

import math
from dataclasses import replace
from functools import cache

import pytest

from unitcad.arrays.array_file import load_array
from unitcad.arrays.array_procedure import array_procedure
from unitcad.arrays.patch import patch_moulds
from unitcad.casting.procedure import procedure
from unitcad.checks import check_moulds
from unitcad.errors import Refusal
from unitcad.moulds.mould_set import MouldSet
from unitcad.shape import cut, union


@cache
def made(name, *overrides):
    """The moulds of a template."""
    return patch_moulds(load_array(name, overrides))


@cache
def findings(name, *overrides):
    """What all checks find on them."""
    return check_moulds(made(name, *overrides))


def refusal_of(source, changes=()):
    """The refusal of an array or of its moulds."""
    with pytest.raises(Refusal) as refused:
        patch_moulds(load_array(source, changes)).plan  # noqa: B018
    return refused.value


def with_tool(moulds, name, change):
    """The moulds with one tool drawn otherwise."""
    plan = moulds.plan
    tools = tuple(replace(tool, shape=change(tool.shape)) if tool.name == name else tool for tool in plan.tools)
    return patch_moulds(moulds.array, replace(plan, tools=tools))


def less(*tools):
    return lambda shape: cut(shape, tools)


def more(*parts):
    return lambda shape: union((shape, *parts))


def notch(inner, outer, half=1.7):
    """Area of a strip on one side between two circles."""

    def inside(r):
        return half * math.sqrt(r**2 - half**2) + r**2 * math.asin(half / r)

    return inside(outer) - inside(inner)


def pockets_cast(array):
    """The procedures of an array's only unit and of its sheet, all layers of 1 cm3."""
    spec = MouldSet(array.unit)
    unit = procedure(spec, [1000.0] * len(spec.plan.steps), 1000.0)
    return unit, array_procedure(patch_moulds(array), [1000.0], 1000.0, {"units/encapsulating": unit})
