"""C200: no two solids of the unit, of a patch, or of an assembled pour, share volume.

Ribs count as crushed: C220 looks at them. A pocket counts as stretched round its unit: C310 looks at its strain. In
bodies from a file films of facets are ignored: two facets reach into each other by their distances from the true
surface. A wire may touch its slot's floor: the corners of its polygon and the grid of lengths are ignored likewise.
In a mesh file a pocket of coarse facets for a bought part passes with a note.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from types import MappingProxyType

import numpy as np
from manifold3d import Manifold

from unitcad.checks.finding import GRID, MouldCheck, MouldFinding, at_most
from unitcad.kernels.bounds import deviation
from unitcad.kernels.mesh import thick_pieces
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.plan import Step
from unitcad.shape import Shape
from unitcad.spec.custom_code import is_body_file, is_custom
from unitcad.text import number

UNIT = "unit"
OF_UNIT = f"{UNIT}: "
"""Start of the place of a finding about the unit itself, which stays whichever mould is taken."""
POCKET = 0.05
"""Depth to which the facets of a pocket may reach into the bought part in it, mm: soft silicone gives way."""
OVERLAP = 1e-6
"""Largest volume two pieces may share, mm3: rounding of faces that touch."""


def findings(moulds: MouldSet) -> list[MouldFinding]:
    """Look at the unit, then at each assembled pour: tools, cured layers, inserts, and the layer being cast.

    The cells of a layer are compared with each other, then count as one solid.
    """
    return [*of_unit(moulds), *_of_pours(moulds)]


def of_unit(moulds: MouldSet) -> list[MouldFinding]:
    """Look at the unit, or the patch, alone."""
    there = [(name, moulds.meshes(shapes)) for name, shapes in moulds.together]
    wires = [body for body in moulds.unit if body.kind == "wire"]
    round_parts = {body.name: GRID + deviation(body.shape, moulds.segments) for body in wires}
    found = _findings(UNIT, there, moulds.facets, {}, round_parts)
    return [finding if finding.ok else _explained(moulds, finding) for finding in found]


def _explained(moulds: MouldSet, found: MouldFinding) -> MouldFinding:
    """Return a finding of the unit with its remedy; one of a pocket that only its facets make narrow passes."""
    bodies = {body.name: body for body in moulds.unit}
    pair = [bodies.get(name) for name in found.where.removeprefix(OF_UNIT).split(" and ")]
    bought = next((body for body in pair if body and body.made == "bought"), None)
    cast = next((body for body in pair if body and body.made == "cast"), None)
    if not (bought and cast and is_custom(moulds.spec.design)):
        return found
    shared = moulds.mesh(bought) ^ moulds.mesh(cast)
    # How far the facets of a mesh file are from the surface that was meant is not known; a STEP file has surfaces.
    coarse = is_body_file(moulds.spec.design) and not moulds.spec.design.lower().endswith((".step", ".stp"))
    if coarse and not thick_pieces(shared, POCKET):
        film = max(found.value, POCKET * float(shared.surface_area()) / 2)
        note = f"{cast.name} is at most {POCKET} mm narrower than its {bought.name}, as facets are: it gives way"
        return replace(found, ok=True, limit=film, advice=note)
    size = "" if bought.kind != "motor" else f" of {number(moulds.spec.motor.diameter_mm, 4)} x "
    size += size and f"{number(moulds.spec.motor.thickness_mm, 4)} mm on the skin"
    ways = f"draw {cast.name} with room for the {bought.name}{size}"
    ways += ", change motor.diameter_mm and motor.thickness_mm, or leave it out: motor = false" if size else ""
    return replace(found, advice=ways)


_There = Sequence[tuple[str, Sequence[Manifold]]]
"""The pieces of a pour by name: a layer has a part in every cell."""


def _of_pours(moulds: MouldSet) -> Iterator[MouldFinding]:
    known: dict[tuple[str, str], float] = {}  # a pair that several pours have in common is cut once
    for step in moulds.plan.steps:
        cells = moulds.meshes(step.layer)
        alone = [(f"{step.name}.{i + 1}", [cell]) for i, cell in enumerate(cells)]
        cast = [*((name, moulds.meshes(shapes)) for name, shapes in _earlier(moulds, step)), (step.name, cells)]
        laid = [(body.name, [moulds.mesh(body)]) for body in step.inserts]
        tools = [(name, [moulds.pressed[name]]) for name in step.tools]
        for there in (alone, [*tools, *cast, *laid]):
            yield from _findings(f"pour {step.index}", there, moulds.facets, known)


def _earlier(moulds: MouldSet, step: Step) -> Iterator[tuple[str, tuple[Shape, ...]]]:
    """Yield the cured layers of a pour by name, at their places in it: a layer that was laid in is another solid."""
    start = 0
    for before in moulds.plan.steps[: step.index - 1]:
        there = step.earlier[start : start + len(before.layer)]
        start += len(before.layer)
        yield before.name if there == before.layer else f"{before.name} laid in", there


def _findings(
    where: str,
    there: _There,
    facets: float,
    known: dict[tuple[str, str], float],
    round_parts: Mapping[str, float] = MappingProxyType({}),
) -> list[MouldFinding]:
    """Return the pair that shares most, and every pair that shares too much; note each pair's volume, mm3.

    `round_parts`: how far a round part in a flat passage may seem to be outside the passage, by its name, mm.
    """
    pairs = []
    boxes = [np.array([solid.bounding_box() for solid in parts]) for _, parts in there]
    for ((a, parts), own), ((b, others), beside) in combinations(zip(there, boxes, strict=True), 2):
        apart = (own[:, None, :3] > beside[None, :, 3:]) | (beside[None, :, :3] > own[:, None, 3:])
        meeting = np.argwhere(~apart.any(axis=2))
        if not len(meeting):
            continue
        if (a, b) not in known:
            films = facets + round_parts.get(a, 0.0) + round_parts.get(b, 0.0)
            known[a, b] = sum(common_volume(parts[i], others[k], films) for i, k in meeting)
        pairs.append(at_most("C200", f"{where}: {a} and {b}", known[a, b], OVERLAP, "mm3"))
    return [f for f in pairs if not f.ok] or sorted(pairs, key=lambda f: -f.value)[:1]


def common_volume(one: Manifold, other: Manifold, facets: float = 0.0) -> float:
    """Return the volume that two solids share, mm3, without films up to `facets` thick.

    If faces coincide the mesh kernel now and then keeps a part that is not shared, but not in each order of the two and
    not in their difference, so a finding needs all of them. `one` is cut first: it takes half as long.
    """
    shared = one ^ other
    volume = float(shared.volume())
    if volume <= OVERLAP:
        return volume
    if facets:
        opinions = (thick_pieces(solid, facets) for solid in (shared, other ^ one))
        return min(sum(float(piece.volume()) for piece in pieces) for pieces in opinions)
    return min(volume, float((other ^ one).volume()), float(other.volume() - (other - one).volume()))


CHECK = MouldCheck("C200", "overlap: no two solids of an assembled step share volume", findings)
