"""C200: no two solids of the unit, of a patch, or of an assembled pour, share volume.

Ribs count as crushed: C220 looks at them. A pocket counts as stretched round its unit: C310 looks at its strain. In
bodies from a file films of facets are ignored: two facets reach into each other by their distances from the true
surface. In a mesh file a pocket of coarse facets for a bought part passes with a note.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from manifold3d import Manifold

from unitcad.checks.finding import MouldCheck, MouldFinding, at_most
from unitcad.kernels.mesh import thick_pieces
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.plan import Step
from unitcad.shape import Shape, union
from unitcad.spec.custom_code import is_body_file, is_custom
from unitcad.text import number

POCKET = 0.05
"""Depth to which the facets of a pocket may reach into the bought part in it, mm: soft silicone gives way."""
OVERLAP = 1e-6
"""Largest volume two pieces may share, mm3: rounding of faces that touch."""


def findings(moulds: MouldSet) -> list[MouldFinding]:
    """Look at the unit, then at each assembled pour: tools, cured layers, inserts, and the layer being cast.

    The cells of a layer are compared with each other, then count as one solid.
    """
    return moulds.once("C200", lambda: _of_all(moulds))


def _of_all(moulds: MouldSet) -> list[MouldFinding]:
    volumes = _Volumes(moulds.facets)
    pours = [*_of_pours(moulds, volumes)]
    return [*of_unit(moulds, _of_layers(moulds, volumes)), *pours]


def _of_layers(moulds: MouldSet, volumes: _Volumes) -> dict[tuple[str, str], float]:
    """Return the shared volumes of the unit's layers by name, if the last pour has them at the same places."""
    last = moulds.plan.steps[-1]
    cast = [*_earlier(moulds, last), (last.name, last.layer)]
    bodies = {name: body.name for name, shapes in cast for body in moulds.unit if body.shape == union(shapes)}
    known = volumes.of_names.items()
    return {(bodies[a], bodies[b]): volume for (a, b), volume in known if a in bodies and b in bodies}


def of_unit(moulds: MouldSet, known: Mapping[tuple[str, str], float] | None = None) -> list[MouldFinding]:
    """Look at the unit, or the patch, alone; `known` has volumes that pairs share, by their names."""
    there = [(name, moulds.meshes(shapes)) for name, shapes in moulds.together]
    found = _findings("unit", there, _Volumes(moulds.facets, known))
    return [finding if finding.ok else _explained(moulds, finding) for finding in found]


def _explained(moulds: MouldSet, found: MouldFinding) -> MouldFinding:
    """Return a finding of the unit with its remedy; one of a pocket that only its facets make narrow passes."""
    bodies = {body.name: body for body in moulds.unit}
    pair = [bodies.get(name) for name in found.where.removeprefix("unit: ").split(" and ")]
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


def _of_pours(moulds: MouldSet, volumes: _Volumes) -> Iterator[MouldFinding]:
    for step in moulds.plan.steps:
        cells = moulds.meshes(step.layer)
        alone = [(f"{step.name}.{i + 1}", [cell]) for i, cell in enumerate(cells)]
        yield from _findings(f"pour {step.index}", alone, volumes)
        cast = [*((name, moulds.meshes(shapes)) for name, shapes in _earlier(moulds, step)), (step.name, cells)]
        laid = [(body.name, [moulds.mesh(body)]) for body in step.inserts]
        tools = [(name, [moulds.pressed[name]]) for name in step.tools]
        yield from _findings(f"pour {step.index}", [*tools, *cast, *laid], volumes)


def _earlier(moulds: MouldSet, step: Step) -> Iterator[tuple[str, tuple[Shape, ...]]]:
    """Yield the cured layers of a pour by name, at their places in it: a layer that was laid in is another solid."""
    start = 0
    for before in moulds.plan.steps[: step.index - 1]:
        there = step.earlier[start : start + len(before.layer)]
        start += len(before.layer)
        yield before.name if there == before.layer else f"{before.name} laid in", there


def _findings(where: str, there: _There, volumes: _Volumes) -> list[MouldFinding]:
    """Return the pair that shares most, and every pair that shares too much."""
    pairs = []
    boxes = np.array([volumes.box(parts) for _, parts in there]).reshape(-1, 6)
    for i, k in np.argwhere(np.triu(_meet(boxes, boxes), 1)):
        volume = volumes.shared(there[i], there[k])
        if volume is not None:
            pairs.append(at_most("C200", f"{where}: {there[i][0]} and {there[k][0]}", volume, OVERLAP, "mm3"))
    return [f for f in pairs if not f.ok] or sorted(pairs, key=lambda f: -f.value)[:1]


def common_volume(one: Manifold, other: Manifold, facets: float = 0.0) -> float:
    """Return the volume that two solids share, mm3, without films up to `facets` thick.

    If faces coincide the mesh kernel now and then keeps a part that is not shared, but not in each order of the two and
    not in their difference, so a finding needs all of them. `other` is cut first: it takes half as long.
    """
    shared = other ^ one
    volume = float(shared.volume())
    if volume <= OVERLAP:
        return volume
    if facets:
        opinions = (thick_pieces(solid, facets) for solid in (shared, one ^ other))
        return min(sum(float(piece.volume()) for piece in pieces) for pieces in opinions)
    return min(volume, float((one ^ other).volume()), float(one.volume() - (one - other).volume()))


class _Volumes:
    """The volumes that pairs share: a pair that several pours have in common is cut once.

    `known` and `of_names` have volumes by names; films up to `facets` thick, mm, are left out.
    """

    def __init__(self, facets: float, known: Mapping[tuple[str, str], float] | None = None) -> None:
        self.facets = facets
        self.of_names = dict(known or {})
        self._boxes: dict[int, tuple[float, ...]] = {}
        self._kept: list[Manifold] = []

    def shared(self, one: tuple[str, Sequence[Manifold]], other: tuple[str, Sequence[Manifold]]) -> float | None:
        """Return the volume that two named pieces share, mm3; None if none of their boxes meet."""
        (a, parts), (b, others) = one, other
        boxes, beside = (np.array([self._box(part) for part in each]) for each in (parts, others))
        meeting = np.argwhere(_meet(boxes, beside))
        if not len(meeting):
            return None
        if (a, b) not in self.of_names:
            self.of_names[a, b] = sum(common_volume(others[k], parts[i], self.facets) for i, k in meeting)
        return self.of_names[a, b]

    def box(self, parts: Sequence[Manifold]) -> np.ndarray:
        """Return the box round several solids: its low corner, then the high one, mm."""
        boxes = np.array([self._box(part) for part in parts])
        return np.concatenate([boxes[:, :3].min(axis=0), boxes[:, 3:].max(axis=0)])

    def _box(self, solid: Manifold) -> tuple[float, ...]:
        if id(solid) not in self._boxes:
            self._boxes[id(solid)] = solid.bounding_box()
            self._kept.append(solid)  # or its identity could become another's
        return self._boxes[id(solid)]


def _meet(boxes: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Tell for every two of two sets of boxes (n, 6) and (m, 6) whether they touch."""
    low, high = boxes[:, None, :3], boxes[:, None, 3:]
    return np.all((low <= others[None, :, 3:]) & (others[None, :, :3] <= high), axis=2)


CHECK = MouldCheck("C200", "overlap: no two solids of an assembled step share volume", findings)
