r"""Ribs centre a cup on its plinth. Each face of its recess has two, level with those opposite.

      plan, from above                  section of a rib
    .--v-----------v--.                      seat
    |  .---------.    |              |  .-----------     z = 0
    |> | plinth   \  <|              | |
    |  |           |  |              |  \    <- roof
    |> |           | <|              |   |
    |  '-----------'  |              |   |   <- crest: reaches into the plinth by the interference
    '--^-----------^--'              |  /    <- lead-in, down to the skirt's end

The plinth is tapered, so a rib meets it only when the cup is nearly down, along its whole crest at once. Opposite ribs
are crushed alike, which leaves the cup in the middle; pairs hold it against turning too. They are as far from the axes
as the cut corner permits: for leverage, and clear of tails, which leave along x.

Ribs of resin would chip. Each is low on a leaf of the skirt, which a slot from below frees behind and on both sides;
the leaf bends, and nothing is crushed:

      plan of a face, from above
    ----.  .---.  .----
    wall|  |   |  |wall      slot, open downwards
        |  '---'  |
        |  leaf   |          its thickness and the slot's width: the printer's least wall
    ----'----v----'----      recess
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

from unitcad.designs.parts import BEYOND
from unitcad.designs.rib_leaves import CREST, LEAF_WIDTH, leaf_mm
from unitcad.designs.tooling import Layout
from unitcad.moulds.layout import CORNER_RADIUS, PLINTH_DRAFT_DEG
from unitcad.shape import Extrude, Profile, Shape, box, polygon, union
from unitcad.shape.profile import mm
from unitcad.spec import Spec, printer_of

ROOF = 1.5
"""Height of a crest's upper ramp over its overhang: steep enough to be printed, upside down, without support."""
ROOT = 0.5
"""How deep a rib's drawing reaches into the wall behind it, mm; half a thinner wall."""
AROUND = 0.05
"""Margin of the box round a rib, mm."""
SLOPE = math.tan(math.radians(PLINTH_DRAFT_DEG))
SQUARE = 1 / math.cos(math.radians(PLINTH_DRAFT_DEG))
"""A length square to the plinth's faces, measured level, over itself."""


@dataclass(frozen=True)
class Rib:
    """A rib: its place on the plinth's upper edge (x, y, mm), and its direction, inwards.

    `bottom` and `top` are those of the crest, `foot` and `head` of the whole rib (z, mm).
    """

    x: float
    y: float
    inwards: tuple[int, int]
    foot: float
    bottom: float
    top: float
    head: float


def ribs(spec: Spec, lay: Layout) -> tuple[Rib, ...]:
    """Return the ribs of every cup of a set; () if the spec sets none, or the plinth's faces are too short."""
    moulds = spec.moulds
    crest = float(printer_of(spec).least_feature_mm)
    end = -moulds.plinth_height_mm + moulds.seat_relief_mm
    corner = max(lay.key, CORNER_RADIUS)
    leaf = leaf_mm(printer_of(spec))
    return placed(lay.plinth, corner, end, moulds.plinth_clearance_mm, moulds.rib_interference_mm, crest, leaf)


@lru_cache(maxsize=16)
def placed(
    half: tuple[float, float],
    corner: float,
    end: float,
    clearance: float,
    interference: float,
    crest: float,
    leaf: float = 0.0,
) -> tuple[Rib, ...]:
    """Return the ribs round a plinth of half sizes `half` at z = 0 whose cup's skirt ends at z = `end`, mm.

    `corner` is the length of a face that a corner takes; () if the corners leave no room. `leaf`: the thickness of the
    leaf under a rib, 0 for the wall itself.
    """
    proud, skirt = (clearance + interference) * SQUARE, -end
    beside = LEAF_WIDTH / 2 + leaf if leaf else crest / 2 + proud + ROOT
    ramp, roof, head = min(proud, skirt / 4), min(ROOF * proud, skirt / 4), -skirt / 5
    if leaf:
        ramp, roof, head = min(ramp, CREST / 4), min(roof, CREST / 2), end + CREST
    x, y = (size - corner - beside for size in half)
    if not interference or min(x, y) <= beside:
        return ()
    places = [((side * half[0], at), (-side, 0)) for side in (1, -1) for at in (y, -y)]
    places += [((at, side * half[1]), (0, -side)) for side in (1, -1) for at in (x, -x)]
    return tuple(Rib(*at, inwards, end, end + ramp, head - roof, head) for at, inwards in places)


