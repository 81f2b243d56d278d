"""A fit coupon: printed first, it shows the clearances that the printer needs.

Five stations at 0.5 to 1.5 times the catalogue's value. At each: a recess for the plug (the plinth's fit), a window for
the tongue, a recess with ribs as a cup's, a hole for the filament, a wall, and the station's own number, engraved. A
printer without ribs has no such row.

      y
      |  [1]  [2]  [3]  [4]  [5]   engraving
      |   |    |    |    |    |    walls, standing
      |   o    o    o    o    o    filament holes
      | <[ ]><[ ]><[ ]><[ ]><[ ]>  ribbed recesses, each in a boss of the size of the plug's handle
      |  [ ]  [ ]  [ ]  [ ]  [ ]   recesses
      '==  ==   ==   ==   ==  ==   windows, in the front face
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from manifold3d import Manifold

from unitcad import files
from unitcad.catalogue import Printer
from unitcad.designs.limits import LEAF_WIDTH, farthest_push, leaf_mm, least_skirt
from unitcad.export import printing
from unitcad.export.printing import print_ready
from unitcad.kernels.mesh import arrays, realise
from unitcad.moulds.cup import ROOT, SLOPE, SQUARE, drawn, leaf_slots, place_ribs
from unitcad.shape import Extrude, Profile, Shape, box, cut, cylinder, moved, rounded_rectangle, turned, union
from unitcad.shape.lettering import HEIGHT, engraving, text_width
from unitcad.shape.tree import Body
from unitcad.text import number

SHARES = (0.5, 0.75, 1.0, 1.25, 1.5)
"""Of the catalogue's value, station by station."""
CORNER = 1.0
"""Radius of the plug's corners, mm."""
RELIEF = 0.5
"""Of a recess below the plug's top: the plug's handle bears, as a cup's seat does."""
PLATE, MARGIN = 6.0, 4.0
WINDOW_DEPTH, WINDOW_Z = 6.0, 2.0
TAIL_WIDTH, WALL_LENGTH, WALL_HEIGHT, FILAMENT = 3.0, 8.0, 5.0, 1.75
SEGMENTS = 64
_ROWS = {"recess": 13.0, "ribs": 30.0, "hole": 22.0, "wall": 28.0, "number": 35.0}
JAWS = 4.0
"""Between two plugs' handles, for a caliper's jaws, mm."""


@dataclass(frozen=True)
class Fit:
    """One feature of the coupon: the printer's key that it settles, the choice, the value of each station (mm)."""

    feature: str
    key: str
    choose: str
    values_mm: tuple[float, ...]

    def toml(self, station: int) -> str:
        """Return the line of TOML for a station (from 0), under [printers.NAME] with like = the printer."""
        return f"{self.key} = {self.values_mm[station]:g}"


