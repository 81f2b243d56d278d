"""A check of cavities, one after the other: the findings of one apply to every other in like surroundings."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import replace

from unitcad.checks.finding import MouldFinding
from unitcad.moulds.cavities import Cavity
from unitcad.moulds.mould_set import MouldSet


def each_cavity(moulds: MouldSet, judge: Callable[[Cavity], Iterable[MouldFinding]]) -> Iterator[MouldFinding]:
    """Yield the findings of `judge` in every cavity; the place that it names begins with the cavity's."""
    judged: dict[int, list[MouldFinding]] = {}
    for cavity in moulds.cavities:
        first = moulds.cavities[cavity.first]
        if cavity.first not in judged:
            judged[cavity.first] = list(judge(first))
        for finding in judged[cavity.first]:
            yield replace(finding, where=cavity.where + finding.where.removeprefix(first.where))
