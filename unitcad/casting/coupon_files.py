"""The coupon's files: an STL a piece, one 3MF, and the page that says how to read it."""

from __future__ import annotations

from pathlib import Path

from unitcad import files
from unitcad.casting import coupon
from unitcad.catalogue import Printer
from unitcad.errors import UnitcadError
from unitcad.export import stl, threemf
from unitcad.export.printing import print_ready
from unitcad.kernels.mesh import arrays, realise

SEGMENTS = 64


def write(printer: Printer, out: Path) -> Path:
    """Write `out`/coupon-<printer>; return that folder. Raises UnitcadError where it can't be written."""
    folder = out / f"coupon-{printer.name}"
    parts = []
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for body in coupon.bodies(printer):
            if body.made != "printed":
                continue
            ready = print_ready(*arrays(realise(body.shape, SEGMENTS)), body.upside_down)
            files.write(folder / f"{body.name}.stl", stl.content(*ready, body.name))
            parts.append(threemf.MeshPart(body.name, body.colour, *ready))
        bed = float(printer.bed_x_mm), float(printer.bed_y_mm)
        files.write(folder / "coupon.3mf", threemf.content(parts, bed))
        files.write(folder / "coupon.md", coupon.to_markdown(printer).encode())
    except OSError as error:
        raise UnitcadError(f"{folder}: {error.strerror}") from None
    return folder
