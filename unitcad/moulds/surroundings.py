"""Surroundings of each place of a mould set, pour by pour: which cells and tools are in like surroundings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from manifold3d import Manifold

from unitcad.kernels.mesh import realise
from unitcad.moulds.congruence import MARGIN, Congruence, column_round
from unitcad.moulds.plan import Plan, Step
from unitcad.shape import Shape


@dataclass(frozen=True, eq=False)
class Surroundings:
    """The solids of pours between which nothing is laid in elsewhere, and their places that are alike.

    `solids` are the tools by name, `more` is drawn besides tools, silicone and seals: spaces of ribs.
    """

    plan: Plan
    steps: tuple[Step, ...]
    solids: Mapping[str, Manifold]
    more: Sequence[Shape]
    segments: int

    @cached_property
    def congruence(self) -> Congruence:
        """All tools in the pours, cast and laid in solids, and seals."""
        last = self.steps[-1]
        tools = [tool for tool in self.plan.tools if any(tool.name in step.tools for step in self.steps)]
        shapes = [tool.shape for tool in tools] + [*last.earlier, *last.layer, *self.more]
        for step in self.steps:
            shapes += [*step.seals, *step.channels, *(body.shape for body in step.inserts)]
        return Congruence(shapes, [self.solids[tool.name] for tool in tools])

    @cached_property
    def cells(self) -> tuple[int, ...]:
        """For every cell a number that is the same for cells in like surroundings.

        A cell's place encloses the silicone cast only in it: nothing of a sheet that joins all cells.
        """
        last, count = self.steps[-1], len(self.plan.layout.cells)
        alone = (*last.earlier, *last.layer) if len(last.layer) == count else last.earlier
        if count == 1 or not alone or len(alone) % count:
            return tuple(range(count))
        numbers = []
        for i in range(count):
            cast = [*alone[i::count]]
            for step in self.steps:
                share = len(step.channels) // count if len(step.layer) == count else 0
                cast += step.channels[i * share : (i + 1) * share]
            column = column_round([realise(shape, self.segments) for shape in cast], MARGIN)
            numbers.append(self.congruence.number(column))
        return tuple(numbers)


def surroundings(
    plan: Plan, solids: Mapping[str, Manifold], more: Sequence[Shape], segments: int
) -> tuple[Surroundings, ...]:
    """Return the surroundings of every pour: one object for pours that leave earlier silicone in place."""
    groups: list[list[Step]] = []
    for step in plan.steps:
        before = groups[-1][-1] if groups else None
        if before and step.earlier == (*before.earlier, *before.layer):
            groups[-1].append(step)
        else:
            groups.append([step])
    made = [Surroundings(plan, tuple(group), solids, more, segments) for group in groups]
    return tuple(each for each in made for _ in each.steps)