class Coupon:
    """The coupon of a printer: its sizes in mm, its pieces and its page.

    `plug` is the half side of the plug at its top, `height` its taper's; `handle` the half side of its handle and of
    the boss round a ribbed recess, which is `boss` high. Leaves under the ribs need a deeper recess and longer faces.
    `windows` are lower and upper edge of each station's window, above the bed: whole layers, outwards.
    """

    def __init__(self, printer: Printer) -> None:
        self.printer, self.resin = printer, printer.technology.value == "sla"
        self.clearance, self.layer = float(printer.plinth_clearance_mm), float(printer.layer_mm)
        self.thick, self.wide = float(printer.slot_height_mm), TAIL_WIDTH + float(printer.slot_width_clearance_mm)
        depth = float(printer.rib_interference_mm or 0.0)
        self.ribbed, self.leaf = depth > 0, leaf_mm(printer)
        self.plug, self.height, self.handle, self.boss = 4.0, 2.0, 6.0, 3.0
        if self.leaf and self.ribbed:
            push = farthest_push(SHARES[-1] * depth, float(printer.xy_play_mm), self.clearance)
            self.height = _half_up(least_skirt(self.leaf, push))
            self.plug = _half_up(CORNER + LEAF_WIDTH + 2 * self.leaf)
            around = self.height * SLOPE + self.clearance + 2 * self.leaf + float(printer.least_wall_mm)
            self.handle, self.boss = _half_up(self.plug + around), self.height + 1.0
        self.pitch = 2 * self.handle + JAWS
        bears = "until it sits, no leaf cracked" if self.leaf else "until it sits"
        rows = (
            ("recess", "plinth_clearance_mm", "smallest in which the plug drops in"),
            ("ribs", "rib_interference_mm", f"largest through which you can press the plug by hand {bears}"),
            ("window", "window_clearance_mm", "smallest in which the greased tongue slides"),
            ("hole", "filament_hole_mm", "smallest that takes the filament by hand"),
            ("wall", "least_wall_mm", "thinnest that is closed and stiff"),
            ("number", "engraving_stroke_mm", "narrowest that you can read"),
        )
        self.fits: dict[str, Fit] = {}
        for feature, key, choose in rows:
            if feature != "ribs" or self.ribbed:
                nominal, least = float(getattr(printer, key) or 0.0), FILAMENT if feature == "hole" else 0.0
                values = tuple(round(least + (nominal - least) * share, 4) for share in SHARES)
                self.fits[feature] = Fit(feature, key, choose, values)
        self.windows = [
            (
                math.floor((WINDOW_Z - each) / self.layer + 1e-6) * self.layer,
                math.ceil((WINDOW_Z + self.thick + each) / self.layer - 1e-6) * self.layer,
            )
            for each in self.fits["window"].values_mm
        ]

    def x(self, station: int) -> float:
        """Return x of a station (from 0)."""
        return MARGIN + self.pitch * (station + 0.5)

    def y(self, feature: str) -> float:
        """Return y of a feature's stations."""
        behind = self.ribbed and feature not in ("recess", "ribs")
        return _ROWS[feature] + (2 * self.handle + 6.0 if behind else 0.0)

    def bodies(self) -> tuple[Body, ...]:
        """Draw the pieces as placed on the bed: the plate, the plug (a plinth on a handle) and the tongue."""
        half = self.handle
        taper = moved(turned(self._taper(0.0), "x", 2), 0, 0, 4 + self.height)
        plug = union((box(-half, half, -half, half, 0, 4), taper))
        half = self.wide / 2
        grip = box(-half - 3, half + 3, 19, 27, 0, self.thick)
        tongue = union((box(-half, half, 0, 20, 0, self.thick), grip))
        return (
            Body("coupon-plate", "tool", "coupon", self._plate(), (0.76, 0.76, 0.76)),
            Body("coupon-plug", "tool", "coupon", plug, (0.96, 0.83, 0.66)),
            Body(
                "coupon-tongue",
                "tool",
                "coupon",
                tongue,
                (0.90, 0.30, 0.30),
                made="cut" if self.resin else "printed",
            ),
        )

    def markdown(self) -> str:
        """Explain how to read the coupon, with the line of TOML for every station."""
        name, fits = self.printer.name, self.fits.values()
        lines = [
            f"# Fit coupon for {name}",
            "",
            f"Print {'plate and plug' if self.resin else 'plate, plug and tongue'} as they lie. At every feature",
            "choose one of the five stations and copy its line into your spec. Station 3 has the catalogue's value.",
            "",
        ]
        if self.resin:
            lines += [
                f"The tongue has no file: cut a strip {number(self.wide, 3)} mm wide and 25 mm long from film or steel",
                f"{number(self.thick, 3)} mm thick, as for the moulds' tongues; printed resin is brittle.",
                "",
            ]
        lines += ["```toml", "[moulds]", 'printer = "mine"', "", "[printers.mine]", f'like = "{name}"']
        lines += [*(fit.toml(2) for fit in fits), "```", ""]
        lines += ["| feature | choose the | 1 | 2 | 3 | 4 | 5 |", "| --- | --- | --- | --- | --- | --- | --- |"]
        for fit in fits:
            cells = " | ".join(f"`{fit.toml(i)}`" for i in range(len(SHARES)))
            lines.append(f"| {fit.feature} | {fit.choose} | {cells} |")
        if self.ribbed:
            once = "the leaves under the ribs spring back" if self.leaf else "a rib is crushed only once"
            lines += [
                "",
                f"Ribs: press the plug into each station until its handle touches the boss; {once}.",
                "Then measure across handle and boss together, along x and along y. The excess over the handle is the",
                f"plug's offset from the middle; without ribs it is up to {number(self.clearance, 3)} mm.",
            ]
        heights = [number(high - low, 3) for low, high in self.windows]
        every = f"{', '.join(heights)} mm from 1 to 5" if len({*heights}) > 1 else f"{heights[0]} mm at every station"
        lines += [
            "",
            f"Windows begin and end with whole layers of {number(self.layer, 3)} mm: the height is",
            f"{every}. Stations of one height differ only in width. A cup's layers count from its",
            "rim, so its window is as high as that of station 3, or one layer higher.",
        ]
        return "\n".join(lines) + "\n"

    def _plate(self) -> Shape:
        values = {feature: fit.values_mm for feature, fit in self.fits.items()}
        depth = self.y("number") + HEIGHT * values["number"][-1] / 2 + MARGIN
        solids: list[Shape] = [box(0, self.pitch * len(SHARES) + 2 * MARGIN, 0, depth, 0, PLATE)]
        tools: list[Shape] = []
        for i in range(len(SHARES)):
            x, top, half = self.x(i), PLATE + self.boss, self.handle
            recess = self._taper(values["recess"][i], RELIEF, 0.25)
            tools.append(moved(recess, x, self.y("recess"), PLATE - self.height))
            tools.append(moved(cylinder(values["hole"][i] / 2, -1, PLATE + 1), x, self.y("hole")))
            if self.ribbed:
                y = self.y("ribs")
                solids.append(box(x - half, x + half, y - half, y + half, PLATE - 1, top))
                tools.append(moved(self._ribbed_recess(values["ribs"][i]), x, y, top - self.height))
            half = self.wide / 2 + values["window"][i]
            tools.append(box(x - half, x + half, -1, WINDOW_DEPTH, *self.windows[i]))
            half, y, long = values["wall"][i] / 2, self.y("wall"), WALL_LENGTH / 2
            solids.append(box(x - long, x + long, y - half, y + half, PLATE - 1, PLATE + WALL_HEIGHT))
            stroke, text = values["number"][i], str(i + 1)
            drawing = engraving(text, stroke, PLATE - float(self.printer.engraving_depth_mm), PLATE + 1)
            tools.append(moved(drawing, x - text_width(text, stroke) / 2, self.y("number") - HEIGHT * stroke / 2))
        return cut(union(solids), tools)

    def _taper(self, clearance: float, relief: float = 0.0, beyond: float = 0.0) -> Shape:
        """Draw the plug's taper upside down, its top at z = 0, wider by `clearance` all round, longer by `relief`."""

        def section(height: float) -> Profile:
            grow = clearance * SQUARE + height * SLOPE
            return rounded_rectangle(self.plug + grow, self.plug + grow, CORNER + grow)

        high = self.height + beyond
        return Extrude(section(-relief), -relief, high, top=section(high))

    def _ribbed_recess(self, interference: float) -> Shape:
        """Draw a recess of the catalogue's clearance less its ribs, with their leaves' slots; its mouth is at `height`.

        As in a cup, ribs and slots are drawn mouth downwards.
        """
        clearance, crest, half = self.clearance, float(self.printer.least_feature_mm), (self.plug, self.plug)
        standing = place_ribs(half, CORNER, -self.height, clearance, interference, crest, self.leaf)
        drawings = drawn(standing, clearance, interference, crest, self.leaf / 2 or ROOT)
        room = cut(self._taper(clearance, RELIEF, 0.25), [turned(shape, "x", 2) for shape in drawings])
        return union((room, *(turned(slot, "x", 2) for slot in leaf_slots(standing, clearance, self.leaf))))


