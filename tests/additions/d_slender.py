"""The rule of slender parts, D090. A mesh has its printing position, z up."""

from __future__ import annotations

from collections.abc import Iterator

from unitcad.geometry.arrays import extent
from unitcad.meshcheck.findings import Finding, number
from unitcad.meshcheck.rules.inspection import Inspection, Printer
from unitcad.meshcheck.rules.registry import Rule

D090 = Rule("""
    D090 warning: slender part
    A part is so much higher than it is wide that the nozzle may tip it over.
    Example: A pin of 2 mm is 80 mm high.
    Fix: Print it lying, or with a brim.
""")

SLENDER = 30.0
"""Height over the smaller side of the box."""


def check_print(part: Inspection, printer: Printer) -> Iterator[Finding]:
    """Apply D090 to the box of the mesh as it stands."""
    mesh = part.topology.mesh
    low, high = extent(mesh.vertices[mesh.faces.reshape(-1)])
    x, y, z = high - low
    if z > SLENDER * min(x, y):
        yield D090.finding(f"{number(z, 3)} mm high and {number(min(x, y), 3)} mm wide on {printer.name}")
