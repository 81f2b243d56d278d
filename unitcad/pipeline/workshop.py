"""The drawing for a workshop: the sheets of a unit and of the tools that are printed, with a caliper's checks."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
from manifold3d import CrossSection, FillRule, Manifold, OpType

from unitcad import __version__
from unitcad.casting.resin import in_resin
from unitcad.export import drawing, lengths, paper, svg
from unitcad.export.chart import coord
from unitcad.export.drawing import Sheet, View
from unitcad.export.lengths import Hole, Length, Slices
from unitcad.export.svg import Region
from unitcad.kernels.mesh import bounds, realise
from unitcad.moulds.mould_set import MouldSet
from unitcad.shape.tree import Body
from unitcad.spec import Spec, printer_of
from unitcad.text import number

SECTIONS = 16
"""Planes that are tried for the section of a piece without a cell."""
Place = tuple[str, float, float]
"""Name, x and y of a cell, mm."""


def content(sheets: Sequence[Sheet]) -> bytes:
    """Return the sheets as PDF. Raises Missing without reportlab."""
    return paper.content(drawing.pages(sheets))


def facts(
    piece: str, name: str, label: str, material: str, hash_: str, tolerance: str
) -> tuple[tuple[tuple[str, str, float], ...], ...]:
    """Return the rows of a title block: name, text and share of the width of each cell."""
    return (
        (("piece", piece, 3.0), ("variant", name, 3.4), ("mould set", label, 1.4)),
        (("material", material, 3.4), ("tolerance, mm", tolerance, 3.4)),
        (
            ("made by; hash of the spec", f"unitcad {__version__}, {hash_[:12]}", 3.0),
            ("lengths", "mm, as drawn", 1.4),
            ("projection", "first angle", 1.9),
        ),
    )


def tolerance(spec: Spec) -> tuple[tuple[str, str], str]:
    """Return how far lengths of a printed piece in the plane, and heights, may be off, and both in words.

    Two mating pieces that are wider and narrower by the printer's play go together: the gap between them is at least
    the play on each side. Heights are off by a printed layer.
    """
    printer = printer_of(spec)
    found = [(printer.xy_play_mm, "lengths"), (printer.layer_mm, "heights")]
    signed = tuple(f"±{number(float(value), 3)}" if float(value) else "none" for value, _ in found)
    said = [
        f"{words} {sign}{' assumed' if value.status == 'assumed' else ''}"
        for (value, words), sign in zip(found, signed, strict=True)
    ]
    return (signed[0], signed[1]), ", ".join(said)


def sheets(moulds: MouldSet, only: Sequence[str], hash_: str) -> Iterator[Sheet]:
    """Yield the sheet of the unit and those of the tools, each if `only` has it; `hash_`: of the spec."""
    spec = moulds.spec
    if "unit" in only:
        label = moulds.plan.label if "moulds" in only else ""
        yield _unit(moulds, facts("unit", spec.name, label, _silicones(spec), hash_, "none: silicone"))
    if "moulds" in only:
        cells = [(cell.name, cell.x, cell.y) for cell in moulds.plan.layout.cells]
        yield from tools(moulds, moulds.plan.pieces, hash_, cells)


def tools(moulds: MouldSet, bodies: Sequence[Body], hash_: str, places: Sequence[Place]) -> Iterator[Sheet]:
    """Yield the sheet of each body that is printed; `places`: names and middles of what the tools shape, mm."""
    spec, label = moulds.spec, moulds.plan.label
    allowed, said = tolerance(spec)
    made = f"{'resin' if in_resin(moulds) else 'filament'}, printer {spec.moulds.printer}"
    for body in bodies:
        if body.made == "printed":
            title = facts(moulds.plan.called(body.name), spec.name, label, made, hash_, said)
            yield replace(tool(moulds, body, places), facts=title, tolerance=allowed)


def _silicones(spec: Spec) -> str:
    return ", ".join(f"layer {i} {layer.material}" for i, layer in enumerate(spec.layers, 1))


def _unit(moulds: MouldSet, title: tuple[tuple[tuple[str, str, float], ...], ...]) -> Sheet:
    round_layers = moulds.design.tooling == "concentric"
    regions, measures, notes = svg.unit_view(moulds.unit, moulds.dimensions, moulds.segments, round_layers, math.inf)
    found = []
    for one in measures:
        ends = (one.start, one.reach), (one.end, one.reach)
        if one.side != "below":
            ends = (one.reach, one.start), (one.reach, one.end)
        found.append(Length(one.text, *ends, one.side))
    solid = Manifold.batch_boolean([realise(one.shape, moulds.segments, 1.0) for one in moulds.unit], OpType.Add)
    named = (*notes, *svg.names(regions))
    return Sheet(title, View(tuple(regions), tuple(found), (0.0,), named), plan_of(solid, (0.0,)), 0.0)


def tool(moulds: MouldSet, body: Body, places: Sequence[Place]) -> Sheet:
    """Return a tool's sheet, without its title: cut through the row of cells that is nearest to its middle."""
    # A polygon's corners on the circle: a round face is then as wide as it is drawn.
    solid = realise(body.shape, moulds.segments, 1.0)
    x0, y0, _, x1, y1, _ = bounds(solid)
    inside = [(name, x, y) for name, x, y in places if x0 < x < x1 and y0 < y < y1]
    cut = _plane(solid, sorted({y for _, _, y in inside}))
    slices, loops, behind = Slices(solid), lengths.section(solid, cut), lengths.beyond(solid, cut)
    apart = (math.dist(a, b) for (_, *a), (_, *b) in combinations(places, 2))
    reach = min(apart, default=math.inf) / 2 - lengths.SAME_MM
    holes = [
        Hole(name, x, y, f"Ø{coord(lengths.working(found), 2)}", found)
        for name, x, y in inside
        if (found := slices.diameters(x, y, reach))
    ]
    middle, row = (x0 + x1) / 2, sorted(x for _, x, y in inside if y == cut)
    typical = max((_about(loops, x, slices, cut, reach, len(inside)) for x in row), key=len, default=[])
    shown = [*typical, *(one for one in lengths.across(loops, middle) if not _touches(one, row, reach))]
    known = {(round(one.start[0], 2), round(one.end[0], 2)): one for one in reversed(shown)}
    known.pop((round(x0, 2), round(x1, 2)), None)  # from above
    shown = list(known.values())[::-1]
    plan = plan_of(solid, [x for _, x, _ in inside if len(inside) == 1])
    levels = lengths.heights(loops, behind)
    ordered = [
        *plan.lengths[:2],
        *(one for one in levels if "depth" not in one.name),
        *sorted(shown, key=lambda one: (not _works(one, holes), one.name == "", -one.value)),
        *plan.lengths[2:],
        *(one for one in levels if "depth" in one.name),
    ]
    if sum(bool(one.name) for one in ordered) < 5:
        more = [replace(one, side="left") for one in lengths.between_faces(loops) if one.side == "left"]
        outline = [[(a, b) for a, b in loop] for loop in plan.regions[0].loops]
        known = {round(one.value, 2) for one in ordered}
        extra = [one for one in lengths.between_faces(outline) if round(one.value, 2) not in known]
        wide = [one for one in lengths.between_faces(loops) if one.side == "below"]
        shown += [one for one in wide if round(one.value, 2) not in known]
        levels += [one for one in more if round(one.value, 2) not in known]
        plan = replace(plan, lengths=(*plan.lengths, *extra))
        ordered = [*plan.lengths[:2], *levels, *shown, *plan.lengths[2:]]
    checks = lengths.numbered(ordered)

    def checked(found: Sequence[Length]) -> tuple[Length, ...]:
        return tuple(replace(one, check=checks.get(one, 0)) for one in found)

    front = (*checked(levels), *checked(shown), *lengths.windows(loops, lambda x, z: _window(solid, cut, x, z)))
    table = [*(holes if len(inside) > 1 else ()), *slices.others(holes)]
    section = Region("", body.colour, loops)
    axes = tuple(row) if holes else ()
    return Sheet(
        facts=(),
        front=View((section,), front, axes, beyond=behind),
        plan=replace(plan, lengths=checked(plan.lengths)),
        cut=cut,
        holes=tuple(table),
        datum=(x0, y0),
    )


