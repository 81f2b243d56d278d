"""The scenes of a variant: the parts of each, their places when taken apart, and the cutting planes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

from manifold3d import Manifold

from unitcad.export.raster import Colour, Surface, draw
from unitcad.kernels.mesh import arrays, bounds
from unitcad.moulds.mould_set import MouldSet
from unitcad.shape.tree import Body
from unitcad.text import spaced

GAP = 7.0
"""Between two pieces taken apart, mm."""
ASIDE = 12.0
"""How far a tongue is drawn out when taken apart, mm."""

Offset = tuple[float, float, float]


@dataclass(frozen=True)
class Moment:
    """One moment of casting, as on the bench; `parts` are names of tools and of cured layers."""

    title: str
    parts: tuple[str, ...]


def moments(moulds: MouldSet) -> Iterator[Moment]:
    """Yield casting from the bare base to the unit, in the order of the procedure."""
    plan = moulds.plan
    base = tuple(tool.name for kind in ("base", "filament") for tool in plan.of_kind(kind))
    yield Moment("Base, filament flush with the core" if len(base) > 1 else "Base", base)
    inserts: tuple[str, ...] = ()
    for step in plan.steps:
        pour, cup = f"Pour {step.index}", step.cup
        if plan.bench:
            closed = tuple(tool.name for kind in ("cup", "frame") for tool in plan.standing(step, kind))
            if closed:
                yield Moment(f"{pour}: the mould closed", (*base, *closed))
            yield Moment(f"{pour}: filled", (*base, *closed, step.name))
            if closed:
                yield Moment(f"{pour}: cured, opened", (*base, step.name))
            continue
        before, inserts = inserts, tuple(body.name for body in step.inserts)
        cured = (*base, *(f"layer{i}" for i in range(1, step.index)), *inserts)
        tongues = tuple(tool.name for tool in plan.standing(step, "tongue"))
        if inserts and not before:
            yield Moment(f"{pour}: motor and circuit laid in", cured)
        yield Moment(f"{pour}: cup {step.index} on", (*cured, cup))
        if tongues:
            yield Moment(f"{pour}: tongue in, to the ledge", (*cured, cup, *tongues))
        yield Moment(f"{pour}: layer {step.index} poured, struck off", (*cured, step.name, cup, *tongues))
        if tongues:
            yield Moment(f"{pour}: cured, tongue out first", (*cured, step.name, cup))
        yield Moment(f"{pour}: cup up, layer {step.index} stays", (*cured, step.name))
    unit = tuple(body.name for body in moulds.unit)
    yield Moment(
        "The unit: peeled off" + ("" if inserts or moulds.spec.motor.absent else ", motor and circuit in"), unit
    )


def exploded_moves(moulds: MouldSet) -> dict[str, Offset]:
    """Return how far each tool and each cast layer moves (mm) when the set is shown exploded.

    Up the axis in casting order; a tongue out of its window, a filament down.
    """
    plan = moulds.plan
    bottom, top = _extent(moulds, ["base"])
    offsets: dict[str, Offset] = {"base": (0.0, 0.0, 0.0)}

    def lift(*names: str) -> None:
        nonlocal top
        low, high = _extent(moulds, names)
        offsets.update((name, (0.0, 0.0, top + GAP - low)) for name in names)
        top += GAP + high - low

    for step in plan.steps:
        inserts = [body.name for body in step.inserts if body.name not in offsets]
        if inserts:
            lift(*inserts)
        cups = plan.standing(step, "cup")
        for cup in cups if len(cups) == 1 else ():
            lift(cup.name)
        for cup in cups if len(cups) > 1 else ():
            dx, dy, _ = cup.removal or (0.0, 0.0, 0.0)
            offsets[cup.name] = dx * ASIDE, dy * ASIDE, 0.0
        if len(cups) > 1:
            top = max(top, _extent(moulds, [cup.name for cup in cups])[1])
        lift(step.name)
    for tool in plan.tools:
        if tool.kind == "tongue" and tool.removal:
            offsets[tool.name] = (tool.removal[0] * ASIDE, 0.0, offsets[plan.steps[0].cup][2])
        elif tool.kind == "filament":
            offsets[tool.name] = (0.0, 0.0, bottom - GAP - _extent(moulds, [tool.name])[1])
        elif tool.name not in offsets:
            lift(tool.name)
    return offsets


def unit_apart(moulds: MouldSet) -> dict[str, Offset]:
    """Return the same for the unit's bodies: earlier pieces stay below."""
    layers = [body for body in sorted(moulds.unit, key=lambda body: body.step or 0) if body.kind == "layer"]
    inside = [body for kind in ("motor", "circuit") for body in moulds.unit if body.kind == kind]
    inside += [body for body in moulds.unit if body not in layers and body not in inside]
    below = max(moulds.design.laid_in - 1, 0)
    order = [*layers[:below], *inside, *layers[below:]]
    if moulds.design.opens == "above" and not moulds.design.laid_in:
        order = [*reversed(layers), *inside]
    offsets: dict[str, Offset] = {}
    top = -moulds.dimensions.skin
    for body in sorted(order, key=lambda body: body.kind != "film"):
        _, _, low, _, _, high = bounds(moulds.mesh(body))
        lift = max(0.0, top - low)
        offsets[body.name] = (0.0, 0.0, lift)
        top = high + lift + GAP / 2
    return offsets


