r"""The phantom's box: a tray with the stiff plate in it, a screed frame a further layer, lid, blade and stage holder.

        section, x to the right           peg
                                        .-.
          lid     =====================.' '.====   marks seat and points, last
          frame 3 ===.             .===.' '.====   skin: struck off along its top
          frame 2 ===|             |===.' '.====   hypodermis
                  .--'             '--.-----.
          tray    |  \   muscle    /  | ear |      struck off along the tray's own rim
                  |   |===plate===|   |     |      acrylic, z = 0 at its top
                  '---'--o-----o--'---'-----'      holes: the plate is pushed up through them

The cavity widens upwards, so the slab comes up with its plate. Layers are listed from the skin down and poured from the
last; frames have the number of their pour. The blade passes between the pegs and is drawn along y.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain, pairwise

from unitcad.catalogue import Printer
from unitcad.designs import layer_colour
from unitcad.errors import Refusal
from unitcad.lab.phantom.recipe import PhantomTable
from unitcad.moulds.pieces import bar
from unitcad.shape import Extrude, Profile, Shape, box, cut, cylinder, moved, rectangle, turned, union
from unitcad.shape.body import Body
from unitcad.shape.lettering import HEIGHT, engraving, text_width

POINT_RADIUS = 1.25
LEAST_APART = 2 * POINT_RADIUS + 1.0
"""Between two points, mm: the holes of nearer ones would leave no wall."""


def expect_apart(points_mm: Sequence[float]) -> None:
    """Raise Refusal for points whose holes in the lid would meet."""
    for one, other in pairwise(sorted(points_mm)):
        if other - one < LEAST_APART:
            limit = f"{one:g} and {other:g} are nearer than {LEAST_APART:g} mm: their holes in the lid would meet"
            raise Refusal("points_mm", list(points_mm), limit)


WALL, FLOOR, LID, HOLDER = 4.0, 3.0, 4.0, 6.0
"""Walls around the cavity at its rim, the tray's floor, thickness of lid and holder, mm."""
DRAFT_DEG = 1.0
EAR, EAR_HALF, EAR_AT = 14.0, 9.0, 0.65
"""Length of an ear, its half width, and its middle as a part of the half side, mm."""
PEG_RADIUS, PEG_FROM_WALL = 3.0, 8.0
PUSH_RADIUS = 8.0
PLATE_PLAY = 0.3
"""Of the plate in the tray, per side, mm."""
FENCE, FENCE_LONG, FENCE_HIGH = 4.0, 12.0, 10.0
_COLOURS = {
    "base": (0.76, 0.76, 0.76),
    "frame": (0.96, 0.83, 0.66),
    "lid": (0.55, 0.75, 0.55),
    "holder": (0.6, 0.66, 0.8),
}
_PLATE, _BLADE = (0.8, 0.9, 0.95), (0.90, 0.30, 0.30)


@dataclass(frozen=True)
class BoxLengths:
    """Lengths of a box, mm: half sides of the cavity at the plate and at the rim, of the walls, and the heights.

    `tops`: the height above the plate that each layer is struck off at, skin first.
    """

    inner: float
    rim: float
    outer: float
    tops: tuple[float, ...]
    plate: float
    hole: float
    peg_x: float
    ear_y: float

    @property
    def tray_rim(self) -> float:
        """Height of the tray's rim: the lowest layer's."""
        return self.tops[-1]

    @property
    def bottom(self) -> float:
        """Height of the tray's foot, below the plate."""
        return -self.plate - FLOOR


def lengths(phantom: PhantomTable, inside_mm: float, printer: Printer) -> BoxLengths:
    """Return the box's lengths for a cavity of `inside_mm` at the plate."""
    thickness = [layer.thickness_mm for layer in phantom.layers]
    tops = tuple(sum(thickness[i:]) for i in range(len(thickness)))
    rim = inside_mm / 2 + tops[-1] * math.tan(math.radians(DRAFT_DEG))
    outer = rim + WALL
    play = float(printer.plinth_clearance_mm) + 0.1
    return BoxLengths(
        inside_mm / 2,
        rim,
        outer,
        tops,
        phantom.plate_thickness_mm,
        PEG_RADIUS + play,
        outer + PEG_FROM_WALL,
        EAR_AT * outer,
    )


def cast(phantom: PhantomTable, size: BoxLengths) -> list[Body]:
    """Draw the cast layers, skin first."""
    bodies = []
    for i, layer in enumerate(phantom.layers):
        low = size.tops[i + 1] if i + 1 < len(size.tops) else 0.0
        shape: Shape = Extrude(_square(size.rim), low, size.tops[i])
        if low == 0.0:
            shape = Extrude(_square(size.inner), 0.0, size.tops[i], top=_square(size.rim))
        bodies.append(Body(layer.name, "unit", "layer", shape, layer_colour(i), made="cast", step=len(size.tops) - i))
    return bodies


