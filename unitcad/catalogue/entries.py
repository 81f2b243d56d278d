"""Entries of the catalogue: for each key its type, its range and a description.

`Material`, `Motor`, `Printer` and `Tissue` are whole entries; a spec gives the keys of the `...Entry` of each.
"""

from __future__ import annotations

import math
import typing
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Generic, Literal, TypeVar

import msgspec
from msgspec import Meta, Struct

T = TypeVar("T")
Status = Literal["datasheet", "paper", "secondary", "assumed", "measured", "spec"]
FREQUENCIES_HZ = (1.0, 5000.0)
"""Frequencies of an estimate: those of vibration motors, with room on both sides; above them waves are too short."""
LONGEST_MM = 1000.0
"""Beyond a metre nothing here is printed or cast."""


def between(low: float, high: float, about: str | None = None) -> Meta:
    """Return the limits of a number, which it may reach, and its description."""
    return Meta(ge=low, le=high, description=about)


Source = Annotated[str, Meta(min_length=1, max_length=500)]
Drive = Annotated[
    Literal["flat", "axial"],
    Meta(description="direction of the force: flat, in the can's plane (ERM), or axial, along its axis (coin LRA)"),
]
Shrinkage = Annotated[float, between(0, 5, "linear shrinkage of the cured silicone, %")]
Poisson = Annotated[float, between(0, 0.5, "Poisson's ratio; 0.5: incompressible")]
LossFactor = Annotated[float, between(0, 10, "tan delta at the motor's frequency")]
Young = Annotated[float, between(0.01, 1e8, "Young's modulus at small strain and the motor's frequency")]

MotorDiameter = Annotated[float, between(1, LONGEST_MM, "diameter of the motor's can")]
MotorThickness = Annotated[float, between(0.1, 100, "thickness of the motor's can")]
Frequency = Annotated[float, between(FREQUENCIES_HZ[0], FREQUENCIES_HZ[1], "frequency of the drive")]
Amplitude = Annotated[float, between(0.001, 1e5, "amplitude of the motor")]

Bed = Annotated[float, between(20, LONGEST_MM, "side of the printer's build volume")]
LayerHeight = Annotated[float, between(0.005, 2, "height of a printed layer")]
FirstLayer = Annotated[float, between(0.005, 2, "height of the first printed layer; default: as the others, layer_mm")]
Play = Annotated[float, between(0, 2, "position error of the printer's axes, per side")]
PlinthClearance = Annotated[float, between(0.01, 2, "gap between a cup and its plinth, per side")]
RibInterference = Annotated[float, between(0, 2, "interference of a cup's ribs with its plinth, per side; 0: no ribs")]
SeatRelief = Annotated[float, between(0.01, 20, "gap between a cup's foot and the plate")]
SlotHeight = Annotated[float, between(0.05, 25, "height of the slot for a tail or wires")]
SlotClearance = Annotated[float, between(0.01, 20, "extra width of the slot, over tail or wires")]
BoreCompensation = Annotated[
    float,
    between(0, 0.5, "by how much bores are printed too narrow, per side; files make up for it"),
]
ElephantFoot = Annotated[
    float, between(0, 1, "elephant foot compensation of the slicer, by which the first layer is drawn in, per side")
]
WindowClearance = Annotated[float, between(0.01, 5, "gap between the tongue and a cup's window, per side")]
Wall = Annotated[float, between(0.05, 50, "thinnest wall that prints whole")]
Skirt = Annotated[float, between(0.05, 50, "wall of a cup around its plinth")]
Land = Annotated[float, between(0.05, 50, "width of the rim around a cavity")]
GrooveWidth = Annotated[float, between(0.05, 50, "width of the overflow groove")]
GrooveDepth = Annotated[float, between(0.05, 50, "depth of the overflow groove")]
FilamentHole = Annotated[float, between(0.1, 20, "diameter of the core's hole for the filament")]
EngravingDepth = Annotated[float, between(0.01, 10, "depth of the lettering")]
EngravingStroke = Annotated[float, between(0.05, 10, "width of the lettering's strokes")]

TissueModulus = Annotated[
    float, between(0.001, 1e9, "modulus at small strain; a shear modulus overrides Young's modulus")
]


class Value(Struct, Generic[T], frozen=True, omit_defaults=True, repr_omit_defaults=True, forbid_unknown_fields=True):
    """A number or a word with its status and source; `low` and `high` bound it if a range is known.

    `method`: the method of a measured value, if methods differ.
    """

    value: T
    status: Status = "spec"
    source: Source = "the spec"
    low: T | None = None
    high: T | None = None
    method: Source | None = None

    def __float__(self) -> float:
        return float(self.value)  # type: ignore[arg-type]