def _solids(moulds: MouldSet, name: str) -> list[Manifold]:
    """Return the solids of a tool, an inserted piece or a cast layer in the frame of the tools (one a cell)."""
    for step in moulds.plan.steps:
        if step.name == name:
            return moulds.meshes(step.layer)
    return [moulds.mesh(body) for body in (*moulds.plan.steps[-1].inserts, *moulds.plan.tools) if body.name == name]


def _extent(moulds: MouldSet, names: Iterable[str]) -> tuple[float, float]:
    """Return the least and the largest z of tools or cast layers, mm."""
    boxes = [bounds(solid) for name in names for solid in _solids(moulds, name)]
    return min(b[2] for b in boxes), max(b[5] for b in boxes)


def pictures(moulds: MouldSet, only: Sequence[str] = ("unit", "moulds")) -> dict[str, Callable[[], bytes]]:
    """Return the functions that draw each picture of a variant as PNG, by the path of its file.

    The unit cut open, the set taken apart, each pour in section.
    """
    drawn: dict[str, Callable[[], bytes]] = {}
    if "unit" in only:
        drawn["unit.png"] = partial(unit_cut_open, moulds)
    if "moulds" in only:
        drawn["moulds/exploded.png"] = partial(exploded_view, moulds)
        for step in moulds.plan.steps:
            drawn[f"moulds/step{step.index}.png"] = partial(step_in_section, moulds, step.index)
    return drawn


def unit_cut_open(moulds: MouldSet) -> bytes:
    """Show the unit without its nearer half, seen from a little below: the skin's side is the open one."""
    halves = [_solid(_far_half(moulds.mesh(body)), body.colour, _name(body)) for body in moulds.unit]
    return draw(halves, (0.45, -1.0, -0.38), (1200, 640))


def _name(body: Body) -> str:
    return "circuit" if body.kind == "circuit" else spaced(body.name)


def step_in_section(moulds: MouldSet, index: int) -> bytes:
    """Show pour `index` when it is struck off, cut through the first row of cells."""
    step = moulds.plan.steps[index - 1]
    colours = _colours(moulds)
    y = min(cell.y for cell in moulds.plan.layout.cells)
    names = (*step.tools, *(f"layer{i}" for i in range(1, index + 1)), *(body.name for body in step.inserts))
    halves = [_solid(_far_half(solid, y), colours[name]) for name in names for solid in _solids(moulds, name)]
    return draw(halves, (0.18, -1.0, 0.48), (1200, 640))


def exploded_view(moulds: MouldSet) -> bytes:
    """Show the whole set taken apart, with names."""
    colours, offsets = _colours(moulds), exploded_moves(moulds)
    groups = [[tool.name for tool in moulds.plan.of_kind(kind)] for kind in ("tongue", "filament")]
    numbered = [name for group in groups if len(group) > 1 for name in group]
    unnamed = {name for group in groups for name in group[1:]}
    names, parts = {body.name: _name(body) for body in moulds.unit}, []
    for name, offset in offsets.items():
        for i, solid in enumerate(_solids(moulds, name)):
            shown = name.rstrip("1") if name in numbered else names.get(name, spaced(name))
            label = "" if i or name in unnamed else shown
            parts.append(_solid(solid.translate(offset), colours[name], label))
    return draw(parts, (0.55, -1.0, 0.5), (1000, 1300))


def _colours(moulds: MouldSet) -> Mapping[str, Colour]:
    return {body.name: body.colour for body in (*moulds.unit, *moulds.plan.tools)}


def _far_half(solid: Manifold, y: float = 0.0) -> Manifold:
    """Return the part beyond the plane y, slightly off it: a section in a parting plane shows false triangles."""
    return solid.trim_by_plane((0, 1, 0), y + 1 / 512)


def _solid(solid: Manifold, colour: Colour, label: str = "") -> Surface:
    return Surface(*arrays(solid), colour, label)
