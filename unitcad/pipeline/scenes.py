"""What is shown of a variant: which parts stand together, where they go when taken apart, where they are cut."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from unitcad.designs import design_named
from unitcad.export.picture import Drawn, Scene
from unitcad.kernels.mesh import arrays, bounds, realise

if TYPE_CHECKING:
    from manifold3d import Manifold

    from unitcad.pipeline.variant import Variant

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


def moments(variant: Variant) -> tuple[Moment, ...]:
    """Casting from the bare base to the unit, in the person's order."""
    plan, found = variant.plan, []
    base = tuple(t.name for t in plan.tools if t.name == "base" or t.name.startswith("stub"))
    found.append(Moment("Base, filament flush with the core" if len(base) > 1 else "Base", base))
    for step in plan.steps:
        cured = tuple(f"layer{i}" for i in range(1, step.index))
        cup = f"cup{step.index}"
        tongues = tuple(name for name in step.tools if name.startswith("tongue"))
        found.append(Moment(f"Pour {step.index}: cup {step.index} on", (*base, *cured, cup)))
        if tongues:
            found.append(Moment(f"Pour {step.index}: tongue in, to the ledge", (*base, *cured, cup, *tongues)))
        full = (*base, *cured, step.name)
        found.append(Moment(f"Pour {step.index}: layer {step.index} poured, struck off", (*full, cup, *tongues)))
        if tongues:
            found.append(Moment(f"Pour {step.index}: cured, tongue out first", (*full, cup)))
        found.append(Moment(f"Pour {step.index}: cup up, layer {step.index} stays", full))
    unit = tuple(body.name for body in variant.unit)
    found.append(Moment("The unit: peeled off, motor and circuit in", unit))
    return tuple(found)


def taken_apart(variant: Variant) -> dict[str, Offset]:
    """How far each tool and each cast layer moves (mm) when the set is shown exploded: up the axis in casting order,
    a tongue out of its window, a filament stub down.
    """
    plan = variant.plan
    offsets: dict[str, Offset] = {"base": (0.0, 0.0, 0.0)}
    top = _top(variant, "base")
    cup_levels = []
    for step in plan.steps:
        for name in (f"cup{step.index}", step.name):
            low, high = _extent(variant, name)
            lift = top + GAP - low
            offsets[name] = (0.0, 0.0, lift)
            top = high + lift
            if name.startswith("cup"):
                cup_levels.append(lift)
    for tool in plan.tools:
        if tool.name.startswith("tongue"):
            x0, _, _, x1, _, _ = bounds(variant.mesh(tool))
            side = 1.0 if x0 + x1 > 0 else -1.0
            offsets[tool.name] = (side * ASIDE, 0.0, cup_levels[0])
        elif tool.name.startswith("stub"):
            low, high = _extent(variant, tool.name)
            offsets[tool.name] = (0.0, 0.0, _extent(variant, "base")[0] - GAP - high)
        elif tool.name not in offsets:
            offsets[tool.name] = (0.0, 0.0, top + GAP - _extent(variant, tool.name)[0])
            top += GAP + _extent(variant, tool.name)[1] - _extent(variant, tool.name)[0]
    return offsets


def unit_apart(variant: Variant) -> dict[str, Offset]:
    """The same for the unit's bodies: what goes in first stays below."""
    solids = {body.name: variant.mesh(body) for body in variant.unit}
    layers = sorted((n for n in solids if n.startswith("layer")), key=lambda n: int(n[5:]))
    rest = [name for name in ("motor", "fpcb") if name in solids]
    others = [name for name in solids if name not in layers and name not in rest]
    inside_out = [*rest, *others, *layers]
    order = [*reversed(layers), *rest, *others] if design_named(variant.spec.design).opens == "above" else inside_out
    offsets: dict[str, Offset] = {}
    top = 0.0
    for name in order:
        _, _, low, _, _, high = bounds(solids[name])
        offsets[name] = (0.0, 0.0, max(0.0, top - low))
        top = high + offsets[name][2] + GAP / 2
    return offsets


