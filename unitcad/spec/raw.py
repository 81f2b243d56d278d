"""The tables of a spec as typed in a TOML file. Lengths in mm, the unit in each name.

Validation works out the values that a file leaves out (`DERIVED`); a resolved spec (`unitcad.spec.resolved`) has the
same tables with every value there. Only types and ranges of single values are checked here. The design and
`validation` check conditions on several values.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from msgspec import UNSET, Meta, Struct, UnsetType

from unitcad.catalogue import MaterialEntry, MotorEntry, PrinterEntry, TissueEntry
from unitcad.catalogue import entries as kinds
from unitcad.catalogue.entries import between

DERIVED: Any = None
"""The default of a value that validation works out. Only a spec that is not resolved yet contains it."""
DEFAULT_MOTOR = "LCM0720A3463F"
"""The motor of a spec that gives neither a part nor a size."""
LEAST_LAYER = 0.5
"""Least wall and cap of a layer, mm: thinner ones tear on demoulding and hide a printer's play."""
LEAST_TAIL = 0.4
"""No circuit's tail is narrower (two traces), mm."""
LEAST_LEDGE = 0.1
"""No ledge in the core is narrower, mm."""
Length = Annotated[float, between(0.1, kinds.LONGEST_MM)]
Thickness = Annotated[float, between(LEAST_LAYER, kinds.LONGEST_MM)]
CircuitThickness = Annotated[float, between(0.01, 5)]
Coordinate = Annotated[float, between(-kinds.LONGEST_MM, kinds.LONGEST_MM)]
Cavities = Annotated[int, Meta(ge=1)]
Vents = Annotated[int, between(1, 1000)]
TailWidth = Annotated[float, between(LEAST_TAIL, kinds.LONGEST_MM)]
Format = Literal["stl", "3mf", "step", "svg", "png", "glb", "pdf"]
FORMATS: tuple[Format, ...] = ("step", "stl", "3mf", "svg", "png", "glb", "pdf")
Output = Literal["unit", "moulds", "estimate", "casting"]
OUTPUTS: tuple[Output, ...] = ("unit", "moulds", "estimate", "casting")
_LAYERS = "one [[layers]] table or more, from the inside out, each with material and wall_mm"
_TISSUE = "one layer or more by name, skin first, each a table with density_kg_m3, poisson_ratio and a modulus"
Moduli = Literal["small-strain", "quasi-static"]
Model = Literal["rule", "published", "corrected", "fem"]


class Table(Struct, frozen=True, kw_only=True, repr_omit_defaults=True, forbid_unknown_fields=True):
    """A table of the spec: frozen, unknown keys refused.

    `removed`: for each key of an earlier version the key that took its place, or what to do. `elsewhere`: for words that
    no table has as a key, where a person finds it.
    """

    removed: ClassVar[Mapping[str, str]] = {}
    elsewhere: ClassVar[Mapping[str, str]] = {}


class MotorTable(Table, frozen=True, kw_only=True):
    """The motor: a `part` of the catalogue, or its size, or both: a size then overrides the part's.

    Examples
    --------
    >>> import unitcad
    >>> motor = unitcad.Motor(part="LCM0720A3463F", thickness_mm=2.3)
    >>> unitcad.load("encapsulating", set={"motor": motor}).motor.thickness_mm
    2.3
    """

    part: Annotated[
        str | None, Meta(description="motor of the catalogue (unitcad list motors), or of the spec's own [motors.NAME]")
    ] = None
    diameter_mm: Annotated[kinds.MotorDiameter, Meta(description="diameter of the can; default: the part's")] = DERIVED
    thickness_mm: Annotated[kinds.MotorThickness, Meta(description="thickness of the can; default: the part's")] = (
        DERIVED
    )
    drive: kinds.Drive = DERIVED
    fill: Annotated[bool, Meta(description="true: Layer 1 reaches the motor, without a ring of air between them")] = (
        False
    )
    lip_mm: Annotated[float, between(0, 10, "reach of a lip of Layer 1 over the motor's edge at the skin; 0: none")] = (
        0.0
    )
    at: Annotated[
        tuple[Coordinate, Coordinate, Coordinate] | UnsetType,
        Meta(
            description="middle of the motor's lower face in the frame of the body's file, mm, for a spec with [body]; "
            "default: the middle of its bottom, or of the floor"
        ),
    ] = UNSET


