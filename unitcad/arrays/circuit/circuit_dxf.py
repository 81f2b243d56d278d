"""The circuit as DXF: the outline as a closed polyline with exact arcs, a circle and a name for each motor's pad.

Layers OUTLINE, PADS and NAMES; millimetres; seen from outside, x and y as in the array's table of pads. Needs ezdxf,
the extra `dxf`. The same circuit gives the same bytes.
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from unitcad.arrays.circuit.wiring import Wiring
from unitcad.errors import missing_extra
from unitcad.shape import Profile

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