def _solids(variant: Variant, name: str) -> list[Manifold]:
    """The solids of a tool, or of a cast layer in the frame of the tools (one a cell)."""
    for step in variant.plan.steps:
        if step.name == name:
            return [realise(shape, variant.segments) for shape in step.layer]
    return [variant.mesh(variant.plan.tool(name))]


def _extent(variant: Variant, name: str) -> tuple[float, float]:
    boxes = [bounds(solid) for solid in _solids(variant, name)]
    return min(b[2] for b in boxes), max(b[5] for b in boxes)


def _top(variant: Variant, name: str) -> float:
    return _extent(variant, name)[1]


def pictures(variant: Variant, only: Sequence[str] = ("unit", "moulds")) -> dict[str, Scene]:
    """The pictures of a variant by the path of their file: the unit cut open, the set taken apart, each pour in
    section.
    """
    found: dict[str, Scene] = {}
    if "unit" in only:
        found["unit.png"] = unit_cut_open(variant)
    if "moulds" in only:
        found["moulds/exploded.png"] = exploded(variant)
        for step in variant.plan.steps:
            found[f"moulds/step{step.index}.png"] = step_in_section(variant, step.index)
    return found


def unit_cut_open(variant: Variant) -> Scene:
    """The unit, its nearer half taken away, seen from a little below: the skin's side is the open one."""
    parts = [_drawn(_far_half(variant.mesh(body)), body.colour) for body in variant.unit]
    return Scene(tuple(p for p in parts if p), (0.45, -1.0, -0.38), (1200, 640))


def step_in_section(variant: Variant, index: int) -> Scene:
    """Pour `index` as it stands when struck off, cut through the first row of cells."""
    step = variant.plan.steps[index - 1]
    colours = _colours(variant)
    y = min(cell.y for cell in variant.plan.layout.cells)
    names = (*(n for n in step.tools), *(f"layer{i}" for i in range(1, index + 1)))
    parts = [_drawn(_far_half(solid, y), colours[name]) for name in names for solid in _solids(variant, name)]
    return Scene(tuple(p for p in parts if p), (0.18, -1.0, 0.48), (1200, 640))


def exploded(variant: Variant) -> Scene:
    """The whole set taken apart, with names."""
    colours, offsets = _colours(variant), taken_apart(variant)
    numbered = [name for name in offsets if name.startswith(("tongue", "stub")) and name[-1].isdigit()]
    told = {name for name in numbered if name.rstrip("0123456789") + "1" != name}
    parts = []
    for name, offset in offsets.items():
        for i, solid in enumerate(_solids(variant, name)):
            label = "" if i or name in told else name.rstrip("1") if name in numbered else spoken(name)
            parts.append(_drawn(solid.translate(offset), colours[name], label))
    return Scene(tuple(p for p in parts if p), (0.55, -1.0, 0.5), (1000, 1300))


def spoken(name: str) -> str:
    """layer1 as "layer 1"."""
    stem = name.rstrip("0123456789")
    return f"{stem} {name[len(stem) :]}".strip()


def _colours(variant: Variant) -> Mapping[str, tuple[float, float, float]]:
    return {body.name: body.colour for body in (*variant.unit, *variant.plan.tools)}


def _far_half(solid: Manifold, y: float = 0.0) -> Manifold:
    """What lies beyond the plane y. A hair off it: a section exactly in a parting plane shows false triangles."""
    return solid.trim_by_plane((0, 1, 0), y + 1 / 512)


def _drawn(solid: Manifold, colour: tuple[float, float, float], label: str = "") -> Drawn | None:
    if solid.is_empty():
        return None
    vertices, faces = arrays(solid)
    return Drawn(colour, np.asarray(vertices), np.asarray(faces), label)