class BodyTable(Table, frozen=True, kw_only=True):
    """The unit's outer surface from a file: the layers are offset inwards from it.

    Examples
    --------
    A spec's `[body]` takes the place of `design` and `diameter_mm`, and each layer has `thickness_mm` in place of
    `wall_mm`.

    >>> import unitcad
    >>> unitcad.Body(file="tip.stl").bottom
    'open'
    """

    file: Annotated[str, Meta(description="the body (.step, .stl, .3mf), standing on its lowest point")]
    file_source: Annotated[str | None, Meta(description="text of the body; unitcad fills it in")] = None
    bottom: Annotated[
        Literal["open", "floor"],
        Meta(
            description="open: every layer reaches down to the skin; floor: layer 1 is a slab under the others, on "
            "which motor and circuit are laid"
        ),
    ] = "open"


class FpcbTable(Table, frozen=True, kw_only=True):
    """The flexible circuit: a round pad on the motor and a straight tail to one side or to both.

    Examples
    --------
    >>> import unitcad
    >>> unitcad.load("encapsulating", set={"fpcb": unitcad.Fpcb(tail="both")}).fpcb.tail
    'both'
    """

    tail: Annotated[
        Literal["one", "both"], Meta(description="sides on which the circuit leaves: one (+x), or both")
    ] = "one"
    thickness_mm: Annotated[CircuitThickness, Meta(description="thickness of the circuit")] = 0.11
    tail_width_mm: Annotated[
        TailWidth, Meta(description="width of the tail; half of it is at most 0.7 of the core's radius")
    ] = 3.0
    tail_length_mm: Annotated[Length, Meta(description="length of the tail outside the unit")] = 10.0
    pad_diameter_mm: Annotated[
        Length, Meta(description="diameter of the pad on the motor; default: as wide as the design allows")
    ] = DERIVED
    tail_end_width_mm: Annotated[
        TailWidth, Meta(description="width of the tail's free end, such as a connector, which must pass the slot")
    ] = DERIVED


class WiresTable(Table, frozen=True, kw_only=True):
    """Wires in place of a circuit: side by side, out along +x through one slot or notch.

    Examples
    --------
    >>> import unitcad
    >>> unitcad.load("no-fpcb", set={"wires": unitcad.Wires(diameter_mm=0.4)}).wires.count
    2
    """

    diameter_mm: Annotated[float, between(0.05, 20, "diameter of one wire with its insulation")]
    count: Annotated[int, between(1, 8, "number of wires")] = 2
    length_mm: Annotated[Length, Meta(description="length of the wires outside the unit")] = 10.0


class LayerTable(Table, frozen=True, kw_only=True):
    """One silicone layer: a wall and, in a design that has caps, a cap.

    Examples
    --------
    >>> import unitcad
    >>> layers = [unitcad.Layer(material="ecoflex-00-30", wall_mm=2.5)]
    >>> unitcad.load("single-embedded", set={"layers": layers}).layers[0].wall_mm
    2.5
    """

    material: Annotated[
        str,
        Meta(description="silicone of the catalogue (unitcad list materials), or of the spec's own [materials.NAME]"),
    ]
    wall_mm: Annotated[Thickness, Meta(description="thickness of the layer at the skin")]
    cap_mm: Annotated[
        Thickness | None,
        Meta(description="thickness of the layer above the motor, for a design that has caps"),
    ] = None
    thickness_mm: Annotated[
        Thickness | UnsetType,
        Meta(
            description="thickness of the layer in a spec with [body], in place of wall_mm; without it the innermost "
            "layer fills the body"
        ),
    ] = UNSET


