"""The sheets of an array's drawing: its patch, with a table of places, and the tools of its sheet."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

from manifold3d import Manifold, OpType

from unitcad.arrays.patch import PatchMoulds, patch_bodies
from unitcad.export import lengths, svg
from unitcad.export.chart import coord
from unitcad.export.drawing import Sheet, View
from unitcad.export.lengths import Hole, Length
from unitcad.kernels.mesh import realise
from unitcad.pipeline import workshop
from unitcad.pipeline.manifest import Skipped
from unitcad.shape.tree import Body


def array_sheets(moulds: PatchMoulds, only: Sequence[str], hash_: str) -> Iterator[Sheet]:
    """Yield the sheets of the patch and of the tools, each if `only` has it; `hash_`: of the array's file.

    A patch that is cast round a limb is drawn flat; its tools with curved faces have no sheet.
    """
    if "unit" in only:
        yield _patch(moulds, hash_)
    if "moulds" in only:
        places = [(place.name, place.x, place.y) for place in moulds.array.places]
        yield from workshop.tools(moulds, _flat(moulds), hash_, places)


def without_sheet(moulds: PatchMoulds) -> list[Skipped]:
    """Return the printed pieces that have no sheet, and why."""
    flat = {body.name for body in _flat(moulds)}
    lacking = [body.name for body in moulds.plan.pieces if body.made == "printed" and body.name not in flat]
    reason = "a caliper does not reach lengths along faces that are curved round the limb"
    return [Skipped(output=f"drawing of {moulds.plan.called(name)}", reason=reason) for name in lacking]


def _flat(moulds: PatchMoulds) -> tuple[Body, ...]:
    inner = moulds if moulds.array.cast == "flat" else moulds.inner
    return inner.plan.pieces if inner else ()


def _patch(moulds: PatchMoulds, hash_: str) -> Sheet:
    array = replace(moulds.array, cast="flat")
    sheet, bodies = array.sheet, patch_bodies(array)
    solid = Manifold.batch_boolean([realise(body.shape, moulds.segments, 1.0) for body in bodies], OpType.Add)
    x0, y0, x1, y1 = sheet.outline
    outline = (
        Length(coord(x1 - x0, 2), (x0, y0), (x1, y0), "below"),
        Length(coord(y1 - y0, 2), (x0, y0), (x0, y1), "left"),
    )
    r = sheet.corner_mm
    corner = svg.Note(f"4× R{coord(r, 2)}", (x1 - (1 - math.sqrt(0.5)) * r, y1 - (1 - math.sqrt(0.5)) * r))
    plan = replace(workshop.plan_of(solid), lengths=outline, notes=(corner,))
    cut = min((place.y for place in array.places), key=lambda y: (abs(y - (y0 + y1) / 2), y))
    regions = _joined(svg.cut(bodies, moulds.segments, y=cut, swell=1.0))
    loops = [loop for region in regions for loop in region.loops]
    holes = [
        Hole(place.name, place.x, place.y, f"Ø{coord(2 * place.radius, 2)}", (2 * place.radius,))
        for place in array.places
    ]
    for i, (a, b, c, d) in enumerate(sheet.strap_slots, 1):
        holes.append(Hole(f"S{i}", (a + c) / 2, (b + d) / 2, f"{coord(c - a, 2)} x {coord(d - b, 2)}"))
    worn = f", worn round a radius of {array.radius_mm:g} mm" if array.radius_mm else ""
    material = f"sheet {sheet.material}{worn}"
    facts = workshop.facts("patch", array.name, moulds.plan.label, material, hash_, "none: silicone")
    return Sheet(
        facts, View(tuple(regions), tuple(lengths.heights(loops, loops)), notes=tuple(svg.names(regions))), plan, cut,
        tuple(holes), (x0, y0), hatched=False,
    )  # fmt: skip


def _joined(regions: Sequence[svg.Region]) -> list[svg.Region]:
    """Return one region for each kind of body, whatever its place."""
    found: dict[str, svg.Region] = {}
    for region in regions:
        name = region.name.rpartition("-")[2]
        loops = found[name].loops if name in found else ()
        found[name] = replace(region, name=name, loops=(*loops, *region.loops))
    return list(found.values())
