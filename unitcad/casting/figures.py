"""The numbers of a casting procedure, each with its source: grams, times, strains, play. Pure arithmetic on a spec."""

from __future__ import annotations

from dataclasses import dataclass

from unitcad.catalogue import Material, Value
from unitcad.moulds.cup import window_section
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.plan import Step
from unitcad.shape import exact_volume
from unitcad.spec import Spec, printer_of

GRAVITY = 9.80665
BUBBLE_MM = 0.2
"""Diameter of the smallest bubble that a hand-poured layer should be rid of (assumed)."""
CONTAINER = 4.0
"""Volume of the degassing container over the mix: silicone foams up under vacuum (maker's advice: 3 to 4 times)."""
VACUUM_INHG, KPA_PER_INHG = 29.0, 3.386389
MIXING_MIN, DEGASSING_MIN, POURING_MIN = 3.0, 3.0, 2.0
"""What the pot life is spent on before and after the bubbles (assumed: usual practice)."""
WIPE_MIN, LAY_IN_MIN, GREASE_MIN, CUP_ON_MIN, TONGUE_MIN, HOLD_MIN, WEIGH_MIN = 2.0, 5.0, 1.0, 2.0, 1.5, 2.0, 5.0
STRIKE_MIN, PULL_MIN, LIFT_MIN, PEEL_MIN, BRUSH_MIN = 1.0, 1.0, 2.0, 3.0, 1.0
PER_CAVITY_MIN = 0.5
"""A person's time for the other steps (assumed): what the time line adds up. Wiping, laying in, greasing, tongues,
brushing, pulling and peeling are for one cavity; `PER_CAVITY_MIN` is what each further one takes to pour."""
SORT_MIN, CLEAN_MIN, DRY_FIT_MIN, FILAMENT_MIN, LEVEL_MIN = 5.0, 10.0, 5.0, 3.0, 5.0
WASH_MIN, DRY_MIN, CLEAR_MIN, CUT_MIN, BAKE_H = 15.0, 30.0, 5.0, 5.0, 8.0
"""The same before the first pour: once a set, a cup, a cavity or a tongue; drying and baking are waits (assumed)."""
STRIKE_AGAIN_MIN = 10.0
"""When what has wept or sunk is topped up and struck off again (assumed)."""
HELD_BACK_ML = 0.5
"""What a syringe's tip and plunger keep of the silicone drawn in (assumed: a 5 to 10 ml syringe, a wide tip)."""
WITHOUT_VACUUM = 0.25
"""Share of the pot life in which bubbles must rise out by themselves (assumed): after it silicone is too thick."""
FDM_RATE = 950.0
"""Volume of the pieces, solid, that a filament printer makes in a minute, mm3 for each mm of its layers' height."""
FDM_ERROR = 0.64, 1.22
"""PrusaSlicer's time over what that rate gives, least and most: eight sets of units and six of arrays were sliced.
Thick pieces are mostly infill and print faster."""
RESIN_LAYER_S = 10.0
"""What a resin printer takes for a layer, s (assumed)."""
MOST_ERROR_PCT = 5.0
"""What a scale may do to the ratio before a cure suffers (assumed)."""
DATASHEET_C = 23.0
DOUBLING_K = 10.0
"""A cure runs twice as fast for every 10 K (assumed: the usual rule of thumb, no bulletin gives it)."""


@dataclass(frozen=True)
class Figure:
    """One number: what it is, its value and unit, and where it comes from (a source, a formula, or 'assumed: ...')."""

    name: str
    value: float
    unit: str
    source: str


def sourced(value: Value) -> str:
    """Return a catalogue value's origin in words: its status, then its source."""
    return f"{value.status}: {value.source}"


SYRINGES_ML = 5.0, 10.0, 20.0, 30.0, 60.0, 100.0
"""The sizes that syringes are sold in, ml; larger mixes take more than one filling."""


@dataclass(frozen=True)
class Mix:
    """Grams of one pour: in all cavities (and channels), to weigh in, of each part, and what half a digit does.

    `millilitres` is all that is mixed, `syringe_ml` what has to be drawn in for an injected pour, 0 for an open one.
    """

    net_g: float
    mix_g: float
    part_a_g: float
    part_b_g: float
    net_error_pct: float
    mix_error_pct: float
    millilitres: float
    syringe_ml: float = 0.0

    @property
    def syringe_size_ml(self) -> float:
        """The smallest syringe that holds all that is mixed, else the largest there is, ml."""
        return next((size for size in SYRINGES_ML if size >= self.millilitres), SYRINGES_ML[-1])


