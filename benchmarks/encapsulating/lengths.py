"""The lengths of the encapsulating set as plain JSON, for scripts that know nothing of unitcad.

python benchmarks/encapsulating/lengths.py FILE
"""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import Any

from unitcad.api.variant import Variant
from unitcad.designs.limits import filament_groove
from unitcad.moulds.base import GRIP_GAP, GRIP_LENGTH, GRIP_WIDTH, plate_bottom, pry_floor
from unitcad.moulds.cup import ROOT, ribs, window_section
from unitcad.moulds.filament import FILAMENT_TAIL, FLARE
from unitcad.moulds.layout import CORNER_RADIUS, MARK, PLINTH_DRAFT_DEG, TEXT_MARGIN
from unitcad.moulds.pieces import BLADE_EDGE, BLADE_THICKNESS
from unitcad.shape import mm
from unitcad.shape.lettering import HEIGHT, outlines, text_width
from unitcad.spec import printer_of


def lengths() -> dict:
    """Every length (mm) that the set is drawn from, and the outlines of its labels."""
    variant = Variant.of("encapsulating")
    dims, lay, moulds, spec = variant.dimensions, variant.plan.layout, variant.spec.moulds, variant.spec
    label, stroke = variant.plan.label, moulds.engraving_stroke_mm
    corner = lay.cup[0] - TEXT_MARGIN
    width, height = text_width("00", stroke), HEIGHT * stroke
    base_text = f"B{label}"
    return {
        "motor": [dims.motor_radius, dims.motor_height],
        "cavity": dims.cavity_radius,
        "radii": dims.radii,
        "core_height": dims.core_height,
        "heights": dims.heights,
        "pad_radius": dims.pad.radius,
        "circuit_z": (dims.pad.low, dims.pad.high),
        "tail": [spec.fpcb.tail_width_mm, dims.outer_radius + spec.fpcb.tail_length_mm],
        "slot_z": (dims.exit.low, dims.exit.high),
        "slot_width": dims.exit.width,
        "ledge": dims.ledge_radius,
        "plinth": lay.plinth[0],
        "plinth_height": moulds.plinth_height_mm,
        "splay": math.tan(math.radians(PLINTH_DRAFT_DEG)),
        "key": lay.key,
        "corner": CORNER_RADIUS,
        "mark": MARK,
        "recess": moulds.plinth_clearance_mm / math.cos(math.radians(PLINTH_DRAFT_DEG)),
        "ribs": _ribs(variant.frame),
        "skirt_end": -moulds.plinth_height_mm + moulds.seat_relief_mm,
        "cup": lay.cup[0],
        "plate": lay.plate[0],
        "pry_floor": pry_floor(spec),
        "plate_thickness": moulds.plate_mm,
        "land": moulds.land_mm,
        "groove": [moulds.groove_width_mm, moulds.groove_depth_mm],
        "least_wall": moulds.least_wall_mm,
        "window": moulds.window_clearance_mm,
        "windows": [window_section(spec, dims.exit, rim) for rim in dims.heights],
        "hole": moulds.filament_hole_mm / 2,
        "filament": moulds.filament_mm / 2,
        "filament_groove": filament_groove(spec),
        "flare": FLARE,
        "flare_floor": plate_bottom(spec)
        + filament_groove(spec)
        - math.ceil(0.5 / moulds.layer_mm - 1e-6) * moulds.layer_mm,
        "stub_tail": FILAMENT_TAIL,
        "grip": [GRIP_GAP, GRIP_LENGTH, GRIP_WIDTH],
        "blade": [BLADE_THICKNESS, BLADE_EDGE, 12.0],
        "engraving": moulds.engraving_depth_mm,
        "base_text": _text(
            base_text,
            stroke,
            -text_width(base_text, stroke) / 2,
            (lay.cup[1] + lay.plate[1]) / 2 - lay.label_height / 2,
        ),
        "cup_texts": [
            _text(f"C{i}", stroke, -corner, corner - height)
            + _text(label[:2], stroke, -corner, -corner)
            + _text(label[2:], stroke, corner - width, -corner)
            for i in (1, 2)
        ],
    }


def _ribs(frame: Any) -> list[list[list[list[float]]]]:
    """The corners (x, y, z) of the four sections of each rib, from the skirt's end upwards."""
    moulds, draft = frame.spec.moulds, math.radians(PLINTH_DRAFT_DEG)
    line = float(printer_of(frame.spec).least_feature_mm)
    into, wall = moulds.rib_interference_mm / math.cos(draft), moulds.plinth_clearance_mm / math.cos(draft)
    foot = line / 2 + into + wall + ROOT
    drawn = []
    for rib in ribs(frame):
        (nx, ny), sections = rib.inwards, []
        for z, tip in ((rib.foot, -wall - ROOT / 2), (rib.bottom, into), (rib.top, into), (rib.head, -wall - ROOT / 2)):
            face = z * math.tan(draft)
            half = line / 2 + into - tip  # flanks of 45 degrees
            corners = ((tip, -half), (tip, half), (-wall - ROOT, foot), (-wall - ROOT, -foot))
            sections.append(
                [[rib.x + nx * (d + face) - ny * t, rib.y + ny * (d + face) + nx * t, z] for d, t in corners]
            )
        drawn.append(sections)
    return drawn


def on_grid(value: Any) -> Any:
    """Every length on unitcad's grid, so that volumes differ by tessellation alone."""
    if isinstance(value, dict):
        return {key: item if key == "splay" else on_grid(item) for key, item in value.items()}
    return [on_grid(item) for item in value] if isinstance(value, list | tuple) else mm(value)


def _text(text: str, stroke: float, x: float, y: float) -> list[dict]:
    """Outline and islands of every character, moved to where it stands."""
    found = []
    for i, character in enumerate(text):
        outer, islands = outlines(character, stroke)
        dx = x + i * 4 * stroke
        found.append(
            {
                "outer": [[px + dx, py + y] for px, py, _ in outer.vertices],
                "islands": [[[px + dx, py + y] for px, py, _ in island.vertices] for island in islands],
            }
        )
    return found


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(json.dumps(on_grid(lengths())))
