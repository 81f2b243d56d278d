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
from dataclasses import dataclass

from unitcad.catalogue import Printer
from unitcad.designs.rib_leaves import LEAF_WIDTH, farthest_push, leaf_mm, least_skirt
from unitcad.moulds.ribs import ROOT, SLOPE, SQUARE, drawn, leaf_slots, placed
from unitcad.shape import Extrude, Profile, Shape, box, cut, cylinder, moved, rounded_rectangle, turned, union
from unitcad.shape.body import Body
from unitcad.shape.lettering import HEIGHT, engraving, text_width
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
_COLOUR, _PLUG_COLOUR, _TONGUE_COLOUR = (0.76, 0.76, 0.76), (0.96, 0.83, 0.66), (0.90, 0.30, 0.30)
_ROWS = {"recess": 13.0, "ribs": 30.0, "hole": 22.0, "wall": 28.0, "number": 35.0}
JAWS = 4.0
"""Between two plugs' handles, for a caliper's jaws, mm."""


@dataclass(frozen=True)
class Sizes:
    """What follows from the ribs' kind, mm: leaves under them need a deeper recess and longer faces.

    `plug` is the half side of the plug at its top, `height` its taper's; `handle` the half side of its handle and of
    the boss round a ribbed recess, which is `boss` high.
    """

    plug: float = 4.0
    height: float = 2.0
    handle: float = 6.0
    boss: float = 3.0

    @property
    def pitch(self) -> float:
        """Between two stations, mm."""
        return 2 * self.handle + JAWS


def sizes(printer: Printer) -> Sizes:
    """Return the sizes of the plug, and of what it goes into."""
    leaf = leaf_mm(printer)
    if not leaf or not _ribbed(printer):
        return Sizes()
    deepest, clearance = SHARES[-1] * float(printer.rib_interference_mm or 0.0), float(printer.plinth_clearance_mm)
    height = _half_up(least_skirt(leaf, farthest_push(deepest, float(printer.xy_play_mm), clearance)))
    plug = _half_up(CORNER + LEAF_WIDTH + 2 * leaf)
    handle = _half_up(plug + height * SLOPE + clearance + 2 * leaf + float(printer.least_wall_mm))
    return Sizes(plug, height, handle, height + 1.0)


def _half_up(length: float) -> float:
    """Return the next half millimetre beyond a length."""
    return math.floor(2 * length + 1) / 2


@dataclass(frozen=True)
class Fit:
    """One feature of the coupon: the printer's key that it settles, what to choose, the value of each station (mm)."""

    feature: str
    key: str
    choose: str
    values_mm: tuple[float, ...]

    def toml(self, station: int) -> str:
        """Return the line of TOML for a station (from 0), to stand under [printers.NAME] with like = the printer."""
        return f"{self.key} = {self.values_mm[station]:g}"


def fits(printer: Printer) -> tuple[Fit, ...]:
    """Return what the coupon settles, with the five values of each."""

    def fit(feature: str, key: str, choose: str, least: float = 0.0) -> Fit:
        nominal = float(getattr(printer, key) or 0.0)
        return Fit(feature, key, choose, tuple(round(least + (nominal - least) * share, 4) for share in SHARES))

    bears = "until it sits, no leaf cracked" if leaf_mm(printer) else "until it sits"
    ribs = fit("ribs", "rib_interference_mm", f"most that the plug is pressed through by hand {bears}")
    return (
        fit("recess", "plinth_clearance_mm", "least where the plug drops in"),
        *([ribs] if _ribbed(printer) else []),
        fit("window", "window_clearance_mm", "least where the greased tongue slides"),
        fit("hole", "filament_hole_mm", "least that takes the filament by hand", FILAMENT),
        fit("wall", "least_wall_mm", "thinnest that stands closed and stiff"),
        fit("number", "engraving_stroke_mm", "narrowest that reads"),
    )


