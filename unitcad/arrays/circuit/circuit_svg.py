"""The circuit as SVG in true size: the outline as one path of lines and arcs, the pads and their names (mm)."""

from __future__ import annotations

from html import escape

from unitcad.arrays.circuit.wiring import Wiring
from unitcad.export.chart import number
from unitcad.shape import Profile
from unitcad.shape.profile import arc_centre, sides

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
        # More than half a turn has a bulge over 1; what turns left runs against SVG's sweep, whose y points down.
        drawn.append(f"A{radius} {radius} 0 {int(abs(start[2]) > 1)} {int(start[2] < 0)} {to}")
    return "".join([*drawn, "Z"])


def _um(value: float) -> str:
    return f"{round(value, 3) + 0.0:.3f}".rstrip("0").rstrip(".")
