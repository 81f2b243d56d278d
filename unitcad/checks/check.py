"""The record of a mould check."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from unitcad.checks.finding import MouldFinding
from unitcad.moulds.mould_set import MouldSet


@dataclass(frozen=True)
class MouldCheck:
    """A code, its demand in one line, and its function. `reads_silicone`: its limit is a material's."""

    code: str
    demands: str
    findings: Callable[[MouldSet], Iterable[MouldFinding]]
    reads_silicone: bool = False
