"""Mould sets of templates, and ways to plant a fault in one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from unitcad.checks import check_moulds
from unitcad.moulds.mould_set import MouldSet
from unitcad.shape import Shape
from unitcad.spec import Spec
from unitcad.validation import load


def set_of(source: str, *overrides: str) -> MouldSet:
    """Return the mould set of a template or a spec file."""
    return of_spec(load(source, overrides))


def of_spec(spec: Spec) -> MouldSet:
    """Return the mould set of a spec, its plan made. Raises Refusal where the moulds can't be."""
    moulds = MouldSet(spec)
    _ = moulds.plan
    return moulds


def broken(moulds: MouldSet) -> set[str]:
    """Return the codes of the checks that a set breaks."""
    return {finding.code for finding in check_moulds(moulds) if not finding.ok}


def with_fault(moulds: MouldSet, name: str, change: Callable[[Shape], Shape]) -> MouldSet:
    """Return the set with one tool drawn otherwise."""
    plan = moulds.plan
    tools = tuple(replace(tool, shape=change(tool.shape)) if tool.name == name else tool for tool in plan.tools)
    return MouldSet(moulds.spec, replace(plan, tools=tools))


def without(moulds: MouldSet, name: str) -> MouldSet:
    """Return the set with a tool forgotten on the bench."""
    plan = moulds.plan
    steps = tuple(replace(step, tools=tuple(tool for tool in step.tools if tool != name)) for step in plan.steps)
    return MouldSet(moulds.spec, replace(plan, steps=steps))