Chemistry = Annotated[
    Literal["platinum", "tin"],
    Meta(description="catalyst of the cure: platinum (addition) or tin (condensation)"),
]
CHEMISTRIES = "platinum", "tin"
_FLOOR = Value(1.0, "assumed", "usual least wall for a hand-poured silicone; about 1 mm for Ecoflex 00-30")
_INCOMPRESSIBLE = Value(
    0.4999, "assumed", "bulk modulus about 1.2 GPa against a shear modulus below 0.3 MPa", low=0.4999, high=0.5
)
_LOSSY = Value(0.2, "assumed", "tan delta of soft silicones at 100 to 150 Hz", low=0.1, high=0.3)


class Material(Struct, frozen=True, kw_only=True):
    """A castable silicone. Times are at 23 °C.

    Only its density is required; three values are assumed for every silicone that has no better ones. A value that no
    source gives is absent, and what needs it says so (`needed`).

    Examples
    --------
    >>> import unitcad
    >>> mine = unitcad.Material(like="ecoflex-00-10", density_g_cm3=1.06, source="weighed on our scale")
    >>> spec = unitcad.load("embedded", set={"materials": {"mine": mine}, "layers.0.material": "mine"})
    >>> spec.layers[0].material
    'mine'
    """

    name: str
    like: str | None = None
    density_g_cm3: Value[Annotated[float, between(0.1, 25, "density of the cured silicone")]]
    casting_floor_mm: Value[Annotated[float, between(0.01, 100, "thinnest wall that pours and demoulds")]] = _FLOOR
    poisson_ratio: Value[Poisson] = _INCOMPRESSIBLE
    loss_factor: Value[LossFactor] = _LOSSY
    chemistry: Value[Chemistry] | None = None
    mix_ratio: Value[Annotated[float, between(0.001, 1000, "parts A to one part B, by weight")]] | None = None
    mixed_viscosity_cps: Value[Annotated[float, between(1, 1e8, "viscosity of both parts mixed")]] | None = None
    pot_life_min: Value[Annotated[float, between(0.1, 1e5, "time from mixing until it no longer flows")]] | None = None
    cure_h: Value[Annotated[float, between(0.01, 1e4, "time from pouring until demoulding")]] | None = None
    shore: Value[Annotated[str, Meta(min_length=1, max_length=20, description="hardness on the data sheet")]] | None = (
        None
    )
    shrinkage_percent: Value[Shrinkage] | None = None
    tensile_mpa: Value[Annotated[float, between(0.001, 1000, "tensile strength")]] | None = None
    elongation_pct: Value[Annotated[float, between(1, 5000, "elongation at break")]] | None = None
    modulus_100pct_kpa: Value[Annotated[float, between(0.1, 1e6, "stress at 100 % strain, static")]] | None = None
    youngs_modulus_kpa: Value[Young] | None = None
    quasistatic_modulus_kpa: Value[Annotated[float, between(0.01, 1e8, "Young's modulus of a slow pull")]] | None = None
    fractional_mu0_kpa: (
        Value[Annotated[float, between(0.01, 1e8, "static shear modulus of a fractional law")]] | None
    ) = None
    fractional_tau_us: Value[Annotated[float, between(0, 1e9, "time constant of a fractional law")]] | None = None
    fractional_n: Value[Annotated[float, between(0, 1, "order of a fractional law")]] | None = None


