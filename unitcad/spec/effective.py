"""A haptic unit with everything settled: what validation makes of an asked spec and what every other module sees.

Every value is there. `None` and "fill" remain only where they mean something: no circuit, no wires, as many vents as
clear the air, as many cavities as the bed takes. Lengths in mm, the unit in each name.
"""

from __future__ import annotations

from typing import Literal

from msgspec import structs

from unitcad.catalogue import MaterialEntry, MotorEntry, PrinterEntry, TissueEntry
from unitcad.spec.asked import CastingTable, Format, Model, OutputTable, Table, WiresTable

Casting = CastingTable
Output = OutputTable
Wires = WiresTable


class Motor(Table, frozen=True, kw_only=True):
    """The motor's size; `part` names its catalogue entry, or None. With `fill` Layer 1 reaches it."""

    part: str | None
    diameter_mm: float
    thickness_mm: float
    fill: bool


class Circuit(Table, frozen=True, kw_only=True):
    """The flexible circuit: a round pad on the motor's back and a straight tail to one side or to both."""

    tail: Literal["one", "both"]
    thickness_mm: float
    tail_width_mm: float
    tail_length_mm: float
    pad_diameter_mm: float
    tail_end_width_mm: float


class Layer(Table, frozen=True, kw_only=True):
    """One silicone layer: its wall, and its cap where the design gives it one (0: an open ring)."""

    material: str
    wall_mm: float
    cap_mm: float


class Moulds(Table, frozen=True, kw_only=True):
    """The tooling's lengths, the printer's written out where the spec overrides none."""

    printer: str
    cavities: tuple[int, int] | Literal["fill"]
    bed_x_mm: float
    bed_y_mm: float
    bed_z_mm: float
    layer_mm: float
    xy_play_mm: float
    plinth_clearance_mm: float
    seat_relief_mm: float
    slot_height_mm: float
    slot_width_clearance_mm: float
    window_clearance_mm: float
    least_wall_mm: float
    skirt_wall_mm: float
    land_mm: float
    groove_width_mm: float
    groove_depth_mm: float
    filament_hole_mm: float
    engraving_depth_mm: float
    engraving_stroke_mm: float
    pour: Literal["open", "injected"]
    sprue_mm: float
    vents: int | None
    filament_mm: float
    plinth_height_mm: float
    plate_mm: float
    ledge_mm: float


class Estimate(Table, frozen=True, kw_only=True):
    """What the attenuation estimate is asked for: frequency in Hz, amplitude in um, the body and the models."""

    frequency_hz: float
    amplitude_um: float
    tissue: str
    models: tuple[Model, ...]


class Spec(Table, frozen=True, kw_only=True):
    """A haptic unit; `layers` run from the inside out, one entry being a single-layer control.

    Made by `unitcad.validation`: the same unit as asked for, defaults written out and every limit checked.
    """

    name: str
    design: str
    diameter_mm: float
    motor: Motor
    fpcb: Circuit | None
    wires: Wires | None
    layers: tuple[Layer, ...]
    moulds: Moulds
    casting: Casting
    estimate: Estimate
    output: Output
    materials: dict[str, MaterialEntry]
    motors: dict[str, MotorEntry]
    printers: dict[str, PrinterEntry]
    tissue: dict[str, dict[str, TissueEntry]]
    parameters: dict[str, bool | int | float | str]
    design_source: str | None


def with_formats(spec: Spec, formats: tuple[Format, ...] = ()) -> Spec:
    """Return the spec with other formats, or with none: what does not depend on them is keyed so."""
    return structs.replace(spec, output=structs.replace(spec.output, formats=formats))
