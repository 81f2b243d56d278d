"""What is shown of a variant: which parts stand together, where they go when taken apart, where they are cut."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from unitcad.export.picture import Drawn, Scene
from unitcad.kernels.mesh import arrays, bounds, realise
from unitcad.text import spaced

if TYPE_CHECKING:
    from manifold3d import Manifold

    from unitcad.moulds.mould_set import MouldSet

GAP = 7.0
"""Between two pieces taken apart, mm."""
ASIDE = 12.0
"""How far a tongue is drawn out when taken apart, mm."""

Offset = tuple[float, float, float]


@dataclass(frozen=True)
class Moment:
    """One moment of casting: what a person sees on the bench. `parts` are names of tools and of cured layers."""

    title: str
    parts: tuple[str, ...]


def moments(moulds: MouldSet) -> tuple[Moment, ...]:
    """Return casting from the bare base to the unit, in the person's order."""
    plan, found = moulds.plan, []
    cast_in: tuple[str, ...] = ()
    base = tuple(tool.name for kind in ("base", "stub") for tool in plan.of_kind(kind))
    found.append(Moment("Base, filament flush with the core" if len(base) > 1 else "Base", base))
    for step in plan.steps:
        cured = tuple(f"layer{i}" for i in range(1, step.index))
        laid = tuple(body.name for body in step.inserts)
        if laid and not cast_in:
            found.append(Moment(f"Pour {step.index}: motor and circuit laid in", (*base, *cured, *laid)))
        cured, cast_in = (*cured, *laid), laid
        cup, tongues = step.cup, tuple(tool.name for tool in plan.standing(step, "tongue"))
        found.append(Moment(f"Pour {step.index}: cup {step.index} on", (*base, *cured, cup)))
        if tongues:
            found.append(Moment(f"Pour {step.index}: tongue in, to the ledge", (*base, *cured, cup, *tongues)))
        full = (*base, *cured, step.name)
        found.append(Moment(f"Pour {step.index}: layer {step.index} poured, struck off", (*full, cup, *tongues)))
        if tongues:
            found.append(Moment(f"Pour {step.index}: cured, tongue out first", (*full, cup)))
        found.append(Moment(f"Pour {step.index}: cup up, layer {step.index} stays", full))
    unit = tuple(body.name for body in moulds.unit)
    found.append(Moment("The unit: peeled off" + ("" if cast_in else ", motor and circuit in"), unit))
    return tuple(found)


def taken_apart(moulds: MouldSet) -> dict[str, Offset]:
    """How far each tool and each cast layer moves (mm) when the set is shown exploded: up the axis in casting order,
    a tongue out of its window, a filament stub down.
    """
    plan = moulds.plan
    offsets: dict[str, Offset] = {"base": (0.0, 0.0, 0.0)}
    top = _top(moulds, "base")
    cup_levels = []
    for step in plan.steps:
        laid = [body.name for body in step.inserts if body.name not in offsets]
        if laid:
            lift = top + GAP - min(_extent(moulds, name)[0] for name in laid)
            offsets |= {name: (0.0, 0.0, lift) for name in laid}
            top = lift + max(_extent(moulds, name)[1] for name in laid)
        for name in (step.cup, step.name):
            low, high = _extent(moulds, name)
            lift = top + GAP - low
            offsets[name] = (0.0, 0.0, lift)
            top = high + lift
            if name == step.cup:
                cup_levels.append(lift)
    for tool in plan.tools:
        if tool.kind == "tongue" and tool.removal:
            offsets[tool.name] = (tool.removal[0] * ASIDE, 0.0, cup_levels[0])
        elif tool.kind == "stub":
            _, high = _extent(moulds, tool.name)
            offsets[tool.name] = (0.0, 0.0, _extent(moulds, "base")[0] - GAP - high)
        elif tool.name not in offsets:
            offsets[tool.name] = (0.0, 0.0, top + GAP - _extent(moulds, tool.name)[0])
            top += GAP + _extent(moulds, tool.name)[1] - _extent(moulds, tool.name)[0]
    return offsets