def pieces(phantom: PhantomTable, size: BoxLengths, printer: Printer) -> list[Body]:
    """Draw tray, plate, frames (skin first, each with its pour's number), lid, blade and holder as assembled."""
    stroke, depth = float(printer.engraving_stroke_mm), float(printer.engraving_depth_mm)
    frames = [
        Body(
            f"frame{len(size.tops) - i}",
            "tool",
            "frame",
            _frame(size, size.tops[i + 1], size.tops[i], str(len(size.tops) - i), stroke, depth),
            _COLOURS["frame"],
            step=len(size.tops) - i,
        )
        for i in range(len(size.tops) - 1)
    ]
    blade = moved(turned(bar(size.outer + PEG_FROM_WALL - PEG_RADIUS - 1.0, 0.0), "z", 1), 0, 0, size.tray_rim)
    plate = Extrude(_square(size.inner - PLATE_PLAY), -size.plate, 0.0)
    return [
        Body("tray", "tool", "base", _tray(size), _COLOURS["base"]),
        Body("plate", "tool", "holder", plate, _PLATE, made="cut"),
        *frames,
        Body("lid", "tool", "lid", _lid(phantom, size), _COLOURS["lid"]),
        Body("blade", "tool", "blade", blade, _BLADE, upside_down=True),
        Body("holder", "tool", "holder", _holder(phantom, size), _COLOURS["holder"]),
    ]


def _square(half: float) -> Profile:
    return rectangle(-half, -half, half, half)


def _at_corners(shape: Shape, x: float, y: float) -> list[Shape]:
    return [moved(shape, sx * x, sy * y) for sx in (-1, 1) for sy in (-1, 1)]


def _tray(size: BoxLengths) -> Shape:
    # The taper runs on above the rim, so that no face of the tool is in the rim's plane.
    beyond = 1.0
    wide = size.rim + beyond * (size.rim - size.inner) / size.tray_rim
    cavity = Extrude(_square(size.inner), 0.0, size.tray_rim + beyond, top=_square(wide))
    pocket = Extrude(_square(size.inner), -size.plate, 0.5)
    hole = cylinder(PUSH_RADIUS, size.bottom - 1.0, -size.plate + 1.0)
    holes = _at_corners(hole, 0.6 * size.inner, 0.6 * size.inner)
    pegs = _at_corners(cylinder(PEG_RADIUS, size.tray_rim - 1.0, size.tops[0] + LID), size.peg_x, size.ear_y)
    return union((cut(_outline(size, size.bottom, size.tray_rim), [cavity, pocket, *holes]), *pegs))


def _frame(size: BoxLengths, low: float, high: float, number: str, stroke: float, depth: float) -> Shape:
    """Draw a frame; its pour's number is engraved on an ear, beyond the peg, out of the blade's way."""
    y = size.ear_y + (size.hole + EAR_HALF - HEIGHT * stroke) / 2
    depth = min(depth, (high - low) / 2)
    figure = moved(engraving(number, stroke, high - depth, high + 1.0), size.peg_x - text_width(number, stroke) / 2, y)
    opening = Extrude(_square(size.rim), low - 1.0, high + 1.0)
    return cut(_outline(size, low, high), [opening, figure, *_peg_holes(size, low, high)])


def _outline(size: BoxLengths, low: float, high: float) -> Shape:
    half = EAR / 2 + 1.0
    ear = box(-half, half, -EAR_HALF, EAR_HALF, low, high)
    return union((Extrude(_square(size.outer), low, high), *_at_corners(ear, size.outer + half - 2.0, size.ear_y)))


def _peg_holes(size: BoxLengths, low: float, high: float) -> list[Shape]:
    return _at_corners(cylinder(size.hole, low - 1.0, high + 1.0), size.peg_x, size.ear_y)


def _lid(phantom: PhantomTable, size: BoxLengths) -> Shape:
    """Draw the lid with the unit's seat and a hole at each point, all from its middle along x."""
    low, high = size.tops[0], size.tops[0] + LID
    seat = phantom.unit_diameter_mm / 2
    points = [moved(cylinder(POINT_RADIUS, low - 1.0, high + 1.0), seat + one, 0.0) for one in phantom.points_mm]
    seat_hole = cylinder(seat, low - 1.0, high + 1.0)
    return cut(_outline(size, low, high), [seat_hole, *points, *_peg_holes(size, low, high)])


def _holder(phantom: PhantomTable, size: BoxLengths) -> Shape:
    """Draw the plate that fixes the tray on a table with threaded holes: fences at its corners, four bolt holes."""
    low, high = size.bottom - HOLDER, size.bottom
    x_bolt, y_bolt = bolts(phantom, size)
    face, beside = size.outer + 0.3, phantom.stage_bolt_mm + 4.0
    half_x, half_y = max(face + FENCE, x_bolt + beside), y_bolt + beside
    half, middle = (FENCE + FENCE_LONG) / 2, face + (FENCE - FENCE_LONG) / 2
    along = box(-half, half, -FENCE / 2, FENCE / 2, high - 1.0, high + FENCE_HIGH)
    across = box(-FENCE / 2, FENCE / 2, -half, half, high - 1.0, high + FENCE_HIGH)
    fences = zip(
        _at_corners(along, middle, face + FENCE / 2), _at_corners(across, face + FENCE / 2, middle), strict=True
    )
    solids = [box(-half_x, half_x, -half_y, half_y, low, high), *chain.from_iterable(fences)]
    window = Extrude(_square(0.75 * size.inner), low - 1.0, high + 1.0)
    hole = cylinder(phantom.stage_bolt_mm / 2 + 0.3, low - 1.0, high + 1.0)
    return cut(union(solids), [window, *_at_corners(hole, x_bolt, y_bolt)])


def bolts(phantom: PhantomTable, size: BoxLengths) -> tuple[float, float]:
    """Return x and y of the holder's bolt holes: on the table's pitch, beyond the fences along y."""
    half = phantom.stage_pitch_mm / 2
    needed = size.outer + 0.3 + FENCE + phantom.stage_bolt_mm + 1.0
    across = math.floor(0.8 * size.outer / half)
    return max(across, 1) * half, math.ceil(needed / half) * half