class MouldsTable(Table, frozen=True, kw_only=True):
    """The moulds. Lengths of the printer override those of its catalogue entry.

    Examples
    --------
    >>> import unitcad
    >>> unitcad.load("embedded", set={"moulds": unitcad.Moulds(printer="sla")}).moulds.layer_mm
    0.05
    """

    printer: Annotated[
        str, Meta(description="printer of the catalogue (unitcad list printers), or of the spec's own [printers.NAME]")
    ] = "fdm-0.4"
    cavities: Annotated[
        tuple[Cavities, Cavities] | Literal["fill"],
        Meta(description="columns and rows of cavities in one mould, or fill: as many as the bed takes"),
    ] = (1, 1)
    bed_x_mm: kinds.Bed = DERIVED
    bed_y_mm: kinds.Bed = DERIVED
    bed_z_mm: kinds.Bed = DERIVED
    layer_mm: kinds.LayerHeight = DERIVED
    first_layer_mm: kinds.FirstLayer = DERIVED
    xy_play_mm: kinds.Play = DERIVED
    plinth_clearance_mm: kinds.PlinthClearance = DERIVED
    rib_interference_mm: kinds.RibInterference = DERIVED
    bore_compensation_mm: kinds.BoreCompensation = DERIVED
    seat_relief_mm: kinds.SeatRelief = DERIVED
    slot_height_mm: kinds.SlotHeight = DERIVED
    slot_width_clearance_mm: kinds.SlotClearance = DERIVED
    window_clearance_mm: kinds.WindowClearance = DERIVED
    least_wall_mm: kinds.Wall = DERIVED
    skirt_wall_mm: kinds.Skirt = DERIVED
    land_mm: kinds.Land = DERIVED
    groove_width_mm: kinds.GrooveWidth = DERIVED
    groove_depth_mm: kinds.GrooveDepth = DERIVED
    filament_hole_mm: kinds.FilamentHole = DERIVED
    engraving_depth_mm: kinds.EngravingDepth = DERIVED
    engraving_stroke_mm: kinds.EngravingStroke = DERIVED
    pour: Annotated[
        Literal["open", "injected"],
        Meta(description="open: struck off along the rim; injected: under a lid with sprue and vents"),
    ] = "open"
    sprue_mm: Annotated[
        float,
        between(3.0, 50, "diameter of the sprue of each cavity under a lid: 3 by syringe, 4 by gravity"),
    ] = 3.0
    vents: Annotated[
        Vents | None,
        Meta(description="number of vents of each cavity under a lid, in fours; default: as many as clear the air"),
    ] = None
    filament_mm: Annotated[float, between(0.2, 20, "diameter of the filament in the core")] = 1.75
    plinth_height_mm: Annotated[
        float, between(0.6, 100, "height of the plinth; default: 2 mm in whole printed layers")
    ] = DERIVED
    plate_mm: Annotated[
        float, between(0.5, 100, "thickness of the base's plate; default: 4 mm in whole printed layers")
    ] = DERIVED
    ledge_mm: Annotated[float, between(LEAST_LEDGE, 100, "width of the core's ledge that carries the tongue")] = 0.6
    parting: Annotated[
        Annotated[str, Meta(pattern=r"^[xyz]=-?[0-9]+(\.[0-9]+)?$")] | UnsetType,
        Meta(
            description='a plane such as "z=3.2" (mm, as drawn), where the mould of a custom body of one layer comes '
            "apart; default: the best one found"
        ),
    ] = UNSET
    shrinkage_percent: Annotated[
        kinds.Shrinkage,
        Meta(description="linear shrinkage that the tools make up for, %; default: the largest of the silicones"),
    ] = DERIVED
    draft_deg: Annotated[
        float, between(0, 3, "taper of bores and core, narrower upwards: silicone comes off more easily")
    ] = 0.0


class CastingTable(Table, frozen=True, kw_only=True):
    """The bench: scale, mixing, room, and the margin on a silicone's elongation.

    Examples
    --------
    >>> import unitcad
    >>> unitcad.load("embedded", set={"casting": unitcad.Casting(vacuum=False)}).casting.vacuum
    False
    """

    scale_resolution_g: Annotated[float, between(1e-6, 1000, "smallest step of the scale")] = 0.01
    minimum_mix_g: Annotated[float, between(0.001, 1e6, "smallest batch to mix")] = 2.0
    waste: Annotated[float, between(0, 10, "extra mix, as a fraction of the cavities' content")] = 0.5
    room_c: Annotated[float, between(5, 45, "temperature of the room, which sets pot life and cure")] = 23.0
    vacuum: Annotated[bool, Meta(description="whether a vacuum chamber is at hand")] = True
    strain_margin: Annotated[
        float,
        between(0.01, 1, "fraction of a silicone's elongation at break that demoulding may use"),
    ] = 0.5