def unit_apart(moulds: MouldSet) -> dict[str, Offset]:
    """The same for the unit's bodies: what goes in first stays below."""
    solids = {body.name: moulds.mesh(body) for body in moulds.unit}
    layers = [body.name for body in sorted(moulds.unit, key=lambda body: body.step or 0) if body.kind == "layer"]
    rest = [body.name for kind in ("motor", "circuit") for body in moulds.unit if body.kind == kind]
    others = [name for name in solids if name not in layers and name not in rest]
    inside_out = [*rest, *others, *layers]
    order = [*reversed(layers), *rest, *others] if moulds.design.opens == "above" else inside_out
    if moulds.design.laid_in:
        below = moulds.design.laid_in - 1
        order = [*layers[:below], *rest, *others, *layers[below:]]
    offsets: dict[str, Offset] = {}
    top = 0.0
    for name in order:
        _, _, low, _, _, high = bounds(solids[name])
        offsets[name] = (0.0, 0.0, max(0.0, top - low))
        top = high + offsets[name][2] + GAP / 2
    return offsets


def _solids(moulds: MouldSet, name: str) -> list[Manifold]:
    """The solids of a tool, of what is laid in, or of a cast layer in the frame of the tools (one a cell)."""
    for step in moulds.plan.steps:
        if step.name == name:
            return [realise(shape, moulds.segments) for shape in step.layer]
    return [moulds.mesh(body) for body in (*moulds.plan.steps[-1].inserts, *moulds.plan.tools) if body.name == name]


def _extent(moulds: MouldSet, name: str) -> tuple[float, float]:
    boxes = [bounds(solid) for solid in _solids(moulds, name)]
    return min(b[2] for b in boxes), max(b[5] for b in boxes)


def _top(moulds: MouldSet, name: str) -> float:
    return _extent(moulds, name)[1]


def pictures(moulds: MouldSet, only: Sequence[str] = ("unit", "moulds")) -> dict[str, Callable[[], Scene]]:
    """Return what draws each picture of a variant, by the path of its file.

    The unit cut open, the set taken apart, each pour in section.
    """
    drawn: dict[str, Callable[[], Scene]] = {}
    if "unit" in only:
        drawn["unit.png"] = partial(unit_cut_open, moulds)
    if "moulds" in only:
        drawn["moulds/exploded.png"] = partial(exploded, moulds)
        for step in moulds.plan.steps:
            drawn[f"moulds/step{step.index}.png"] = partial(step_in_section, moulds, step.index)
    return drawn


def unit_cut_open(moulds: MouldSet) -> Scene:
    """The unit, its nearer half taken away, seen from a little below: the skin's side is the open one."""
    parts = [_drawn(_far_half(moulds.mesh(body)), body.colour) for body in moulds.unit]
    return Scene(tuple(p for p in parts if p), (0.45, -1.0, -0.38), (1200, 640))


def step_in_section(moulds: MouldSet, index: int) -> Scene:
    """Pour `index` as it stands when struck off, cut through the first row of cells."""
    step = moulds.plan.steps[index - 1]
    colours = _colours(moulds)
    y = min(cell.y for cell in moulds.plan.layout.cells)
    names = (*step.tools, *(f"layer{i}" for i in range(1, index + 1)), *(body.name for body in step.inserts))
    parts = [_drawn(_far_half(solid, y), colours[name]) for name in names for solid in _solids(moulds, name)]
    return Scene(tuple(p for p in parts if p), (0.18, -1.0, 0.48), (1200, 640))


def exploded(moulds: MouldSet) -> Scene:
    """The whole set taken apart, with names."""
    colours, offsets = _colours(moulds), taken_apart(moulds)
    groups = [[tool.name for tool in moulds.plan.of_kind(kind)] for kind in ("tongue", "stub")]
    numbered = [name for group in groups if len(group) > 1 for name in group]
    unnamed = {name for group in groups for name in group[1:]}
    parts = []
    for name, offset in offsets.items():
        for i, solid in enumerate(_solids(moulds, name)):
            label = "" if i or name in unnamed else name.rstrip("1") if name in numbered else spaced(name)
            parts.append(_drawn(solid.translate(offset), colours[name], label))
    return Scene(tuple(p for p in parts if p), (0.55, -1.0, 0.5), (1000, 1300))


def _colours(moulds: MouldSet) -> Mapping[str, tuple[float, float, float]]:
    return {body.name: body.colour for body in (*moulds.unit, *moulds.plan.tools)}


def _far_half(solid: Manifold, y: float = 0.0) -> Manifold:
    """What lies beyond the plane y. A hair off it: a section exactly in a parting plane shows false triangles."""
    return solid.trim_by_plane((0, 1, 0), y + 1 / 512)


def _drawn(solid: Manifold, colour: tuple[float, float, float], label: str = "") -> Drawn | None:
    if solid.is_empty():
        return None
    vertices, faces = arrays(solid)
    return Drawn(colour, np.asarray(vertices), np.asarray(faces), label)