def write(printer: Printer, out: Path) -> Path:
    """Write `out`/coupon-<printer>; return that folder. Raises OSError if it can't be written."""
    folder, coupon = out / f"coupon-{printer.name}", Coupon(printer)
    folder.mkdir(parents=True, exist_ok=True)
    printed = [body for body in coupon.bodies() if body.made == "printed"]
    parts = write_pieces(folder, ((body, realise(body.shape, SEGMENTS)) for body in printed))
    bed = float(printer.bed_x_mm), float(printer.bed_y_mm)
    files.write(folder / "coupon.3mf", printing.content(parts, bed))
    files.write(folder / "coupon.md", coupon.markdown().encode())
    return folder


def write_pieces(folder: Path, pieces: Iterable[tuple[Body, Manifold]]) -> list[printing.MeshPart]:
    """Write an STL of each piece as it is printed; return the parts of their plate. Raises OSError."""
    parts = []
    for body, mesh in pieces:
        ready = print_ready(*arrays(mesh), body.upside_down)
        files.write(folder / f"{body.name}.stl", printing.stl(*ready, body.name))
        parts.append(printing.MeshPart(body.name, body.colour, *ready))
    return parts


def _half_up(length: float) -> float:
    """Return the next half millimetre beyond a length."""
    return math.floor(2 * length + 1) / 2
