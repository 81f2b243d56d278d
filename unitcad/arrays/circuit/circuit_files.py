"""The files of a common circuit: SVG, DXF, KiCad board and the table of pads."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator
from contextlib import contextmanager
from html import escape
from typing import Any

from unitcad.arrays.array import Array
from unitcad.arrays.circuit.outline import outline
from unitcad.arrays.circuit.wiring import Wiring, wiring
from unitcad.arrays.construction import construction_of
from unitcad.errors import Missing, missing_extra
from unitcad.export.chart import number
from unitcad.shape import Profile
from unitcad.shape.profile import arc_centre, arc_middle, sides
from unitcad.spec import motor_of

_EDGE_MM = 5.0


def circuit_svg(laid: Wiring, outline: Profile) -> str:
    """Return the circuit as an SVG document seen from outside, a user unit a millimetre."""
    x0, y0, x1, y1 = outline.bounds
    wide, high = (number(length + 2 * _EDGE_MM) for length in (x1 - x0, y1 - y0))
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{wide}mm" height="{high}mm" '
        f'viewBox="{number(x0 - _EDGE_MM)} {number(-y1 - _EDGE_MM)} {wide} {high}">',
        f'<path id="outline" d="{outline_path(outline)}" fill="#f3cfa0" stroke="#8a4a0a" stroke-width="0.1"/>',
    ]
    for pad in laid.pads:
        at = f'x="{number(pad.x)}" y="{number(0.5 - pad.y)}"'
        parts += [
            f'<circle class="pad" cx="{number(pad.x)}" cy="{number(-pad.y)}" r="{number(pad.radius)}" fill="none" '
            'stroke="#8a4a0a" stroke-width="0.1" stroke-dasharray="0.6 0.4"/>',
            f'<text {at} font-family="sans-serif" font-size="1.5" text-anchor="middle">{escape(pad.name)}</text>',
        ]
    return "\n".join([*parts, "</svg>", ""])


def outline_path(outline: Profile) -> str:
    """Return an outline as the data of an SVG path, y downwards, to a micrometre."""
    first = outline.vertices[0]
    drawn = [f"M{_um(first[0])} {_um(-first[1])}"]
    for start, end in sides(outline.vertices):
        to = f"{_um(end[0])} {_um(-end[1])}"
        if not start[2]:
            drawn.append(f"L{to}")
            continue
        radius = _um(arc_centre(start[:2], end[:2], start[2])[2])
        # More than half a turn has a bulge over 1; left turns run against SVG's sweep, whose y points down.
        drawn.append(f"A{radius} {radius} 0 {int(abs(start[2]) > 1)} {int(start[2] < 0)} {to}")
    return "".join([*drawn, "Z"])


def _um(value: float) -> str:
    return f"{round(value, 3) + 0.0:.3f}".rstrip("0").rstrip(".")


_DIGITS = 6
_TEXT_MM = 1.5
_COLOURS = {"OUTLINE": 7, "PADS": 30, "NAMES": 8}
"""Of the layers, by AutoCAD's index."""


def circuit_dxf(laid: Wiring, outline: Profile) -> bytes:
    """Return a DXF file (AC1024, AutoCAD 2010 and later). Raises Missing without ezdxf."""
    ezdxf = _library()
    with _fixed_dates(ezdxf):
        document = ezdxf.new("R2010", units=4)  # millimetres
        document.header["$MEASUREMENT"] = 1
        for name, colour in _COLOURS.items():
            document.layers.add(name, color=colour)
        space = document.modelspace()
        vertices = [(round(x, _DIGITS), round(y, _DIGITS), round(bulge, 12)) for x, y, bulge in outline.vertices]
        space.add_lwpolyline(vertices, format="xyb", close=True, dxfattribs={"layer": "OUTLINE"})
        for pad in laid.pads:
            at = (round(pad.x, _DIGITS), round(pad.y, _DIGITS))
            space.add_circle(at, round(pad.radius, _DIGITS), dxfattribs={"layer": "PADS"})
            name = space.add_text(pad.name, height=_TEXT_MM, dxfattribs={"layer": "NAMES"})
            name.set_placement(at, align=ezdxf.enums.TextEntityAlignment.MIDDLE_CENTER)
        for kind in sorted(document.entitydb.dxf_types_in_use()):  # ezdxf adds their classes in the order of a set
            document.classes.add_class(kind)
        stream = io.StringIO()
        document.write(stream)
    return stream.getvalue().encode("utf-8")


def _library() -> Any:
    try:
        import ezdxf
        import ezdxf.enums
    except ImportError as error:
        raise missing_extra("dxf", "ezdxf is not installed; build without dxf, or install it") from error
    return ezdxf


@contextmanager
def _fixed_dates(ezdxf: Any) -> Iterator[None]:
    """Have ezdxf write one date and one identifier for a block: its options belong to the whole process."""
    before = ezdxf.options.write_fixed_meta_data_for_testing
    ezdxf.options.write_fixed_meta_data_for_testing = True
    try:
        yield
    finally:
        ezdxf.options.write_fixed_meta_data_for_testing = before