class Contact(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What a fresh silicone does on a surface: `on` is the chemistry of a cured silicone, or another surface.

    "inhibited": it stays tacky or liquid next to the surface. `remedy`: a treatment on which it cures.
    """

    poured: Chemistry
    on: Annotated[str, Meta(min_length=1)]
    result: Literal["bonds", "inhibited"]
    status: Status
    source: Source
    remedy: str | None = None


MotorKind = Annotated[
    Literal["erm", "lra", "voice-coil", "piezo"],
    Meta(description="erm: a rotating mass; lra: a mass on a spring; voice-coil; piezo: a disc that bends"),
]
Outline = Annotated[
    Literal["round", "square"], Meta(description="outline of the can; a square one's diameter is its side")
]


class Motor(Struct, frozen=True, kw_only=True):
    """A motor; a value that no source gives is absent."""

    name: str
    kind: Value[MotorKind] | None = None
    outline: Value[Outline] | None = None
    diameter_mm: Value[MotorDiameter]
    thickness_mm: Value[MotorThickness]
    drive: Value[Drive] | None = None
    mass_g: Value[Annotated[float, between(0.001, 1e4, "mass of the motor")]] | None = None
    frequency_hz: Value[Frequency] | None = None
    amplitude_um: Value[Amplitude] | None = None
    rpm: (
        Value[Annotated[float, between(60 * FREQUENCIES_HZ[0], 60 * FREQUENCIES_HZ[1], "speed at the rated voltage")]]
        | None
    ) = None
    voltage_v: Value[Annotated[float, between(0.01, 1000, "rated voltage")]] | None = None
    current_ma: Value[Annotated[float, between(0.01, 1e5, "current at the rated voltage")]] | None = None
    acceleration_g: Value[Annotated[float, between(0.001, 1000, "acceleration of the maker's test mass")]] | None = None
    test_mass_g: Value[Annotated[float, between(0.1, 1e4, "the maker's test mass")]] | None = None
    leads: (
        Value[Annotated[str, Meta(min_length=1, max_length=60, description="leads, such as wires or pads")]] | None
    ) = None

    @property
    def square(self) -> bool:
        """Whether the can is square: its round cavity is wider than `diameter_mm`."""
        return self.outline is not None and self.outline.value == "square"


class Printer(Struct, frozen=True, kw_only=True):
    """A printer: its capability and the clearances that follow from it; all lengths mm, clearances per side."""

    removed: ClassVar = {"draft_deg": "give moulds.draft_deg in the spec"}
    name: str
    technology: Value[Annotated[Literal["fdm", "sla"], Meta(description="fdm: molten filament; sla: cured resin")]]
    bed_x_mm: Value[Bed]
    bed_y_mm: Value[Bed]
    bed_z_mm: Value[Bed]
    layer_mm: Value[LayerHeight]
    xy_play_mm: Value[Play]
    plinth_clearance_mm: Value[PlinthClearance]
    seat_relief_mm: Value[SeatRelief]
    slot_height_mm: Value[SlotHeight]
    slot_width_clearance_mm: Value[SlotClearance]
    window_clearance_mm: Value[WindowClearance]
    least_wall_mm: Value[Wall]
    least_flat_wall_mm: Value[Annotated[float, between(0.05, 50, "thinnest wall that prints flat on the bed")]]
    least_feature_mm: Value[Annotated[float, between(0.05, 20, "smallest width of a rib, a groove or a stroke")]]
    skirt_wall_mm: Value[Skirt]
    land_mm: Value[Land]
    groove_width_mm: Value[GrooveWidth]
    groove_depth_mm: Value[GrooveDepth]
    filament_hole_mm: Value[FilamentHole]
    engraving_depth_mm: Value[EngravingDepth]
    engraving_stroke_mm: Value[EngravingStroke]
    overhang_deg: Value[Annotated[float, between(0, 90, "largest lean from the vertical that prints without support")]]
    bridge_mm: Value[Annotated[float, between(0, LONGEST_MM, "longest bridge that prints without support")]]
    nozzle_mm: Value[Annotated[float, between(0.1, 2, "bore of the nozzle, of a printer of filament")]] | None = None
    first_layer_mm: Value[FirstLayer] | None = None
    rib_interference_mm: Value[RibInterference] | None = None
    bore_compensation_mm: Value[BoreCompensation] | None = None
    elephant_foot_mm: Value[ElephantFoot] | None = None
    support: (
        Value[
            Annotated[Literal["printed", "none"], Meta(description="printed: under overhangs; none: an overhang fails")]
        ]
        | None
    ) = None


class Tissue(Struct, frozen=True, kw_only=True):
    """One layer of the tissue under the unit, skin first; no `thickness_mm` means a half-space."""

    name: str
    density_kg_m3: Value[Annotated[float, between(1, 25000, "density of the tissue")]]
    poisson_ratio: Value[Poisson]
    thickness_mm: (
        Value[Annotated[float, between(0.001, 1e4, "thickness of the layer; the last layer has none")]] | None
    ) = None
    youngs_modulus_kpa: Value[TissueModulus] | None = None
    shear_modulus_kpa: Value[TissueModulus] | None = None
    loss_factor: Value[LossFactor] | None = None
    viscosity_pa_s: (
        Value[Annotated[float, between(0, 1e6, "viscosity in shear; it overrides the loss factor")]] | None
    ) = None


Hertz = Annotated[float, Meta(gt=0)]


class Touch(Struct, frozen=True, kw_only=True):
    """The threshold of touch on a tissue: the least peak displacement of vibration that is felt, over frequency.

    `threshold_um` at `corner_hz`, with a contactor of `contactor_cm2`. Below the corner it falls with frequency, above
    it rises. The curve is known from `from_hz` to `to_hz`.
    """

    name: str
    site: Value[str]
    threshold_um: Value[Annotated[float, Meta(gt=0)]]
    corner_hz: Value[Hertz]
    falling_db_octave: Value[Annotated[float, Meta(ge=0)]]
    rising_db_octave: Value[Annotated[float, Meta(ge=0)]]
    from_hz: Value[Hertz]
    to_hz: Value[Hertz]
    contactor_cm2: Value[Annotated[float, Meta(gt=0)]]

    def at(self, hertz: float) -> tuple[float, float, float] | None:
        """Return the threshold at a frequency (Hz) and the ends of its range, um; None outside the curve."""
        if not float(self.from_hz) <= hertz <= float(self.to_hz):
            return None
        octaves = math.log2(hertz / float(self.corner_hz))
        slope = -float(self.falling_db_octave) if octaves < 0 else float(self.rising_db_octave)
        factor = 10.0 ** (slope * octaves / 20.0)
        level = self.threshold_um
        low, high = (level.value if end is None else end for end in (level.low, level.high))
        return factor * level.value, factor * low, factor * high


@cache
def required_of(entry: type[Struct]) -> tuple[str, ...]:
    """Return the keys that an entry can't do without; worked out once, as the next."""
    return tuple(field.name for field in msgspec.structs.fields(entry) if field.required)


@cache
def kinds_of(entry: type[Struct]) -> tuple[tuple[str, Any], ...]:
    """Return the keys of an entry and the kind of each one's value; worked out once, since types are slow to read."""
    return tuple(
        (field.name, typing.get_args(kind)[0])
        for field in msgspec.structs.fields(entry)
        for kind in (field.type, *typing.get_args(field.type))
        if typing.get_origin(kind) is Value
    )


def _entry_of(entry: type[Struct], like: bool = True) -> type[Struct]:
    """Return the class of an entry in a spec: values, or values with their source; missing ones come from `like`."""
    scope = "default for values without their own"
    fields: list[tuple[str, Any, Any]] = [
        *([("like", Annotated[str | None, Meta(description="the shipped entry to start from")], None)] if like else []),
        ("status", Annotated[Status | None, Meta(description=scope)], None),
        ("source", Annotated[Source | None, Meta(description=scope)], None),
        *((name, kind | Value[kind] | None, None) for name, kind in kinds_of(entry)),
    ]
    return msgspec.defstruct(
        f"{entry.__name__}Entry",
        fields,
        module=__name__,
        namespace={"__doc__": entry.__doc__, "removed": getattr(entry, "removed", {})},
        frozen=True,
        kw_only=True,
        omit_defaults=True,
        repr_omit_defaults=True,
        forbid_unknown_fields=True,
    )


if TYPE_CHECKING:
    _Number = float | Value[float] | None

    class MaterialEntry(Struct, frozen=True, kw_only=True):
        """The keys of a silicone in a spec, as `_entry_of` makes it; a test compares the two."""

        like: str | None = None
        status: Status | None = None
        source: str | None = None
        density_g_cm3: _Number = None
        casting_floor_mm: _Number = None
        poisson_ratio: _Number = None
        loss_factor: _Number = None
        chemistry: str | Value[str] | None = None
        mix_ratio: _Number = None
        mixed_viscosity_cps: _Number = None
        pot_life_min: _Number = None
        cure_h: _Number = None
        shore: str | Value[str] | None = None
        shrinkage_percent: _Number = None
        tensile_mpa: _Number = None
        elongation_pct: _Number = None
        modulus_100pct_kpa: _Number = None
        youngs_modulus_kpa: _Number = None
        quasistatic_modulus_kpa: _Number = None
        fractional_mu0_kpa: _Number = None
        fractional_tau_us: _Number = None
        fractional_n: _Number = None

    class MotorEntry(Struct): ...

    class PrinterEntry(Struct): ...

    class TissueEntry(Struct): ...

else:
    MaterialEntry, MotorEntry, PrinterEntry = map(_entry_of, (Material, Motor, Printer))
    TissueEntry = _entry_of(Tissue, like=False)


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
    """Common properties of the measured units: motor, diameter, wall of each layer, circuit, frequency, tissue."""

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
