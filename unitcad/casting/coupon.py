"""A fit coupon: printed first, it shows the clearances that the printer needs.

Five stations at 0.5 to 1.5 times the catalogue's value. At each: a recess for the plug (the plinth's fit), a window for
the tongue, a hole for the filament, a wall, and the station's own number, engraved.

      y
      |  [1]  [2]  [3]  [4]  [5]   engraving
      |   |    |    |    |    |    walls, standing
      |   o    o    o    o    o    filament holes
      |  [ ]  [ ]  [ ]  [ ]  [ ]   recesses
      '==  ==   ==   ==   ==  ==   windows, in the front face
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from unitcad.casting.layer_grid import NEAR
from unitcad.catalogue import Printer
from unitcad.moulds.layout import PLINTH_DRAFT_DEG
from unitcad.shape import Extrude, Profile, Shape, box, cut, cylinder, moved, rounded_rectangle, turned, union
from unitcad.shape.body import Body
from unitcad.shape.lettering import HEIGHT, engraving, text_width
from unitcad.text import number

SHARES = (0.5, 0.75, 1.0, 1.25, 1.5)
"""Of the catalogue's value, station by station."""
PLUG, PLUG_HEIGHT, CORNER = 4.0, 2.0, 1.0
"""Half side of the plug at its top, its height, the radius of its corners, mm."""
RELIEF = 0.5
"""Of a recess below the plug's top: the plug's handle bears, as a cup's seat does."""
PLATE, PITCH, MARGIN = 6.0, 16.0, 4.0
WINDOW_DEPTH, WINDOW_Z = 6.0, 2.0
TAIL_WIDTH, WALL_LENGTH, WALL_HEIGHT, FILAMENT = 3.0, 8.0, 5.0, 1.75
_COLOUR, _PLUG_COLOUR, _TONGUE_COLOUR = (0.76, 0.76, 0.76), (0.96, 0.83, 0.66), (0.90, 0.30, 0.30)
_ROWS = {"recess": 13.0, "hole": 22.0, "wall": 28.0, "number": 35.0}


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
        nominal = float(getattr(printer, key))
        return Fit(feature, key, choose, tuple(round(least + (nominal - least) * share, 4) for share in SHARES))

    return (
        fit("recess", "plinth_clearance_mm", "least where the plug drops in"),
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
        Body("coupon-plug", "tool", "coupon", _plug(), _PLUG_COLOUR),
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
    layer, made = float(printer.layer_mm), window_heights_as_printed(printer)
    drawn = [high - low for low, high in _windows(printer)]
    if any(abs(a - b) > NEAR * layer for a, b in zip(drawn, made, strict=True)):
        lines += [
            "",
            f"A window's edges fall between layers of {number(layer, 3)} mm, as they do in a cup, and the slicer moves",
            "them:",
            "",
            "| height of the window, mm | 1 | 2 | 3 | 4 | 5 |",
            "| --- | --- | --- | --- | --- | --- |",
            "| as drawn | " + " | ".join(f"{number(height, 3)}" for height in drawn) + " |",
            "| in whole layers | " + " | ".join(f"{number(height, 3)}" for height in made) + " |",
            "",
            "Stations of one height differ in width only.",
            f"The tongue of {number(thick, 3)} mm is moved too: measure it.",
        ]
    return "\n".join(lines) + "\n"


def window_heights_as_printed(printer: Printer) -> list[float]:
    """Return the height that layers leave of each station's window, mm: a slicer cuts each layer at its middle."""
    layer = float(printer.layer_mm)
    middles = [layer * (k + 0.5) for k in range(math.ceil(PLATE / layer))]
    return [layer * sum(low + 1e-6 < middle < high - 1e-6 for middle in middles) for low, high in _windows(printer)]


def _windows(printer: Printer) -> list[tuple[float, float]]:
    """Return lower and upper edge of each station's window, mm above the bed."""
    around = next(fit.values_mm for fit in fits(printer) if fit.feature == "window")
    return [(WINDOW_Z - each, WINDOW_Z + float(printer.slot_height_mm) + each) for each in around]


def _resin(printer: Printer) -> bool:
    return printer.technology.value == "sla"


def _plate(printer: Printer) -> Shape:
    stroke = float(printer.engraving_stroke_mm)
    length = PITCH * len(SHARES) + 2 * MARGIN
    depth = _ROWS["number"] + HEIGHT * stroke * SHARES[-1] / 2 + MARGIN
    solids: list[Shape] = [box(0, length, 0, depth, 0, PLATE)]
    tools: list[Shape] = []
    by_feature, windows = {fit.feature: fit.values_mm for fit in fits(printer)}, _windows(printer)
    for i in range(len(SHARES)):
        x = MARGIN + PITCH * (i + 0.5)
        tools.append(moved(_taper(by_feature["recess"][i], RELIEF, 0.25), x, _ROWS["recess"], PLATE - PLUG_HEIGHT))
        tools.append(moved(cylinder(by_feature["hole"][i] / 2, -1, PLATE + 1), x, _ROWS["hole"]))
        half = _tongue_width(printer) / 2 + by_feature["window"][i]
        tools.append(box(x - half, x + half, -1, WINDOW_DEPTH, *windows[i]))
        wall = by_feature["wall"][i] / 2
        y = _ROWS["wall"]
        solids.append(box(x - WALL_LENGTH / 2, x + WALL_LENGTH / 2, y - wall, y + wall, PLATE - 1, PLATE + WALL_HEIGHT))
        own, text = by_feature["number"][i], str(i + 1)
        number = engraving(text, own, PLATE - float(printer.engraving_depth_mm), PLATE + 1)
        tools.append(moved(number, x - text_width(text, own) / 2, _ROWS["number"] - HEIGHT * own / 2))
    return cut(union(solids), tools)


def _taper(clearance: float, relief: float = 0.0, beyond: float = 0.0) -> Shape:
    """Draw the plug's taper upside down, its top at z = 0, wider by `clearance` all round, longer by `relief` below."""
    square, slope = clearance / math.cos(math.radians(PLINTH_DRAFT_DEG)), math.tan(math.radians(PLINTH_DRAFT_DEG))

    def section(height: float) -> Profile:
        grow = square + height * slope
        return rounded_rectangle(PLUG + grow, PLUG + grow, CORNER + grow)

    high = PLUG_HEIGHT + beyond
    return Extrude(section(-relief), -relief, high, top=section(high))


def _plug() -> Shape:
    """Draw a plinth on a handle, printed plinth up, as the base's is."""
    handle = box(-6, 6, -6, 6, 0, 4)
    return union((handle, moved(turned(_taper(0.0), "x", 2), 0, 0, 4 + PLUG_HEIGHT)))


def _tongue(printer: Printer) -> Shape:
    half, height = _tongue_width(printer) / 2, float(printer.slot_height_mm)
    return union((box(-half, half, 0, 20, 0, height), box(-half - 3, half + 3, 19, 27, 0, height)))


def _tongue_width(printer: Printer) -> float:
    return TAIL_WIDTH + float(printer.slot_width_clearance_mm)