class EstimateTable(Table, frozen=True, kw_only=True):
    """Inputs of the estimate.

    Examples
    --------
    >>> import unitcad
    >>> unitcad.load("embedded", set={"estimate": unitcad.Estimate(frequency_hz=150)}).estimate.frequency_hz
    150.0
    """

    removed: ClassVar = {"stack": "the range is that of the rule; leave it out"}
    frequency_hz: Annotated[kinds.Frequency, Meta(description="frequency of the drive; default: the motor's")] = DERIVED
    amplitude_um: Annotated[kinds.Amplitude, Meta(description="amplitude of the motor; default: the motor's own")] = (
        DERIVED
    )
    tissue: Annotated[
        str, Meta(description="tissue under the unit, of the catalogue or of the spec's own [tissue.NAME.LAYER]")
    ] = "forearm"
    models: Annotated[
        tuple[Model, ...], Meta(min_length=1, description="models of the level; fem are the finite elements")
    ] = ("rule", "published", "corrected")
    moduli: Annotated[
        Moduli,
        Meta(description="modulus of the silicones: youngs_modulus_kpa, or quasistatic_modulus_kpa"),
    ] = "small-strain"
    fit: Annotated[
        str | None, Meta(description="lab-fit.toml of unitcad fit next to the spec: the lab's own constants and ranges")
    ] = None
    fit_source: Annotated[str | None, Meta(description="text of that file; unitcad fills it in")] = None


class OutputTable(Table, frozen=True, kw_only=True):
    """File formats and the tolerance of meshes.

    Examples
    --------
    >>> import unitcad
    >>> unitcad.load("embedded", set={"output": unitcad.Output(formats=("stl",))}).output.formats
    ('stl',)
    """

    formats: Annotated[
        tuple[Format, ...],
        Meta(description="file formats; default: step, stl, 3mf, without a B-rep kernel stl, 3mf"),
    ] = DERIVED
    tolerance_mm: Annotated[float, between(0.0005, 0.2, "largest distance of a mesh from the true round surface")] = (
        0.01
    )


class RawSpec(Table, frozen=True, kw_only=True):
    """A haptic unit. Required: name, design, diameter_mm and [[layers]]."""

    elsewhere: ClassVar = {
        "height": "a unit is as high as its layers make it: change layers.0.wall_mm and the others, cap_mm or skin_mm",
        "mass": "it follows from the parts: `unitcad estimate` and `build` say it",
        "pot_life": "it is the silicone's: `unitcad list materials --pot-life 20..` lists those of 20 min and more",
    }

    name: Annotated[
        str, Meta(min_length=1, max_length=120, description="a name of the variant; the result's folder begins with it")
    ]
    design: Annotated[
        str, Meta(description="a design (unitcad list designs), FILE.py:NAME, or a file of bodies (.step, .stl, .3mf)")
    ]
    diameter_mm: Annotated[float, between(1, kinds.LONGEST_MM, "diameter of the unit")]
    body: Annotated[
        BodyTable | UnsetType, Meta(description="the outer surface from a file, in place of design and diameter_mm")
    ] = UNSET
    skin_mm: Annotated[
        float,
        between(0, 20, "thickness of a film of the last layer's silicone over the skin side; 0: none"),
    ] = 0.0
    motor: Annotated[MotorTable | bool, Meta(description="the motor; false: none, for a custom design")] = MotorTable(
        part=DEFAULT_MOTOR
    )
    fpcb: Annotated[FpcbTable | bool | None, Meta(description="the flexible circuit; false: none")] = None
    wires: Annotated[WiresTable | bool | None, Meta(description="wires in place of a circuit; false: none")] = None
    layers: Annotated[tuple[LayerTable, ...], Meta(min_length=1, max_length=15, description=_LAYERS)]
    moulds: MouldsTable = MouldsTable()
    casting: CastingTable = CastingTable()
    estimate: EstimateTable = EstimateTable()
    output: OutputTable = OutputTable()
    materials: Annotated[dict[str, MaterialEntry], Meta(max_length=1000)] = {}
    motors: dict[str, MotorEntry] = {}
    printers: dict[str, PrinterEntry] = {}
    tissue: dict[str, Annotated[dict[str, TissueEntry], Meta(min_length=1, description=_TISSUE)]] = {}
    parameters: Annotated[
        dict[str, bool | int | float | str],
        Meta(description="values that a custom design reads: numbers, texts, true or false"),
    ] = {}
    design_source: Annotated[
        str | None, Meta(description="text of a custom design's file, or its bodies; unitcad fills it in")
    ] = None
