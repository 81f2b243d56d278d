"""Mould checks: one file a code. Every file here that defines CHECK is one; all read only a mould set."""

from __future__ import annotations

import inspect
import pkgutil
from functools import cache
from importlib import import_module

from unitcad.checks import overlap
from unitcad.checks.finding import MouldCheck, MouldFinding
from unitcad.checks.strain import Strain, strain_findings, strains
from unitcad.errors import unknown_name
from unitcad.moulds.mould_set import MouldSet

__all__ = [
    "MouldCheck",
    "MouldFinding",
    "Strain",
    "check_geometry",
    "check_moulds",
    "check_unit",
    "mould_checks",
    "strain_findings",
    "strains",
]


@cache
def mould_checks() -> dict[str, MouldCheck]:
    """Return the mould checks by their code, in the order of codes."""
    modules = (import_module(f"{__name__}.{module.name}") for module in pkgutil.iter_modules(__path__))
    checks = [module.CHECK for module in modules if hasattr(module, "CHECK")]
    return {check.code: check for check in sorted(checks, key=lambda check: check.code)}


def explain(code: str) -> str:
    """Explain a mould check: its title, its demand and its method. Raises Refusal for an unknown code."""
    if code not in mould_checks():
        raise unknown_name("--explain", code, mould_checks())
    check = mould_checks()[code]
    title, _, demand = check.demands.partition(": ")
    _, _, method = inspect.cleandoc(inspect.getmodule(check.findings).__doc__ or "").partition("\n\n")
    return f"{code} {title}\n\n{demand[:1].upper()}{demand[1:].removesuffix('.')}.\n\n{method}".rstrip()


def check_moulds(moulds: MouldSet) -> list[MouldFinding]:
    """Return the findings of all mould checks on a unit and its moulds, in the order of codes."""
    return [finding for check in mould_checks().values() for finding in check.findings(moulds)]


def check_unit(moulds: MouldSet) -> list[MouldFinding]:
    """Return the findings on the unit without moulds: its overlaps."""
    return overlap.of_unit(moulds)


def check_geometry(moulds: MouldSet) -> list[MouldFinding]:
    """Return the findings of the checks that read no silicone; variants of one geometry share them."""
    checks = (check for check in mould_checks().values() if not check.reads_silicone)
    return [finding for check in checks for finding in check.findings(moulds)]
