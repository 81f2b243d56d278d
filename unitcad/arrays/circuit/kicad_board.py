"""The circuit's outline as a KiCad board: Edge.Cuts of lines and arcs, each motor's pad drawn on Dwgs.User.

Written after KiCad's description of its board files, version 7. KiCad's y points down. The lower left corner of the
outline stands at (20, 20) mm of the page.
"""

from __future__ import annotations

from unitcad.arrays.circuit.wiring import Wiring
from unitcad.shape import Profile
from unitcad.shape.profile import arc_middle, sides

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
    """Return the least page that holds the outline and its margins."""
    x0, y0, x1, y1 = outline.bounds
    wide, high = x1 - x0 + 2 * _CORNER_MM, y1 - y0 + 2 * _CORNER_MM
    sizes = (("A4", 297, 210), ("A3", 420, 297), ("A2", 594, 420), ("A1", 841, 594))
    return next((name for name, across, down in sizes if wide <= across and high <= down), "A0")


def _number(value: float) -> str:
    return f"{value + 0.0:.6f}".rstrip("0").rstrip(".")
