"""Unit and moulds as an assembly: bodies in places that they can have at one time, so none shares volume with another."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

from unitcad.errors import WrongArgument
from unitcad.kernels.mesh import bounds
from unitcad.moulds.cup import rib_spaces
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.plan import Step
from unitcad.pipeline.scenes import GAP, Offset, exploded_moves, unit_apart
from unitcad.shape.tree import Body, Common, cut, moved, union

UNIT, MOULDS = "unit", "moulds"
_NONE: Offset = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Group:
    """A named part of an assembly: its bodies, each with its shape in place (mm)."""

    name: str
    bodies: tuple[Body, ...]


def assembly(moulds: MouldSet, step: int | None = None, exploded: bool = False) -> tuple[Group, Group]:
    """Return unit and moulds of a set, each with its bodies in place.

    By default the finished unit is at its place, and the moulds are next to it: those of the last pour as assembled,
    the other tools aside. `step`: tools, cured layers and inserts of a pour, the silicone in its cavity. `exploded`:
    both taken apart, side by side. Raises WrongArgument for a pour that there is not, and for both at once; Refusal if
    the moulds can't be made.
    """
    pours = moulds.plan.steps
    if step is None:
        tools = list(_apart(moulds) if exploded else _on_the_bench(moulds, pours[-1]))
        moves = unit_apart(moulds) if exploded else {}
        unit = [_moved(body, moves.get(body.name, _NONE)) for body in moulds.unit]
        aside = (0.0, _end(moulds, unit, 4) + GAP - _start(moulds, tools, 1), 0.0)
        return Group(UNIT, tuple(unit)), Group(MOULDS, tuple(_moved(tool, aside) for tool in tools))
    if exploded:
        raise WrongArgument("exploded", exploded, "shows no pour: leave out step, or exploded", False)
    if not isinstance(step, int) or not 1 <= step <= len(pours):
        nearest = min(max(step, 1), len(pours)) if isinstance(step, int) else 1
        raise WrongArgument("step", step, f"takes the number of a pour, 1 to {len(pours)}", nearest)
    pour = pours[step - 1]
    return Group(UNIT, tuple(_in_the_mould(moulds, pour))), Group(MOULDS, tuple(_standing(moulds, pour)))


def _standing(moulds: MouldSet, pour: Step) -> Iterator[Body]:
    """Yield the tools of a pour as assembled: ribs of its cup that reach into the base are crushed."""
    for name in pour.tools:
        tool = moulds.plan.tool(name)
        if name == pour.cup and not moulds.crushing.is_empty():
            crushed = [Common((moulds.plan.tool(moulds.plan.base_of(pour)).shape, union(rib_spaces(moulds.frame))))]
            tool = replace(tool, shape=cut(tool.shape, crushed))
        yield tool


def _in_the_mould(moulds: MouldSet, pour: Step) -> Iterator[Body]:
    """Yield the silicone of a pour, the cured layers and what is laid in, all cells of a body as one."""
    cells = len(pour.layer)
    like = {body.name: body for body in moulds.unit}
    layers = [pour.earlier[i : i + cells] for i in range(0, len(pour.earlier), cells)]
    for other, shapes in zip(moulds.plan.steps, (*layers[: pour.index - 1], pour.layer), strict=False):
        drawn = like.get(other.name, moulds.unit[0])
        yield replace(drawn, name=other.name, shape=union(shapes) if len(shapes) != 1 else shapes[0])
    yield from pour.inserts


def _on_the_bench(moulds: MouldSet, pour: Step) -> Iterator[Body]:
    """Yield a pour's tools as assembled, and the others next to them in a row."""
    there = [*_standing(moulds, pour)]
    yield from there
    end = _end(moulds, there, 4)
    for tool in moulds.plan.tools:
        if tool.name not in pour.tools:
            move = end + GAP - _start(moulds, [tool], 1)
            yield _moved(tool, (0.0, move, 0.0))
            end = move + _end(moulds, [tool], 4)


def _apart(moulds: MouldSet) -> Iterator[Body]:
    """Yield the tools taken apart."""
    offsets = exploded_moves(moulds)
    for tool in moulds.plan.tools:
        yield _moved(tool, offsets[tool.name])


def _moved(body: Body, offset: Offset) -> Body:
    return body if offset == _NONE else replace(body, shape=moved(body.shape, *offset))


def _start(moulds: MouldSet, bodies: Iterable[Body], side: int) -> float:
    return min(bounds(moulds.mesh(body))[side] for body in bodies)


def _end(moulds: MouldSet, bodies: Iterable[Body], side: int) -> float:
    return max(bounds(moulds.mesh(body))[side] for body in bodies)
