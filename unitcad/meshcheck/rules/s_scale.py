"""The size of a file's content: its unit of length, S001, and S002 for a printer."""

from __future__ import annotations

from collections.abc import Iterator

from unitcad.errors import WrongArgument, unknown_name
from unitcad.geometry.arrays import extent
from unitcad.meshcheck.findings import Facts, Finding, number
from unitcad.meshcheck.geometry.resolution import SMALL
from unitcad.meshcheck.rules.inspection import Inspection, Printer
from unitcad.meshcheck.rules.registry import Rule

UNITS_MM = {"micron": 1e-3, "millimeter": 1.0, "centimeter": 10.0, "inch": 25.4, "foot": 304.8, "meter": 1000.0}
_SHORT = {"mm": "millimeter", "cm": "centimeter", "m": "meter", "in": "inch", "inches": "inch", "ft": "foot"}


def unit_named(field: str, unit: str | None) -> str | None:
    """Return the long name of a unit of length. Raises Refusal, naming `field`, for an unknown one."""
    if unit is None:
        return None
    if not isinstance(unit, str):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise WrongArgument(field, unit, "takes a unit's name, such as mm")
    known = _SHORT.get(unit.lower(), unit.lower())
    if known not in UNITS_MM:
        raise unknown_name(field, unit, UNITS_MM)
    return known


S001 = Rule("""
    S001 warning: size suggests another unit
    The largest side is under 1 mm or over 2 m as read: metres or inches were taken for millimetres, or the other way
    round.
    Example: A bracket of 40 mm was exported in metres, so that its largest side is 0.04.
    Fix: Export in millimetres, or say the unit with --unit.
""")

S002 = Rule("""
    S002 error: does not fit the printer
    The part is larger than the bed in every attitude about the vertical axis by quarter turns.
    Example: A plate of 300 mm for a bed of 210 mm.
    Fix: Turn it, cut it, or choose another printer.
""")

LARGE = 2000.0  # mm; the largest side of a printed part


def likely_unit(facts: Facts, unit: str | None) -> Iterator[Finding]:
    """Apply S001 to the largest side; `unit` is the one that the file or the caller named, as in UNITS_MM."""
    if facts.bbox_mm is None:
        return
    side = max(high - low for low, high in zip(*facts.bbox_mm, strict=True))
    if SMALL <= side <= LARGE or side == 0:
        return
    factor = UNITS_MM.get(unit or "millimeter", 1.0)
    if factor != 1.0:
        guess = f"{number(side / factor)} mm if the numbers are millimetres"
    elif side < SMALL:
        guess = f"{number(side * 1000, 3)} mm if it was metres, {number(side * 25.4, 3)} mm if inches"
    else:
        guess = f"{number(side / 1000, 3)} mm if it was microns"
    named = f"with the unit {unit} that is named" if unit else "as millimetres"
    yield S001.finding(f"largest side {number(side)} mm {named}; {guess}")


def check_print(part: Inspection, printer: Printer) -> Iterator[Finding]:
    """Apply S002 to the box of the mesh as it stands."""
    mesh = part.topology.mesh
    low, high = extent(mesh.vertices[mesh.faces.reshape(-1)])
    size = high - low
    x, y, z = float(printer.bed_x_mm), float(printer.bed_y_mm), float(printer.bed_z_mm)
    upright = size[2] <= z
    if upright and ((size[0] <= x and size[1] <= y) or (size[0] <= y and size[1] <= x)):
        return
    shown = " x ".join(number(side, 4) for side in size)
    yield S002.finding(f"{shown} mm does not fit {printer.name}: {number(x)} x {number(y)} x {number(z)}")