def bodies(printer: Printer) -> tuple[Body, ...]:
    """Draw the coupon's pieces as they lie on the bed: the plate, the plug and the tongue."""
    made = "cut" if _resin(printer) else "printed"
    return (
        Body("coupon-plate", "tool", "coupon", _plate(printer), _COLOUR),
        Body("coupon-plug", "tool", "coupon", _plug(sizes(printer)), _PLUG_COLOUR),
        Body("coupon-tongue", "tool", "coupon", _tongue(printer), _TONGUE_COLOUR, made=made),
    )


def to_markdown(printer: Printer) -> str:
    """Explain how to read the coupon, with the line of TOML for every station."""
    thick, wide = float(printer.slot_height_mm), _tongue_width(printer)
    pieces = "plate and plug" if _resin(printer) else "plate, plug and tongue"
    lines = [
        f"# Fit coupon for {printer.name}",
        "",
        f"Print {pieces} as they lie. At every feature choose one of the five stations and put its line",
        "into your spec. Station 3 is the catalogue's value.",
        "",
    ]
    if _resin(printer):
        lines += [
            f"The tongue is no file: cut a strip {number(wide, 3)} wide and 25 long from film or steel",
            f"{number(thick, 3)} mm thick, as the moulds' tongues are; printed resin is brittle.",
            "",
        ]
    lines += [
        "```toml",
        "[moulds]",
        'printer = "mine"',
        "",
        "[printers.mine]",
        f'like = "{printer.name}"',
        *(fit.toml(2) for fit in fits(printer)),
        "```",
        "",
        "| feature | choose the | 1 | 2 | 3 | 4 | 5 |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for fit in fits(printer):
        cells = " | ".join(f"`{fit.toml(i)}`" for i in range(len(SHARES)))
        lines.append(f"| {fit.feature} | {fit.choose} | {cells} |")
    if _ribbed(printer):
        play = number(float(printer.plinth_clearance_mm), 3)
        lines += [
            "",
            f"Ribs: press the plug into each station until its handle lies on the boss; {_once(printer)}.",
            "Then measure across handle and boss together, along x and along y. What exceeds the handle alone is how",
            f"far the plug stands off the middle; without ribs up to {play} mm.",
        ]
    heights = [number(high - low, 3) for low, high in _windows(printer)]
    every = f"{heights[0]} mm at every station" if len(set(heights)) == 1 else f"{', '.join(heights)} mm from 1 to 5"
    lines += [
        "",
        f"A window's lower and upper edge end whole layers of {number(float(printer.layer_mm), 3)} mm: its height is",
        f"{every}. Stations of one height differ in width only. A cup's layers count from its",
        "rim, so its window is as high as station 3's or one layer higher, never lower.",
    ]
    return "\n".join(lines) + "\n"


def _once(printer: Printer) -> str:
    return "the leaves under the ribs spring back" if leaf_mm(printer) else "a rib is crushed once only"


def _windows(printer: Printer) -> list[tuple[float, float]]:
    """Return lower and upper edge of each station's window, mm above the bed: whole layers, outwards."""
    around = next(fit.values_mm for fit in fits(printer) if fit.feature == "window")
    layer, thick = float(printer.layer_mm), float(printer.slot_height_mm)
    return [
        (
            math.floor((WINDOW_Z - each) / layer + 1e-6) * layer,
            math.ceil((WINDOW_Z + thick + each) / layer - 1e-6) * layer,
        )
        for each in around
    ]


def _resin(printer: Printer) -> bool:
    return printer.technology.value == "sla"


def _plate(printer: Printer) -> Shape:
    stroke = float(printer.engraving_stroke_mm)
    made = sizes(printer)
    length = made.pitch * len(SHARES) + 2 * MARGIN
    depth = row(printer, "number") + HEIGHT * stroke * SHARES[-1] / 2 + MARGIN
    solids: list[Shape] = [box(0, length, 0, depth, 0, PLATE)]
    tools: list[Shape] = []
    by_feature, windows = {fit.feature: fit.values_mm for fit in fits(printer)}, _windows(printer)
    for i in range(len(SHARES)):
        x = station_x(printer, i)
        recess = _taper(made, by_feature["recess"][i], RELIEF, 0.25)
        tools.append(moved(recess, x, row(printer, "recess"), PLATE - made.height))
        tools.append(moved(cylinder(by_feature["hole"][i] / 2, -1, PLATE + 1), x, row(printer, "hole")))
        if "ribs" in by_feature:
            y, half, top = row(printer, "ribs"), made.handle, PLATE + made.boss
            solids.append(box(x - half, x + half, y - half, y + half, PLATE - 1, top))
            tools.append(moved(_ribbed_recess(printer, made, by_feature["ribs"][i]), x, y, top - made.height))
        half = _tongue_width(printer) / 2 + by_feature["window"][i]
        tools.append(box(x - half, x + half, -1, WINDOW_DEPTH, *windows[i]))
        wall = by_feature["wall"][i] / 2
        y = row(printer, "wall")
        solids.append(box(x - WALL_LENGTH / 2, x + WALL_LENGTH / 2, y - wall, y + wall, PLATE - 1, PLATE + WALL_HEIGHT))
        own, text = by_feature["number"][i], str(i + 1)
        number = engraving(text, own, PLATE - float(printer.engraving_depth_mm), PLATE + 1)
        tools.append(moved(number, x - text_width(text, own) / 2, row(printer, "number") - HEIGHT * own / 2))
    return cut(union(solids), tools)


def _taper(made: Sizes, clearance: float, relief: float = 0.0, beyond: float = 0.0) -> Shape:
    """Draw the plug's taper upside down, its top at z = 0, wider by `clearance` all round, longer by `relief` below."""

    def section(height: float) -> Profile:
        grow = clearance * SQUARE + height * SLOPE
        return rounded_rectangle(made.plug + grow, made.plug + grow, CORNER + grow)

    high = made.height + beyond
    return Extrude(section(-relief), -relief, high, top=section(high))


def _ribbed_recess(printer: Printer, made: Sizes, interference: float) -> Shape:
    """Draw a recess of the catalogue's clearance less its ribs, with their leaves' slots; its mouth is at z = `height`.

    As in a cup, ribs and slots are drawn mouth downwards.
    """
    clearance, crest, leaf = float(printer.plinth_clearance_mm), float(printer.least_feature_mm), leaf_mm(printer)
    half = made.plug, made.plug
    standing = placed(half, CORNER, -made.height, clearance, interference, crest, leaf)
    drawings = drawn(standing, clearance, interference, crest, leaf / 2 or ROOT)
    room = cut(_taper(made, clearance, RELIEF, 0.25), [turned(shape, "x", 2) for shape in drawings])
    return union((room, *(turned(slot, "x", 2) for slot in leaf_slots(standing, clearance, leaf))))


def station_x(printer: Printer, station: int) -> float:
    """Return where a station (from 0) lies along x, mm."""
    return MARGIN + sizes(printer).pitch * (station + 0.5)


def row(printer: Printer, feature: str) -> float:
    """Return where the stations of a feature lie along y, mm."""
    behind = _ribbed(printer) and feature not in ("recess", "ribs")
    return _ROWS[feature] + (2 * sizes(printer).handle + 6.0 if behind else 0.0)


def _ribbed(printer: Printer) -> bool:
    return float(printer.rib_interference_mm or 0.0) > 0


def _plug(made: Sizes) -> Shape:
    """Draw a plinth on a handle, printed plinth up, as the base's is."""
    half = made.handle
    handle = box(-half, half, -half, half, 0, 4)
    return union((handle, moved(turned(_taper(made, 0.0), "x", 2), 0, 0, 4 + made.height)))


def _tongue(printer: Printer) -> Shape:
    half, height = _tongue_width(printer) / 2, float(printer.slot_height_mm)
    return union((box(-half, half, 0, 20, 0, height), box(-half - 3, half + 3, 19, 27, 0, height)))


def _tongue_width(printer: Printer) -> float:
    return TAIL_WIDTH + float(printer.slot_width_clearance_mm)