_VERSION = 20221018
_CORNER_MM = 20.0
_LAYERS = (
    (0, "F.Cu", "signal"),
    (31, "B.Cu", "signal"),
    (36, "B.SilkS", 'user "B.Silkscreen"'),
    (37, "F.SilkS", 'user "F.Silkscreen"'),
    (38, "B.Mask", "user"),
    (39, "F.Mask", "user"),
    (40, "Dwgs.User", 'user "User.Drawings"'),
    (44, "Edge.Cuts", "user"),
    (45, "Margin", "user"),
)


def kicad_board(laid: Wiring, outline: Profile) -> bytes:
    """Return a .kicad_pcb file."""
    x0, _, _, y1 = outline.bounds

    def at(x: float, y: float) -> str:
        return f"{_number(x - x0 + _CORNER_MM)} {_number(y1 - y + _CORNER_MM)}"

    rows = [
        f"(kicad_pcb (version {_VERSION}) (generator unitcad)",
        f"  (general (thickness {_number(laid.thickness)}))",
        f'  (paper "{_paper(outline)}")',
        "  (layers",
        *(f'    ({number} "{name}" {kind})' for number, name, kind in _LAYERS),
        "  )",
        "  (setup (pad_to_mask_clearance 0))",
        '  (net 0 "")',
    ]
    stroke = "(stroke (width 0.05) (type default))"
    for start, end in sides(outline.vertices):
        middle = f"(mid {at(*arc_middle(start, end))}) " if start[2] else ""
        kind = "gr_arc" if start[2] else "gr_line"
        rows.append(f'  ({kind} (start {at(*start[:2])}) {middle}(end {at(*end[:2])}) {stroke} (layer "Edge.Cuts"))')
    for pad in laid.pads:
        centre, rim = at(pad.x, pad.y), at(pad.x + pad.radius, pad.y)
        rows.append(f'  (gr_circle (center {centre}) (end {rim}) {stroke} (fill none) (layer "Dwgs.User"))')
        rows.append(
            f'  (gr_text "{pad.name}" (at {centre}) (layer "Dwgs.User") '
            "(effects (font (size 1.5 1.5) (thickness 0.15))))"
        )
    return "\n".join([*rows, ")", ""]).encode()


def _paper(outline: Profile) -> str:
    """Return the smallest page around the outline and its margins."""
    x0, y0, x1, y1 = outline.bounds
    wide, high = x1 - x0 + 2 * _CORNER_MM, y1 - y0 + 2 * _CORNER_MM
    sizes = (("A4", 297, 210), ("A3", 420, 297), ("A2", 594, 420), ("A1", 841, 594))
    return next((name for name, across, down in sizes if wide <= across and high <= down), "A0")


def _number(value: float) -> str:
    return f"{value + 0.0:.6f}".rstrip("0").rstrip(".")


def pad_table(array: Array, laid: Wiring) -> bytes:
    """Return a CSV file: a row for each motor's pad, in mm as in the array's frame, and one for the end of the tail.

    x and y from the array's middle, seen from outside; `z_mm`: the pad's face towards the motor, over the skin.
    """
    text = io.StringIO()
    rows = csv.writer(text, lineterminator="\n")
    rows.writerow(("name", "what", "x_mm", "y_mm", "z_mm", "diameter_mm", "unit", "motor"))
    for pad, place in zip(laid.pads, array.places, strict=True):
        at = (_mm(pad.x), _mm(pad.y), _mm(laid.low), _mm(2 * pad.radius))
        rows.writerow((pad.name, "pad", *at, place.unit.name, motor.name if (motor := motor_of(place.unit)) else ""))
    width = _mm(2 * laid.spine[-1].half)
    rows.writerow(("tail", "end of the tail", _mm(laid.end[0]), _mm(laid.end[1]), _mm(laid.low), width, "", ""))
    return text.getvalue().encode()


def _mm(value: float) -> str:
    return f"{round(value, 4) + 0.0:.4f}".rstrip("0").rstrip(".")


DXF = "circuit.dxf"


def has_circuit(array: Array) -> bool:
    """Tell whether one circuit joins all motors, since the units have no tails of their own."""
    return not construction_of(array.construction, array.cast).own_tails


def circuit_files(array: Array) -> tuple[dict[str, bytes], dict[str, str]]:
    """Return the files by their names, and the reason for a missing one: DXF needs ezdxf.

    Raises Refusal as `outline`.
    """
    if not has_circuit(array):
        return {}, {}
    laid = wiring(array)
    drawn = outline(array, laid)
    files = {
        "circuit.svg": circuit_svg(laid, drawn).encode(),
        "circuit.kicad_pcb": kicad_board(laid, drawn),
        "circuit-pads.csv": pad_table(array, laid),
    }
    try:
        return {**files, DXF: circuit_dxf(laid, drawn)}, {}
    except Missing as missing:
        return files, {DXF: str(missing)}
