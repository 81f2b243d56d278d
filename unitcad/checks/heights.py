"""C260: cavity, caps, height over all and tongue come out of the printer as the spec has them.

A printer makes whole layers, the first of them of its own height (moulds.first_layer_mm). Each height is worked out in
the layers that a slicer makes of base and cups: it cuts each layer at its middle. A height that is more than 5 % off
is a warning, not a failure: the unit can be cast, and its caps are thicker or thinner than asked. A finding that says
so names a cap or a layer height that prints right. A rim above the core of an open ring leaves a film that closes it.
"""

from __future__ import annotations

from collections.abc import Iterator

from unitcad.checks.finding import MouldCheck, MouldFinding
from unitcad.designs.printed import SHORT
from unitcad.moulds.heights import MOST_ERROR, film_mm, height_warnings, missed, unit_heights
from unitcad.moulds.mould_set import MouldSet


def findings(moulds: MouldSet) -> Iterator[MouldFinding]:
    """Compare every height as printed with the spec's."""
    said = {miss.height.what: miss.said for miss in missed(moulds)}
    for each in unit_heights(moulds):
        advice = said.get(each.what, "")
        yield MouldFinding("C260", each.what, True, 100 * each.error, 100 * MOST_ERROR, "%", advice)
    film = film_mm(moulds)
    if film > SHORT:
        yield MouldFinding("C260", "rims over cores", True, film, SHORT, "mm", height_warnings(moulds)[-1])


CHECK = MouldCheck("C260", "heights: what whole layers make of them is within 5 % of the spec, or it is said", findings)
