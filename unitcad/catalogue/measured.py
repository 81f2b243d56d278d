"""The paper's measured levels at the edge, typed: see the comments in measurements.toml."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta, Struct

Level = Annotated[float, Meta(gt=0, description="amplitude at the edge over the motor's")]


class MeasuredDesign(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Measurements of one design, by "Layer 1/Layer 2" in short names.

    `passes`: how often the wave from motor to skin passes the border between the layers. `caps`: whether the layers
    close over the motor. `also_printed`: a second figure of the paper for a level. `directions`: a comparison that the
    paper states without a figure.
    """

    passes: Annotated[float, Meta(gt=0)]
    caps: bool = False
    levels: dict[str, Level]
    also_printed: dict[str, Level] = {}
    over_a_control_not_named: dict[str, Level] = {}
    directions: dict[str, str] = {}


Length = Annotated[float, Meta(gt=0)]


class MeasuredUnit(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Common properties of the measured units: motor, diameter, wall of each layer, circuit, frequency, body."""

    motor: str
    diameter_mm: Length
    wall_mm: Length
    circuit_mm: Length
    frequency_hz: Length
    tissue: str


class Measurements(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The measured levels: short names of silicones, one-layer controls, and units by their design."""

    source: str
    unit: MeasuredUnit
    names: dict[str, str]
    controls: dict[str, Level]
    designs: dict[str, MeasuredDesign]

    def layers(self, unit: str) -> tuple[str, ...]:
        """Return the silicones of "E10/D30" from the inside out, by their names in the catalogue."""
        return tuple(self.names[short] for short in unit.split("/"))
