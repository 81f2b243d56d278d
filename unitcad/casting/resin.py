"""Tools printed in resin: wells under the build plate, exposure, wash, cure, and a silicone that resin inhibits.

The printer pulls each layer off a film. A hollow that is open only at the plate or at the film is a well: the film
closes it, and the plate sucks at it until a window or an end opens it.

    build plate  =====================
                 |  land  :bore:  land |   rim on the plate: the bore is closed by plate, wall and film
                 |________:    :_______|
                           ~~~~            film, at the layer that is being made
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from manifold3d import CrossSection, Manifold, OpType

from unitcad.casting.figures import BAKE_H, MIXING_MIN, WEIGH_MIN, cure_hours, in_room
from unitcad.casting.sentences import say
from unitcad.casting.steps import BenchStep
from unitcad.casting.views import picture_path
from unitcad.catalogue import RESIN, Material, materials, surface_contact
from unitcad.moulds.cup import window_section
from unitcad.moulds.mould_set import MouldSet
from unitcad.spec import printer_of
from unitcad.text import join_words, number, spaced

ATMOSPHERE = 0.101
"""Pressure that holds a closed well at most, N/mm2."""
LEAST_WELL_ML = 0.05
"""A smaller well is no more than an engraving (assumed)."""
LEAST_STEP = 0.1
"""Height of the slices that are looked at, mm; the printer's layers if these are higher."""
_TOUCH_MM2, _FAR = 0.01, 1e4
DRIP_MIN, BATH_MIN = 10, 3
"""Times to drip off and of each bath, min (assumed)."""
SUPPORT_MM = 3.0
"""Height of supports under a rim (assumed)."""
DRY_MIN = 30
"""Time that a sealing coat dries (https://www.smooth-on.com/support/faq/129/), min."""


@dataclass(frozen=True)
class Well:
    """A hollow of a piece that the film closes: largest volume (mm3) and area (mm2), height at which it opens (mm)."""

    volume_mm3: float
    area_mm2: float
    opens_mm: float

    @property
    def force_n(self) -> float:
        """Largest force with which the film holds it, N."""
        return ATMOSPHERE * self.area_mm2


def in_resin(moulds: MouldSet) -> bool:
    """Tell whether the tools are printed in resin."""
    return printer_of(moulds.spec).technology.value == "sla"


def wells(piece: Manifold, layer_mm: float) -> list[Well]:
    """Return the wells of a piece in print attitude, the largest one first.

    Layer by layer, a hole belongs to the wells under it. All of them open together: to the outside of the same layer or
    of the one before, or to an open hole. A roof, and the piece's end, close them for good.
    """
    _, _, low, _, _, high = piece.bounding_box()
    count = max(round((high - low) / max(layer_mm, LEAST_STEP)), 1)
    step = (high - low) / count
    found, closed = list[Well](), list[_Hollow]()
    free = CrossSection()
    for i in range(count):
        solid = piece.slice(low + (i + 0.5) * step)
        filled = CrossSection.batch_boolean([_outline(part) for part in solid.decompose()], OpType.Add)
        outside = CrossSection.square((_FAR, _FAR), True) - filled
        holes = [_Hollow(hole, hole.area() * step, hole.area()) for hole in (filled - solid).decompose()]
        opened = [hole for hole in holes if _meet(hole.section, free)]
        leaking = [well for well in closed if _meet(well.section, outside)]
        while True:  # what opens one hollow may open others
            wells_too = [well for well in closed if well not in leaking and _any_over(opened, well)]
            leaking += wells_too
            holes_too = [hole for hole in holes if hole not in opened and _any_over(leaking, hole)]
            opened += holes_too
            if not wells_too and not holes_too:
                break
        free = CrossSection.batch_boolean([outside, *(hole.section for hole in opened)], OpType.Add)
        still = _joined([hole for hole in holes if hole not in opened], closed)
        ended = [well for well in closed if well in leaking or not _any_over(still, well)]
        found += [Well(well.volume_mm3, well.area_mm2, i * step) for well in ended]
        closed = still
    found += [Well(well.volume_mm3, well.area_mm2, count * step) for well in closed]
    return sorted(found, key=lambda well: -well.volume_mm3)


@dataclass(frozen=True, eq=False)
class _Hollow:
    """A hollow up to a layer: its section there, its volume and its largest area so far."""

    section: CrossSection
    volume_mm3: float
    area_mm2: float


def _outline(part: CrossSection) -> CrossSection:
    """Return a connected section without its holes."""
    return CrossSection([max(part.to_polygons(), key=lambda loop: CrossSection([loop]).area())])


def _meet(one: CrossSection, other: CrossSection) -> bool:
    return (one ^ other).area() > _TOUCH_MM2


def _any_over(hollows: Sequence[_Hollow], one: _Hollow) -> bool:
    return any(_meet(each.section, one.section) for each in hollows)


def _joined(holes: Sequence[_Hollow], below: Sequence[_Hollow]) -> list[_Hollow]:
    """Return the hollows that a layer's closed holes and the wells under them form; one well may go on in several."""
    groups = [([hole], [well for well in below if _meet(hole.section, well.section)]) for hole in holes]
    for well in below:
        same = [group for group in groups if well in group[1]]
        if len(same) > 1:
            united = [hole for group in same for hole in group[0]], _unique(well for group in same for well in group[1])
            groups = [group for group in groups if group not in same] + [united]
    return [_merged(*group) for group in groups]


