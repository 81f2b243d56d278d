"""C200: no two solids of the unit, or of an assembled pour, share volume. Ribs count as crushed: C220 looks at them."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

from manifold3d import Manifold

from unitcad.mould_checks.check import MouldCheck
from unitcad.mould_checks.finding import MouldFinding, at_most
from unitcad.moulds.cavities import boxes_meet, united
from unitcad.moulds.mould_set import MouldSet

OVERLAP = 1e-6
"""Largest volume two pieces may share, mm3: what rounding leaves where faces touch."""


def findings(moulds: MouldSet) -> list[MouldFinding]:
    """Look at the unit, then at each assembled pour: tools, cured layers, what is laid in, and the one being cast.

    The cells of a layer are compared with each other, then count as one solid.
    """
    return moulds.once("C200", lambda: [*of_unit(moulds), *_of_pours(moulds)])


def of_unit(moulds: MouldSet) -> list[MouldFinding]:
    """Look at the unit alone."""
    return _overlaps("unit", [(body.name, moulds.mesh(body)) for body in moulds.unit], {})


def _of_pours(moulds: MouldSet) -> Iterator[MouldFinding]:
    cast: list[tuple[str, Manifold]] = []
    shared: dict[tuple[str, str], float] = {}
    for step in moulds.plan.steps:
        cells = moulds.meshes(step.layer)
        yield from _overlaps(f"pour {step.index}", [(f"{step.name}.{i + 1}", c) for i, c in enumerate(cells)], shared)
        cast.append((step.name, united(cells)))
        laid = [(body.name, moulds.mesh(body)) for body in step.inserts]
        standing = [(name, moulds.pressed[name]) for name in step.tools] + cast + laid
        yield from _overlaps(f"pour {step.index}", standing, shared)


def _overlaps(
    where: str, there: list[tuple[str, Manifold]], shared: dict[tuple[str, str], float]
) -> list[MouldFinding]:
    """Return the pair that shares most, and every pair that shares too much.

    `shared` keeps the volumes by name: a pair that stands together in several pours is cut once.
    """
    pairs = []
    for (a, solid), (b, other) in combinations(there, 2):
        if boxes_meet(solid, other):
            if (a, b) not in shared:
                shared[a, b] = (solid ^ other).volume()
            pairs.append(at_most("C200", f"{where}: {a} and {b}", shared[a, b], OVERLAP, "mm3"))
    return [f for f in pairs if not f.ok] or sorted(pairs, key=lambda f: -f.value)[:1]


CHECK = MouldCheck("C200", "overlap: no two solids of an assembled step share volume", findings)
