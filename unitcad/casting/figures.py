"""The numbers of a casting procedure, each with its source: grams, times, strains, play. Pure arithmetic on a spec."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

from unitcad.catalogue import Material, Value, materials, needed
from unitcad.errors import UNIT_ALONE, Refusal
from unitcad.moulds.cup import ribs
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.plan import Step
from unitcad.shape import exact_volume
from unitcad.spec import Spec, printer_of
from unitcad.text import join_words, number

GRAVITY = 9.80665
BUBBLE_MM = 0.2
"""Diameter of the smallest bubble that a hand-poured layer should be rid of (assumed)."""
CONTAINER = 4.0
"""Volume of the degassing container over the mix: silicone foams up under vacuum (maker's advice: 3 to 4 times)."""
VACUUM_INHG, KPA_PER_INHG = 29.0, 3.386389
MIXING_MIN, DEGASSING_MIN, POURING_MIN = 3.0, 3.0, 2.0
"""Parts of the pot life spent before and after the bubbles (assumed: usual practice)."""
LAY_IN_MIN, WEIGH_MIN, STRIKE_MIN, PULL_MIN, LIFT_MIN, PEEL_MIN, PER_CAVITY_MIN = 5.0, 5.0, 1.0, 1.0, 2.0, 3.0, 0.5
"""A person's time for repeated steps (assumed), as all `minutes` and waits of the time line.
Laying in, pulling and peeling are for one cavity; `PER_CAVITY_MIN` is the pouring time of each further one."""
BAKE_H = 8.0
STRIKE_AGAIN_MIN = 10.0
"""Time at which leaked or sunk silicone is topped up and struck off again (assumed)."""
ADHESIVE_CURE_H = 24.0
"""A one-part silicone adhesive cures 2 mm deep in a day (maker's sheet of Momentive IS5628E)."""
HELD_BACK_ML = 0.5
"""Silicone that remains in a syringe's tip and plunger (assumed: a 5 to 10 ml syringe, a wide tip)."""
WITHOUT_VACUUM = 0.25
"""Share of the pot life in which bubbles must rise out by themselves (assumed): after it silicone is too thick."""
FDM_RATE = 950.0
"""Volume of the pieces, solid, that a filament printer makes in a minute, mm3 for each mm of its layers' height."""
FDM_ERROR = 0.64, 1.22
"""PrusaSlicer's time over that of this rate, least and most: eight sets of units and six of arrays were sliced.
Thick pieces are mostly infill and print faster."""
RESIN_LAYER_S = 10.0
"""Time of a resin printer for a layer, s (assumed)."""
MOST_ERROR_PCT = 5.0
"""Error of the ratio by the scale at which a cure begins to suffer (assumed)."""
CASTING_NEEDS = {"mix_ratio": "mix ratio", "cure_h": "cure time", "elongation_pct": "elongation at break"}
"""Values of a silicone without which there is no casting: grams, times, and the strain at which it tears."""
DATASHEET_C = 23.0
DOUBLING_K = 10.0
"""A cure runs twice as fast 10 K warmer (assumed): the lower end of van 't Hoff's rule, two to four times.

J. H. van 't Hoff, Études de dynamique chimique, 1884. No bulletin of a silicone gives a factor.
"""
RULE_OF_THUMB = "van 't Hoff's rule of thumb, twice as fast 10 K warmer"
OTHER_ROOM_K = 5.0
"""Step to the colder and the warmer room whose times are written next to those of the room."""


@dataclass(frozen=True)
class Figure:
    """One number: its name, value and unit, and its origin (a source, a formula, or 'assumed: ...')."""

    name: str
    value: float
    unit: str
    source: str


def source_text(value: Value) -> str:
    """Return a catalogue value's origin in words: its status, then its source."""
    return f"{value.status}: {value.source}"


FOAMS = "assumed: 4 x the mix, it foams up"
SYRINGES_ML = 5.0, 10.0, 20.0, 30.0, 60.0, 100.0
"""The sizes that syringes are sold in, ml; larger mixes take more than one filling."""


@dataclass(frozen=True)
class Mix:
    """Grams of one pour: in all cavities (and channels), to weigh in, of each part, and the error by half a digit.

    `millilitres` is the whole mix, `syringe_ml` the volume to draw in for an injected pour, 0 for an open one.
    """

    net_g: float
    mix_g: float
    part_a_g: float
    part_b_g: float
    mix_error_pct: float
    millilitres: float
    syringe_ml: float = 0.0

    @property
    def syringe_size_ml(self) -> float:
        """The smallest syringe for the whole mix, otherwise the largest there is, ml."""
        return next((size for size in SYRINGES_ML if size >= self.millilitres), SYRINGES_ML[-1])


def for_casting(material: Material, key: str) -> Value[float]:
    """Return a value that no casting can do without. Raises Refusal if no source gives it."""
    return needed(material, key, "casting")


def not_castable(material: Material) -> list[str]:
    """Return the keys without which a silicone can't be cast, and which no source gives."""
    return [key for key in CASTING_NEEDS if getattr(material, key) is None]


def check_castable(moulds: MouldSet) -> None:
    """Raise Refusal if there are no moulds, or a silicone of a pour lacks a value without which it can't be cast."""
    known = materials(moulds.spec.materials)
    for step in moulds.plan.steps:
        for key in not_castable(known[step.material]):
            try:
                for_casting(known[step.material], key)
            except Refusal as refusal:
                raise Refusal(refusal.field, None, f"{refusal.limit}{UNIT_ALONE}") from None


def cure_hours(material: Material, room_c: float) -> float:
    """Return how long a silicone cures in the room."""
    return at_room(float(for_casting(material, "cure_h")), room_c)


def pot_life(material: Material, room_c: float) -> float | None:
    """Return the pot life in the room, min; None if no source gives it."""
    return at_room(float(material.pot_life_min), room_c) if material.pot_life_min else None


def mix(spec: Spec, material: Material, volume_mm3: float, *, injected: bool) -> Mix:
    """Return the weights for `volume_mm3` of silicone; errors are half the scale's digit over the smaller part."""
    casting, ratio = spec.casting, float(for_casting(material, "mix_ratio"))
    net = volume_mm3 * float(material.density_g_cm3) / 1000
    density = float(material.density_g_cm3)
    syringe = net / density + HELD_BACK_ML if injected else 0.0
    # The waste remains in the mixing cup; the rest in the syringe comes on top.
    total = max(net * (1 + casting.waste) + (HELD_BACK_ML * density if syringe else 0.0), casting.minimum_mix_g)
    share = ratio / (1 + ratio)
    error = 100 * casting.scale_resolution_g / 2 / (total * min(share, 1 - share))
    return Mix(net, total, total * share, total * (1 - share), error, total / density, syringe)


def bubble_rise_s(depth_mm: float, material: Material, bubble_mm: float = BUBBLE_MM) -> float | None:
    """Return the seconds that a bubble takes through a depth by Stokes' law, at the viscosity just mixed: optimistic.

    None if no source gives the viscosity. v = 2/9 (density of silicone) g radius^2 / viscosity; the air's own density
    is ignored.
    """
    if material.mixed_viscosity_cps is None:
        return None
    density, viscosity = 1000 * float(material.density_g_cm3), float(material.mixed_viscosity_cps) / 1000
    speed = 2 / 9 * density * GRAVITY * (bubble_mm / 2000) ** 2 / viscosity
    return depth_mm / 1000 / speed


def pouring_min(cells: int) -> float:
    """Return the minutes to pour and strike off so many cavities."""
    return POURING_MIN + PER_CAVITY_MIN * (cells - 1)


def at_room(value: float, room_c: float) -> float:
    """Convert a time at 23 degC (pot life, cure) to the room's temperature, by the rule of thumb above."""
    return value * 2 ** ((DATASHEET_C - room_c) / DOUBLING_K)


def in_room(value: float, unit: str, room_c: float) -> str:
    """Write a time of the room with its temperature: "30 min at 23 degC"."""
    return f"{number(value, 2)} {unit} at {number(room_c, 3)} degC"


def other_rooms(room_c: float) -> str:
    """Say what a colder and a warmer room do to pot life and cure."""
    colder, warmer = room_c - OTHER_ROOM_K, room_c + OTHER_ROOM_K
    longer, shorter = (number(at_room(1.0, room) / at_room(1.0, room_c), 2) for room in (colder, warmer))
    return (
        f"At {number(colder, 3)} degC pot life and cure take {longer} times as long, at {number(warmer, 3)} degC "
        f"{shorter} times ({RULE_OF_THUMB})."
    )


def print_min(spec: Spec, solid_mm3: float, tallest_mm: float) -> float:
    """Return roughly how long the pieces print, min: by volume in filament, by the tallest piece's layers in resin."""
    layer = spec.moulds.layer_mm
    if printer_of(spec).technology.value == "sla":
        return tallest_mm / layer * RESIN_LAYER_S / 60
    return solid_mm3 / (FDM_RATE * layer)


def window_length(moulds: MouldSet, step: Step) -> float:
    """Return the length of a tongue inside the wall of a pour's cup, mm."""
    lay = moulds.plan.layout
    return lay.cup[0] - max(abs(cell.x) for cell in lay.cells) - moulds.plan.dimensions.radii[step.index - 1]


@dataclass(frozen=True)
class AfterPours:
    """Silicone that is mixed after the pours, for the `use` of a `Fitting`; `grams` of both parts."""

    silicone: Material
    use: str
    grams: float


@dataclass(frozen=True)
class Batch:
    """The silicone of one pour: `volume_mm3` is that of its layer, `cells` the number of units."""

    moulds: MouldSet
    step: Step
    silicone: Material
    volume_mm3: float
    cells: int

    @cached_property
    def mix(self) -> Mix:
        """Weights for all cavities and channels."""
        poured = self.volume_mm3 * len(self.step.layer) / self.step.solids
        return mix(self.moulds.spec, self.silicone, poured + self.channels_mm3, injected=self.step.injected)

    @property
    def channels_mm3(self) -> float:
        """The volume of sprues and vents."""
        return sum(map(exact_volume, self.step.channels))

    @property
    def vacuum(self) -> bool:
        """Whether it is degassed."""
        return self.moulds.spec.casting.vacuum

    @property
    def pot_min(self) -> float | None:
        """The pot life in the room; None if no source gives it."""
        return pot_life(self.silicone, self.moulds.spec.casting.room_c)

    @property
    def cure_h(self) -> float:
        """The cure in the room."""
        return cure_hours(self.silicone, self.moulds.spec.casting.room_c)

    @property
    def rise_min(self) -> float | None:
        """How long bubbles take to rise out; None if no source gives the viscosity."""
        seconds = bubble_rise_s(self.step.rim, self.silicone)
        return None if seconds is None else seconds / 60

    @property
    def unknown(self) -> tuple[str, ...]:
        """The values that the procedure would show, but no source gives."""
        values = {"pot life": self.silicone.pot_life_min, "viscosity": self.silicone.mixed_viscosity_cps}
        return tuple(name for name, value in values.items() if value is None)

    @property
    def rest_min(self) -> float:
        """How long bubbles rise by themselves without a vacuum; 0 if an open pour would wait in vain.

        In a syringe bubbles that do not rise in time still gather at its tip: wait the whole allowance.
        """
        if self.pot_min is None:
            return 0.0
        allowed, injected = WITHOUT_VACUUM * self.pot_min, self.step.injected
        rise = math.inf if self.rise_min is None else self.rise_min
        return min(rise, allowed) if injected or rise <= allowed else 0.0

    @property
    def bubbles_stay(self) -> bool:
        """Whether bubbles do not rise out by themselves in a quarter of the pot life, and no vacuum draws them out.

        False if that is not known.
        """
        rise, pot = self.rise_min, self.pot_min
        return not self.vacuum and rise is not None and pot is not None and rise > WITHOUT_VACUUM * pot

    @property
    def over_pot_life_min(self) -> float:
        """The time of mixing and pouring beyond the pot life; 0 if it is long enough, or not known."""
        if self.pot_min is None:
            return 0.0
        bubbles = DEGASSING_MIN if self.vacuum else self.rest_min
        return max(MIXING_MIN + pouring_min(self.cells) + bubbles - self.pot_min, 0.0)

    @property
    def verdict(self) -> str:
        """How bubbles leave: in the vacuum, or by themselves, for which a quarter of the pot life is allowed."""
        if self.vacuum:
            said = (
                f"Degas for {number(DEGASSING_MIN, 3)} min at {number(VACUUM_INHG, 3)} inHg: it foams up and falls "
                "back. Let the air in slowly."
            )
        else:
            rise, pot = self.rise_min, self.pot_min
            where = "stand the syringe up, its tip up," if self.step.injected else "leave the mould alone"
            brush = "brush a thin coat of the mix now onto all that it will touch, then pour in a thread from one side"
            wait = "a quarter of the pot life" if pot is None else f"{number(WITHOUT_VACUUM * pot, 2)} min"
            stand = f"{where} for {wait}, push out the air, and inject slowly"
            way_out = f"get a vacuum, or {stand if self.step.injected else brush}"
            if rise is None or pot is None:
                lacks = join_words(self.unknown)
                said = f"No vacuum, and no source gives the {lacks}, so bubbles may stay: {way_out}."
            else:
                said = (
                    f"No vacuum: a bubble of {number(BUBBLE_MM, 3)} mm rises through {number(self.step.rim, 3)} mm in "
                    f"{number(rise, 2)} min at best (Stokes), and {wait}, a quarter of the pot life, are allowed. "
                )
                said += (
                    f"Such bubbles stay: {way_out}."
                    if self.bubbles_stay
                    else f"Such bubbles should rise out: {where} for {number(rise, 2)} min."
                )
        if not self.over_pot_life_min:
            return said
        over = number(self.over_pot_life_min, 2)
        return f"{said} All this ends {over} min after the pot life: cool the room, or take a slower silicone."

    @property
    def figures(self) -> tuple[Figure, ...]:
        """All numbers of the pour with their sources."""
        casting, step, silicone, mix = self.moulds.spec.casting, self.step, self.silicone, self.mix
        cells = len(self.moulds.plan.layout.cells)
        by_temperature = f"assumed: {RULE_OF_THUMB}; at {number(DATASHEET_C, 3)} degC "
        digit = f"half of {number(casting.scale_resolution_g, 3)} g"
        practice = "assumed: usual practice"
        channels = " + sprue and vents" if step.channels else ""
        # An array's layers are drawn of all units together.
        whole = len(step.layer) // step.solids != cells
        what, times = ("volume of this pour", "volume") if whole else ("volume of one layer", "volume x cavities")
        taken = f"({times}{channels})" if channels or not whole else times
        more = f"assumed: {casting.waste:.0%} more, at least {number(casting.minimum_mix_g, 3)} g"
        held_back = f"net, and {number(HELD_BACK_ML, 2)} ml that tip and plunger keep (assumed)"
        stokes = "computed: Stokes' law at the viscosity just mixed, so optimistic"
        ratio = f"mix ratio, {source_text(for_casting(silicone, 'mix_ratio'))}"
        cure = source_text(for_casting(silicone, "cure_h"))
        pot, viscosity = silicone.pot_life_min, silicone.mixed_viscosity_cps
        pot_min, rise_min = self.pot_min, self.rise_min
        kpa = f"assumed: usual advice; {number(VACUUM_INHG * KPA_PER_INHG, 3)} kPa below the room's pressure"
        rows = (
            (what, self.volume_mm3, "mm3", "computed: the drawn layer's mesh"),
            channels and ("sprue and vents", self.channels_mm3, "mm3", "computed: as drawn"),
            ("density", float(silicone.density_g_cm3), "g/cm3", source_text(silicone.density_g_cm3)),
            ("in the cavities, net", mix.net_g, "g", f"computed: {taken} x density"),
            ("to mix", mix.mix_g, "g", more),
            mix.syringe_ml and ("to draw into the syringe, at least", mix.syringe_ml, "ml", held_back),
            ("part A", mix.part_a_g, "g", ratio),
            ("part B", mix.part_b_g, "g", ratio),
            ("scale's error on a part", mix.mix_error_pct, "%", digit),
            pot and pot_min and ("pot life in this room", pot_min, "min", by_temperature + source_text(pot)),
            ("mixing", MIXING_MIN, "min", practice),
            ("pouring and striking off", pouring_min(cells), "min", practice),
            viscosity and ("viscosity, mixed", float(viscosity), "cps", source_text(viscosity)),
            ("depth of this pour", step.rim, "mm", "computed: the rim over the seat"),
            rise_min and (f"rise of a {BUBBLE_MM} mm bubble through it", rise_min, "min", stokes),
            self.vacuum and ("degassing", DEGASSING_MIN, "min", practice),
            self.vacuum and ("degassing container, at least", CONTAINER * mix.millilitres, "ml", FOAMS),
            self.vacuum and ("vacuum", VACUUM_INHG, "inHg", kpa),
            ("cure in this room", self.cure_h, "h", by_temperature + cure),
        )
        return tuple(Figure(*row) for row in rows if isinstance(row, tuple))


UNEVEN = 0.3
"""By how much a rib may be stronger or weaker than the others, as a share.

Assumed: a line more or less; of a leaf, a tenth of its thickness.
"""


@dataclass(frozen=True)
class Eccentricity:
    """The largest distance of a bore from the core's axis, mm, if the gap is printed as drawn, and if it is not."""

    ribs: int
    as_drawn_mm: float
    at_worst_mm: float


def eccentricity(moulds: MouldSet) -> Eccentricity:
    """Return the eccentricity of a set's cups, on ribs or without."""
    lengths = moulds.spec.moulds
    clearance, off, depth = lengths.plinth_clearance_mm, lengths.xy_play_mm, lengths.rib_interference_mm
    standing = ribs(moulds.frame)
    if not standing:
        return Eccentricity(0, math.sqrt(2) * clearance, math.sqrt(2) * (clearance + off))
    # A gap can't be narrower than nothing; one wider than the ribs reach leaves the rest as play. Of opposite ribs one
    # is stronger by UNEVEN and the other weaker, along x and along y.
    tight = math.sqrt(2) * UNEVEN * (depth + min(off, clearance))
    loose = math.sqrt(2) * max(off - depth, 0.0)
    return Eccentricity(len(standing), math.sqrt(2) * UNEVEN * depth, max(tight, loose))