def _unique(wells: Iterable[_Hollow]) -> list[_Hollow]:
    return list({id(well): well for well in wells}.values())


def _merged(holes: Sequence[_Hollow], below: Sequence[_Hollow]) -> _Hollow:
    section = CrossSection.batch_boolean([hole.section for hole in holes], OpType.Add)
    area, volume = (sum(getattr(hole, key) for hole in holes) for key in ("area_mm2", "volume_mm3"))
    return _Hollow(
        section,
        volume + sum(well.volume_mm3 for well in below),
        max([area, *(well.area_mm2 for well in below)]),
    )


def piece_wells(moulds: MouldSet) -> dict[str, Well]:
    """Return the largest well of each printed piece, by its name; of pieces without a notable one nothing."""
    layer, found = moulds.spec.moulds.layer_mm, dict[str, Well]()
    for piece in moulds.plan.pieces:
        if piece.made == "printed":
            mesh = moulds.mesh(piece.in_file)
            every = wells(mesh.rotate((180, 0, 0)) if piece.upside_down else mesh, layer)
            if every and every[0].volume_mm3 > 1000 * LEAST_WELL_ML:
                found[piece.name] = every[0]
    return found


def plate_sentences(moulds: MouldSet) -> list[str]:
    """Say how the plate is printed in resin: attitude, wells, exposure, draining."""
    said = [say("print_resin.flat"), say("print_resin.expose")]
    if found := piece_wells(moulds):
        each = [
            say(
                "print_resin.well",
                piece=moulds.plan.called(name),
                volume=number(well.volume_mm3 / 1000, 2),
                opens=number(well.opens_mm, 2),
                force=number(well.force_n, 2),
            )
            for name, well in found.items()
        ]
        said.append(say("print_resin.wells", wells="; ".join(each)))
        said.append(say("print_resin.supports", height=number(SUPPORT_MM, 2)))
    return [*said, say("print_resin.drip", minutes=DRIP_MIN)]


def clean_resin(moulds: MouldSet, silicones: Sequence[Material], away: str) -> Iterator[BenchStep]:
    """Describe how pieces of resin get clean and cured; `away`: the sentence on surfaces that inhibit a cure."""
    yield BenchStep(
        say("wash.title"),
        say("wash.text", minutes=BATH_MIN) + away,
        kind="rest",
        minutes=15.0,
        wait_min=30.0,
        required_tools=("isopropanol and lint-free wipes",),
    )
    exit = moulds.plan.dimensions.exit
    if exit and (steps := [step for step in moulds.plan.steps if moulds.plan.standing(step, "tongue")]):
        windows = [window_section(moulds.spec, exit, step.rim) for step in steps]
        height = number(min(high - low for _, low, high in windows), 2)
        yield BenchStep(
            say("clear_windows.title"),
            say("clear_windows.text", cups=join_words(spaced(step.cup) for step in steps), height=height),
            picture_path("pieces"),
            minutes=5.0 * len(steps),
            required_tools=("isopropanol and lint-free wipes", "rinsing syringe"),
        )
    yield BenchStep(
        say("bake.title"),
        say("bake.text", hours=number(BAKE_H, 2)),
        kind="cure",
        minutes=10.0,
        wait_min=60 * BAKE_H,
        required_tools=("oven", "curing lamp"),
    )
    room = moulds.spec.casting.room_c
    drops = {each.name: cure_hours(each, room) for each in silicones}
    each = ", ".join(f"{name} {in_room(hours, 'h', room)}" for name, hours in drops.items())
    yield BenchStep(
        say("test_cure.title"),
        say("test_cure.text", times=each, minutes=DRY_MIN) + _other_chemistry(moulds, silicones),
        kind="cure",
        minutes=WEIGH_MIN + MIXING_MIN,
        wait_min=60 * max(drops.values()),
        required_tools=("acrylic varnish",),
    )


def _other_chemistry(moulds: MouldSet, silicones: Sequence[Material]) -> str:
    """Name the silicones of tin that resin does not inhibit, with their moduli next to those of the cast silicones."""
    if not any(surface_contact(each, RESIN) for each in silicones):
        return ""
    tin = [
        each for each in materials(moulds.spec.materials).values() if each.chemistry and each.chemistry.value == "tin"
    ]
    if not tin:
        return ""
    ours, yours = (join_words(map(_stiffness, each)) for each in (tin, silicones))
    return f" {say('test_cure.tin', tin=ours, yours=yours)}"


def _stiffness(silicone: Material) -> str:
    """Write a silicone with its modulus, or its hardness if no source gives one."""
    for key, words in (("quasistatic_modulus_kpa", "static modulus"), ("modulus_100pct_kpa", "modulus at 100 %")):
        if value := getattr(silicone, key):
            return f"{silicone.name} ({words} {number(value, 2)} kPa)"
    hardness = f"Shore {silicone.shore.value}, " if silicone.shore else ""
    return f"{silicone.name} ({hardness}no source gives its modulus)"