def _about(
    loops: Sequence[lengths.Loop], centre: float, slices: Slices, cut: float, reach: float, count: int
) -> list[Length]:
    """Return the widths about a cell's axis, up to half of the way to the next; of several cells, with their number."""
    found = slices.diameters(centre, cut, reach)

    def round_at(half: float, *_: float) -> bool:
        return any(abs(2 * half - d) < 2 * lengths.ROUND_MM for d in found)

    about = [one for one in lengths.across(loops, centre, round_at) if one.value / 2 < reach]
    return [replace(one, text=f"{count}× {one.text}") if count > 1 and "Ø" in one.text else one for one in about]


def _touches(one: Length, row: Sequence[float], reach: float) -> bool:
    """Return whether one of several cells' own faces ends a length."""
    return len(row) > 1 and any(abs(end - x) < reach for end in (one.start[0], one.end[0]) for x in row)


def _works(one: Length, holes: Sequence[Hole]) -> bool:
    return any(abs(one.value - lengths.working(hole.diameters)) < lengths.SAME_MM for hole in holes[:1])


def _window(solid: Manifold, cut: float, x: float, z: float) -> float | None:
    """Return the width of an opening in the outer face at (x, z) of a section, None without one."""
    inward = x - math.copysign(lengths.LEAST_EDGE_MM / 4, x)
    ends = [
        a[1] + (b[1] - a[1]) * (inward - a[0]) / (b[0] - a[0]) - cut
        for loop in map(np.asarray, solid.slice(z).to_polygons())
        for a, b in zip(loop, np.roll(loop, -1, axis=0), strict=True)
        if (a[0] > inward) != (b[0] > inward)
    ]
    above, below = [at for at in ends if at > 0], [at for at in ends if at <= 0]
    return min(above) - max(below) if above and below else None


