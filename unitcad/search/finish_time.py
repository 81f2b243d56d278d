"""When a unit is out of its mould: its procedure's earliest finish, and what of it does not depend on the silicones."""

from __future__ import annotations

import math
from collections.abc import Sequence

from unitcad import catalogue
from unitcad.casting.figures import at_room
from unitcad.casting.procedure import procedure
from unitcad.catalogue import Material
from unitcad.errors import Refusal
from unitcad.moulds.mould_set import MouldSet
from unitcad.search.geometries import Geometry
from unitcad.spec import Spec

Work = dict[tuple[str, str, int], float]
"""Hours at the bench by design, motor and number of layers: the lengths do not change them."""


def finish_hours(spec: Spec) -> float:
    """Return the hours from the first pour's first step until the units are out of the mould.

    What comes before it is done once for a mould, and in resin waits for a test of the silicones' cure. Raises Refusal
    where the moulds can't be made.
    """
    # Volumes enter the grams alone, and of these the procedure's times read none.
    made = procedure(MouldSet(spec), (1.0,) * len(spec.layers), 1.0)
    begins = next(phase.start_min for phase in made.time_line if phase.name == "pour 1")
    return (made.earliest_finish_min - begins) / 60


def cure_hours(materials: Sequence[str], known: dict[str, Material], room_c: float) -> float:
    """Return the hours that layers of these silicones cure, one after the other, at the room's temperature."""
    return sum(at_room(float(known[name].cure_h), room_c) for name in materials)


def bench_hours(geometry: Geometry, work: Work) -> float:
    """Return the hours of a geometry's procedure without its cures, worked out once for each entry of `work`.

    NaN where the moulds can't be made.
    """
    lengths, spec = geometry.lengths, geometry.spec
    key = lengths.design, lengths.motor, len(lengths.walls)
    if key not in work:
        known = catalogue.materials(spec.materials)
        names = [layer.material for layer in spec.layers]
        try:
            work[key] = finish_hours(spec) - cure_hours(names, known, spec.casting.room_c)
        except Refusal:
            return math.nan
    return work[key]