def mix(spec: Spec, material: Material, volume_mm3: float) -> Mix:
    """Return what to weigh for `volume_mm3` of silicone; errors are half the scale's digit over the smaller part."""
    casting, ratio = spec.casting, float(material.mix_ratio)
    net = volume_mm3 * float(material.density_g_cm3) / 1000
    density = float(material.density_g_cm3)
    syringe = net / density + HELD_BACK_ML if spec.moulds.pour == "injected" else 0.0
    # What stays in the mixing cup is the waste; what stays in the syringe comes on top.
    total = max(net * (1 + casting.waste) + (HELD_BACK_ML * density if syringe else 0.0), casting.minimum_mix_g)
    share = ratio / (1 + ratio)
    smaller = min(share, 1 - share)

    def error(grams: float) -> float:
        return 100 * casting.scale_resolution_g / 2 / (grams * smaller)

    return Mix(net, total, total * share, total * (1 - share), error(net), error(total), total / density, syringe)


def channels_mm3(step: Step) -> float:
    """Return the volume of a pour's sprues and vents, mm3."""
    return sum(map(exact_volume, step.channels))


def bubble_rise_s(depth_mm: float, material: Material, bubble_mm: float = BUBBLE_MM) -> float:
    """Return the seconds that a bubble takes through a depth by Stokes' law, at the viscosity just mixed: optimistic.

    v = 2/9 (density of silicone) g radius^2 / viscosity; the air's own density is left out.
    """
    density, viscosity = 1000 * float(material.density_g_cm3), float(material.mixed_viscosity_cps) / 1000
    speed = 2 / 9 * density * GRAVITY * (bubble_mm / 2000) ** 2 / viscosity
    return depth_mm / 1000 / speed


def pouring_min(cells: int) -> float:
    """Return the minutes to pour and strike off so many cavities."""
    return POURING_MIN + PER_CAVITY_MIN * (cells - 1)


def rest_min(spec: Spec, depth_mm: float, material: Material) -> float:
    """Return the minutes in which bubbles rise by themselves without a vacuum; 0 where an open pour would wait in vain.

    In a syringe what does not rise in time still gathers at its tip: the whole allowance is waited.
    """
    rise = bubble_rise_s(depth_mm, material) / 60
    allowed = WITHOUT_VACUUM * at_room(float(material.pot_life_min), spec.casting.room_c)
    return min(rise, allowed) if rise <= allowed or spec.moulds.pour == "injected" else 0.0


def at_room(value: float, room_c: float) -> float:
    """Convert a time at 23 degC (pot life, cure) to the room's temperature, by the rule of thumb above."""
    return value * 2 ** ((DATASHEET_C - room_c) / DOUBLING_K)


def weep_mm3(moulds: MouldSet, step: Step, material: Material) -> float:
    """Return what flows out beside the tongues of one cell during the whole pot life without grease, mm3.

    Plane Poiseuille flow through the gaps round the tongue, each gap^3 width pressure / (12 viscosity length).
    """
    spec, dims = moulds.spec, moulds.plan.dimensions
    if not dims.exit:
        return 0.0
    half, low, high = window_section(spec, dims.exit, step.rim)
    over, under, beside = high - dims.exit.high, dims.exit.low - low, half - dims.exit.width / 2
    gaps = ((over**3 + under**3) * dims.exit.width + 2 * beside**3 * dims.exit.height) / 1000**4
    length = window_length(moulds, step) / 1000
    head = max(step.rim - (dims.exit.low + dims.exit.high) / 2, 0.0) / 1000
    pressure = 1000 * float(material.density_g_cm3) * GRAVITY * head
    flow = gaps * pressure / (12 * float(material.mixed_viscosity_cps) / 1000 * length)
    seconds = 60 * at_room(float(material.pot_life_min), spec.casting.room_c)
    return len(dims.sides) * flow * seconds * 1e9


def print_min(spec: Spec, solid_mm3: float, tallest_mm: float) -> float:
    """Return roughly how long the pieces print, min: by volume in filament, by the tallest piece's layers in resin."""
    layer = spec.moulds.layer_mm
    if printer_of(spec).technology.value == "sla":
        return tallest_mm / layer * RESIN_LAYER_S / 60
    return solid_mm3 / (FDM_RATE * layer)


def window_length(moulds: MouldSet, step: Step) -> float:
    """Return how far a tongue lies in the wall of a pour's cup, mm."""
    lay = moulds.plan.layout
    return lay.cup[0] - max(abs(cell.x) for cell in lay.cells) - moulds.plan.dimensions.radii[step.index - 1]


def wall_range(spec: Spec, layer: int, off_axis_mm: float) -> tuple[float, float]:
    """Return the thinnest and thickest wall of a layer (from 0) whose cups stand up to `off_axis_mm` off the axis, mm.

    Layer 1 lies between the core and one cup position, each further layer between two.
    """
    off = off_axis_mm * (1 if layer == 0 else 2)
    wall = spec.layers[layer].wall_mm
    return max(wall - off, 0.0), wall + off