def _plane(solid: Manifold, rows: Sequence[float]) -> float:
    """Return y of the section: of the row of cells nearest to a piece's middle; without cells the middle itself.

    A piece that is hollow there is cut at its largest section.
    """

    def area(y: float) -> float:
        loops = [np.array(loop) for loop in lengths.section(solid, y)]
        return float(CrossSection(loops, FillRule.EvenOdd).area()) if loops else 0.0

    _, y0, _, _, y1, _ = bounds(solid)
    middle = (y0 + y1) / 2
    wanted = [*sorted(rows, key=lambda y: (abs(y - middle), y)), middle]
    more = [y0 + (y1 - y0) * i / SECTIONS for i in range(1, SECTIONS)]
    return next((y for y in wanted if area(y) > 0), max(more, key=area))


def plan_of(solid: Manifold, axes: Sequence[float] = ()) -> View:
    """Return the view of a solid from above, with its length and width first; `axes`: x of its axes, mm."""
    seen, (x0, y0, _, x1, y1, _) = lengths.from_above(solid), bounds(solid)
    found = [
        Length(coord(x1 - x0, 2), (x0, y0), (x1, y0), "below", "length"),
        Length(coord(y1 - y0, 2), (x0, y0), (x0, y1), "left", "width"),
    ]
    turned = [[(b, a) for a, b in loop][::-1] for loop in seen[0].loops]
    for one in lengths.across(turned, (y0 + y1) / 2, least=lengths.LEAST_SIDE_MM):
        if one.value < y1 - y0 - lengths.SAME_MM:
            start, end = ((max(z, x0), y) for y, z in (one.start, one.end))
            found.append(replace(one, start=start, end=end, side="left"))
    return View(tuple(seen), tuple(found), tuple(axes))
