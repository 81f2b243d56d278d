"""Moulds for tensile coupons from the phantom's own pours: ASTM D412 die C (the dumb-bell of 6 by 33 mm).

.--------.                      .--------.
|         '-.________________.-'         |    6 wide over 33, radii 14 and 25,
|         .-'                '-.         |    25 wide over all 115, 3 thick
'--------'                      '--------'
"""

from __future__ import annotations

import math

from unitcad.catalogue import Printer
from unitcad.lab.phantom.description import PhantomTable
from unitcad.shape import Extrude, Profile, Shape, box, cut, moved
from unitcad.shape.body import Body
from unitcad.shape.lettering import HEIGHT, engraving

LENGTH, TAB, WIDTH, GAUGE, INNER_RADIUS, OUTER_RADIUS = 115.0, 25.0, 6.0, 33.0, 14.0, 25.0
"""Over all, width of the tabs, width and length of the narrow part, radii beside it and at the tabs, mm."""
THICKNESS, FLOOR, MARGIN, GAP = 3.0, 2.0, 5.0, 4.0
_LABEL = 9.0
_COLOUR = (0.85, 0.75, 0.9)


def outline() -> Profile:
    """Return die C's outline about its middle, along x."""
    half, narrow, wide = LENGTH / 2, WIDTH / 2, TAB / 2
    low, high = narrow + INNER_RADIUS, wide - OUTER_RADIUS  # y of the two centres
    reach = math.sqrt((INNER_RADIUS + OUTER_RADIUS) ** 2 - (low - high) ** 2)
    share = INNER_RADIUS / (INNER_RADIUS + OUTER_RADIUS)
    start, meet, tab = GAUGE / 2, GAUGE / 2 + share * reach, GAUGE / 2 + reach
    y = low - share * (low - high)
    bulge = math.tan(math.atan2(reach, low - high) / 4)
    right = [(start, -narrow, -bulge), (meet, -y, bulge), (tab, -wide, 0.0), (half, -wide, 0.0)]
    right += [(half, wide, 0.0), (tab, wide, bulge), (meet, y, -bulge), (start, narrow, 0.0)]
    left = [(-x, -y, bulge) for x, y, bulge in right]  # turned by 180 degrees
    return Profile(tuple(right + left))


def moulds(phantom: PhantomTable, printer: Printer) -> list[Body]:
    """Draw an open mould for each pour, its number engraved, as printed; none where no coupons are asked for.

    A mould's name has the layer's too, which the engraving's characters can't write.
    """
    if not phantom.coupons:
        return []
    return [
        Body(f"coupons{pour}-{layer.name}", "tool", "coupon", _mould(phantom.coupons, str(pour), printer), _COLOUR)
        for pour, layer in enumerate(reversed(phantom.layers), 1)
    ]


def volume_mm3(count: int) -> float:
    """Return what `count` coupons take."""
    return count * outline().area * THICKNESS


def _mould(count: int, text: str, printer: Printer) -> Shape:
    stroke, depth = float(printer.engraving_stroke_mm), float(printer.engraving_depth_mm)
    half_x = LENGTH / 2 + MARGIN
    width = count * TAB + (count - 1) * GAP + 2 * MARGIN
    top = FLOOR + THICKNESS
    plate = box(-half_x, half_x + _LABEL, 0.0, width, 0.0, top)
    middles = [MARGIN + TAB / 2 + i * (TAB + GAP) for i in range(count)]
    tools: list[Shape] = [moved(Extrude(outline(), FLOOR, top + 1.0), 0.0, y) for y in middles]
    tools.append(moved(engraving(text, stroke, top - depth, top + 1.0), half_x + 2.0, width / 2 - HEIGHT * stroke / 2))
    return cut(plate, tools)