def drawn(
    standing: tuple[Rib, ...], clearance: float, interference: float, crest: float, root: float = ROOT
) -> list[Shape]:
    """Draw ribs: a crest as wide as a printed line, flanks of 45 degrees, and a ramp at either end."""
    tip, back = mm(interference * SQUARE), mm(-clearance * SQUARE - root)
    reach = mm(crest / 2) + tip
    shapes: list[Shape] = []
    for rib in standing:
        heights = (rib.foot, rib.bottom, rib.top, rib.head)
        # At foot and head the tip is within the wall.
        tips = (back + mm(root / 2), tip, tip, back + mm(root / 2))
        sections = [_section(rib, at, back, reach, z) for at, z in zip(tips, heights, strict=True)]
        shapes += [Extrude(sections[i], heights[i], heights[i + 1], top=sections[i + 1]) for i in range(3)]
    return shapes


def _section(rib: Rib, tip: float, back: float, reach: float, z: float) -> Profile:
    """Draw a rib's section at z: its tip and its back are so far inwards of the plinth's face there.

    Its flanks would meet at `reach`. All lengths are on the grid, so that flanks are planes at exactly 45 degrees.
    """
    (nx, ny), face = rib.inwards, mm(z * SLOPE)
    corners = ((tip, tip - reach), (tip, reach - tip), (back, reach - back), (back, back - reach))
    x, y = mm(rib.x), mm(rib.y)
    return polygon(*((x + nx * (d + face) - ny * t, y + ny * (d + face) + nx * t) for d, t in corners))


def leaf_slots(standing: tuple[Rib, ...], clearance: float, leaf: float, top: float = 0.0) -> list[Shape]:
    """Draw the slots that free a leaf of thickness `leaf` behind each rib, up to z = `top`; none without leaves."""
    if not leaf:
        return []
    face, side, shapes = -clearance * SQUARE, LEAF_WIDTH / 2, []
    back, behind = face - leaf * SQUARE, face - 2 * leaf * SQUARE
    for rib in standing:
        low = rib.foot - BEYOND
        for near, far, t0, t1 in (
            (back, behind, -side - leaf, side + leaf),
            (face + BEYOND, behind, -side - leaf, -side),
            (face + BEYOND, behind, side, side + leaf),
        ):
            lower, upper = (_strip(rib, near, far, t0, t1, z) for z in (low, top))
            shapes.append(Extrude(lower, low, top, top=upper))
    return shapes


def _strip(rib: Rib, near: float, far: float, t0: float, t1: float, z: float) -> Profile:
    """Draw a strip along a rib's face at z, `near` to `far` inwards of the plinth, `t0` to `t1` along it."""
    (nx, ny), face = rib.inwards, z * SLOPE
    corners = ((near, t0), (near, t1), (far, t1), (far, t0))
    return polygon(*((rib.x + nx * (d + face) - ny * t, rib.y + ny * (d + face) + nx * t) for d, t in corners))


def slot_shapes(spec: Spec, lay: Layout) -> list[Shape]:
    """Draw the slots round the leaves of every cup of a set; none if its ribs are on the wall itself."""
    slots = leaf_slots(ribs(spec, lay), spec.moulds.plinth_clearance_mm, leaf_mm(printer_of(spec)))
    return [union(slots)] if slots else []


def rib_shapes(spec: Spec, lay: Layout) -> list[Shape]:
    """Draw the ribs of every cup of a set, reaching into plinth and wall."""
    moulds = spec.moulds
    root = min(ROOT, moulds.skirt_wall_mm / 2, (leaf_mm(printer_of(spec)) or moulds.skirt_wall_mm) / 2)
    crest = float(printer_of(spec).least_feature_mm)
    return drawn(ribs(spec, lay), moulds.plinth_clearance_mm, moulds.rib_interference_mm, crest, root)


def rib_spaces(spec: Spec, lay: Layout) -> list[Shape]:
    """Draw a box round each rib, from behind its wall to before its tip: a check of other faces ignores it."""
    moulds = spec.moulds
    before = moulds.rib_interference_mm * SQUARE + AROUND
    behind = moulds.plinth_clearance_mm * SQUARE + AROUND
    half = float(printer_of(spec).least_feature_mm) / 2 + before + behind
    boxes = []
    for rib in ribs(spec, lay):
        (nx, ny), near, far = rib.inwards, rib.head * SLOPE + before, rib.foot * SLOPE - behind
        x, y = zip(
            *((rib.x + nx * d - ny * t, rib.y + ny * d + nx * t) for d, t in ((near, half), (far, -half))), strict=True
        )
        boxes.append(box(min(x), max(x), min(y), max(y), rib.foot - AROUND, rib.head + AROUND))
    return boxes
