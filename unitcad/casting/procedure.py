"""The casting procedure as data: what a person does, in order, with every figure's source; `written` writes it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from unitcad import catalogue
from unitcad.casting import figures as fig
from unitcad.casting.bench_step import BenchStep
from unitcad.casting.bench_views import views
from unitcad.casting.bill import Item, bill
from unitcad.casting.eccentricity import UNEVEN, Eccentricity, eccentricity
from unitcad.casting.figures import Figure, Mix, sourced
from unitcad.casting.finishing import measurements, motor_in, release, smears
from unitcad.casting.in_short import LATE, STAY
from unitcad.casting.instructions import pour_steps
from unitcad.casting.layer_grid import OffGrid, UnitHeight, off_grid, unit_heights
from unitcad.casting.needs import needs
from unitcad.casting.preparation import preparation, printing, tunnels
from unitcad.casting.release_agent import BondFace, Face, agent_faces, bond_faces
from unitcad.casting.time_line import Phase, phases
from unitcad.catalogue import Material
from unitcad.designs.rib_leaves import leaf_mm
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.plan import Step
from unitcad.spec import Spec, printer_of
from unitcad.text import number


@dataclass(frozen=True)
class Pour:
    """One pour: its figures, the verdict on bubbles, what the person does, and the drawing of it assembled.

    `agent`: the faces that may get release agent before it. `degassing_min`: in the vacuum; 0 without one.
    Times are those of the room. `drawing` is the section, each step's picture is in 3D.
    """

    index: int
    layer: str
    material: str
    figures: tuple[Figure, ...]
    verdict: str
    agent: tuple[Face, ...]
    degassing_min: float
    part_a_g: float
    part_b_g: float
    pot_life_min: float
    cure_h: float
    steps: tuple[BenchStep, ...]
    drawing: str


@dataclass(frozen=True)
class Procedure:
    """A whole casting: numbered steps run on from `preparation` through the pours to `assembly`.

    `earliest_finish_min`: from the first step, the pieces just printed, until the units are out of the mould, of which
    `bench_min` with a person at the bench; `time_line` goes on until the motor is in. `printing` says what to print.

    `makes`: what comes out; `last`: what `assembly` does.
    `bonds` are the tools' faces that must never get release agent.
    `tunnels`: the cups whose windows resin may cure shut.
    `eccentricity` is that of the cups on the core, `without_ribs` what it would be without what centres them; None
    where there are no cups.
    `walls` is () where the tooling is not concentric: nothing tells which of its walls a cup's play changes.
    """

    name: str
    label: str
    cells: int
    vacuum: bool
    tunnels: tuple[str, ...]
    earliest_finish_min: float
    bench_min: float
    time_line: tuple[Phase, ...]
    printing: tuple[str, ...]
    preparation: tuple[BenchStep, ...]
    off_grid: tuple[OffGrid, ...]
    unit_heights: tuple[UnitHeight, ...]
    pours: tuple[Pour, ...]
    bonds: tuple[BondFace, ...]
    release: tuple[BenchStep, ...]
    assembly: tuple[BenchStep, ...]
    measure: tuple[str, ...]
    eccentricity: Eccentricity | None
    without_ribs: Eccentricity | None
    walls: tuple[Figure, ...]
    bill: tuple[Item, ...]
    makes: str = "unit"
    last: str = "Motor in"


def pour_of(
    moulds: MouldSet,
    step: Step,
    silicone: Material,
    mix: fig.Mix,
    volume: float,
    verdict: str,
    steps: Sequence[BenchStep],
    agent: Sequence[Face] = (),
) -> Pour:
    """Return the record of a pour: `volume` of what it casts, mm3; `agent` as in `Pour`."""
    casting = moulds.spec.casting
    return Pour(
        index=step.index,
        layer=step.name,
        material=silicone.name,
        figures=pour_figures(moulds, step, silicone, mix, volume),
        verdict=verdict,
        agent=tuple(agent),
        degassing_min=fig.DEGASSING_MIN if casting.vacuum else 0.0,
        part_a_g=mix.part_a_g,
        part_b_g=mix.part_b_g,
        pot_life_min=fig.at_room(float(silicone.pot_life_min), casting.room_c),
        cure_h=fig.at_room(float(silicone.cure_h), casting.room_c),
        steps=tuple(steps),
        drawing=f"step{step.index}-section.svg",
    )


def procedure(moulds: MouldSet, layer_volumes_mm3: Sequence[float], printed_mm3: float) -> Procedure:
    """Return the procedure of a mould set: nothing is meshed or drawn.

    `layer_volumes_mm3`: of each layer of one unit, from the inside out. `printed_mm3`: of all printed pieces.
    """
    spec, plan = moulds.spec, moulds.plan
    known = catalogue.materials(spec.materials)
    edges, shown = moulds.once_a_geometry("off grid", lambda blank: tuple(off_grid(blank))), views(moulds)
    centred, free = eccentricity(moulds), eccentricity(moulds, with_ribs=False)
    pours, mixes, grams = [], [], []
    for step, volume in zip(plan.steps, layer_volumes_mm3, strict=True):
        silicone = known[step.material]
        poured = volume * len(step.layer) / moulds.pieces(step.name)
        mix = fig.mix(spec, silicone, poured + fig.channels_mm3(step))
        verdict = bubbles(spec, step, silicone, mix, len(plan.layout.cells))
        pours.append(
            pour_of(
                moulds,
                step,
                silicone,
                mix,
                volume,
                verdict,
                tuple(pour_steps(moulds, step, silicone, mix, verdict, shown)),
                agent_faces(moulds, step),
            )
        )
        mixes.append((silicone, mix))
        grams.append(volume * float(silicone.density_g_cm3) / 1000)
    prepared = tuple(preparation(moulds, shown, list(dict.fromkeys(silicone for silicone, _ in mixes))))
    out = tuple(release(moulds, mixes[0][0]))
    motor = tuple(motor_in(moulds, [silicone for silicone, _ in mixes]))
    stages = [
        ("preparation", prepared),
        *((f"pour {pour.index}", pour.steps) for pour in pours),
        ("out of the mould", out),
    ]
    until, line = phases(stages), phases([*stages, ("motor in", motor)])
    return Procedure(
        name=spec.name,
        label=plan.label,
        cells=len(plan.layout.cells),
        vacuum=spec.casting.vacuum,
        tunnels=tunnels(moulds),
        earliest_finish_min=until[-1].end_min,
        bench_min=sum(phase.bench_min for phase in until),
        time_line=line,
        printing=printing(moulds, printed_mm3),
        preparation=prepared,
        off_grid=edges,
        unit_heights=moulds.once_a_geometry("unit heights", lambda blank: tuple(unit_heights(blank))),
        pours=tuple(pours),
        bonds=bond_faces(moulds),
        release=out,
        assembly=motor,
        measure=tuple(measurements(moulds, grams, _printed_slot_height(moulds, edges))),
        eccentricity=centred,
        without_ribs=free,
        walls=tuple(_walls(spec, free, centred)) if plan.concentric else (),
        makes=moulds.makes,
        bill=bill(
            moulds,
            mixes,
            needs([*prepared, *(step for pour in pours for step in pour.steps), *out, *motor]),
            smears(moulds, [silicone for silicone, _ in mixes]),
        ),
    )


def pour_figures(moulds: MouldSet, step: Step, silicone: Material, mix: Mix, volume: float) -> tuple[Figure, ...]:
    casting, room = moulds.spec.casting, moulds.spec.casting.room_c
    by_temperature = "assumed: half the time for every 10 K more; at 23 degC "
    digit = f"half of {number(casting.scale_resolution_g, 3)} g"
    practice = "assumed: usual practice"
    channels = " + sprue and vents" if step.channels else ""
    # An array's layers are drawn of all units together.
    whole = len(step.layer) // moulds.pieces(step.name) != len(moulds.plan.layout.cells)
    what, times = ("volume of this pour", "volume") if whole else ("volume of one layer", "volume x cavities")
    taken = f"({times}{channels})" if channels or not whole else times
    figures = [
        Figure(what, volume, "mm3", "computed: the drawn layer's mesh"),
        *([Figure("sprue and vents", fig.channels_mm3(step), "mm3", "computed: as drawn")] if channels else []),
        Figure("density", float(silicone.density_g_cm3), "g/cm3", sourced(silicone.density_g_cm3)),
        Figure("in the cavities, net", mix.net_g, "g", f"computed: {taken} x density"),
        Figure(
            "to mix",
            mix.mix_g,
            "g",
            f"assumed: {casting.waste:.0%} more, at least {number(casting.minimum_mix_g, 3)} g",
        ),
        *([_held_back(mix)] if mix.syringe_ml else []),
        Figure("part A", mix.part_a_g, "g", "mix ratio, " + sourced(silicone.mix_ratio)),
        Figure("part B", mix.part_b_g, "g", "mix ratio, " + sourced(silicone.mix_ratio)),
        Figure("scale's error on a part, net", mix.net_error_pct, "%", digit),
        Figure("scale's error on a part, mixed", mix.mix_error_pct, "%", digit),
        Figure(
            "pot life in this room",
            fig.at_room(float(silicone.pot_life_min), room),
            "min",
            by_temperature + sourced(silicone.pot_life_min),
        ),
        Figure("mixing", fig.MIXING_MIN, "min", practice),
        Figure("pouring and striking off", fig.pouring_min(len(moulds.plan.layout.cells)), "min", practice),
        Figure("viscosity, mixed", float(silicone.mixed_viscosity_cps), "cps", sourced(silicone.mixed_viscosity_cps)),
        Figure("depth of this pour", step.rim, "mm", "computed: the rim over the seat"),
        Figure(
            f"rise of a {fig.BUBBLE_MM} mm bubble through it",
            fig.bubble_rise_s(step.rim, silicone) / 60,
            "min",
            "computed: Stokes' law at the viscosity just mixed, so optimistic; the bubble is assumed",
        ),
        *(_vacuum(mix) if casting.vacuum else ()),
        Figure(
            "cure in this room",
            fig.at_room(float(silicone.cure_h), room),
            "h",
            by_temperature + sourced(silicone.cure_h),
        ),
    ]
    if weep := fig.weep_mm3(moulds, step, silicone):
        pressure = "; the syringe's pressure comes on top" if step.lid else ""
        source = f"computed: flow in the clearance under the pour's own weight{pressure}"
        figures.append(Figure("weep by the windows, no grease", 100 * weep / volume, "% of a layer", source))
    return tuple(figures)


def _held_back(mix: Mix) -> Figure:
    source = f"net, and {number(fig.HELD_BACK_ML, 2)} ml that tip and plunger keep (assumed)"
    return Figure("to draw into the syringe, at least", mix.syringe_ml, "ml", source)


def _vacuum(mix: Mix) -> tuple[Figure, ...]:
    """Return what holds for degassing."""
    pressure = f"assumed: usual advice; {number(fig.VACUUM_INHG * fig.KPA_PER_INHG, 3)} kPa below the room's pressure"
    return (
        Figure("degassing", fig.DEGASSING_MIN, "min", "assumed: usual practice"),
        Figure(
            "degassing container, at least", fig.CONTAINER * mix.millilitres, "ml", "assumed: 4 x the mix, it foams up"
        ),
        Figure("vacuum", fig.VACUUM_INHG, "inHg", pressure),
    )


def bubbles(spec: Spec, step: Step, silicone: Material, mix: Mix, cells: int) -> str:
    """Say how the bubbles leave: in the vacuum, or by themselves, for which a quarter of the pot life is allowed."""
    pot = fig.at_room(float(silicone.pot_life_min), spec.casting.room_c)
    work = fig.MIXING_MIN + fig.pouring_min(cells)
    if spec.casting.vacuum:
        work += fig.DEGASSING_MIN
        said = (
            f"Degas for {number(fig.DEGASSING_MIN, 3)} min (assumed) at {number(fig.VACUUM_INHG, 3)} inHg, in a "
            f"container of at least {number(fig.CONTAINER * mix.millilitres, 2)} ml: the silicone foams up and falls "
            "back, then single bubbles rise. Let the air in slowly."
        )
    else:
        rise, allowed = fig.bubble_rise_s(step.rim, silicone) / 60, fig.WITHOUT_VACUUM * pot
        stokes = (
            f"No vacuum (casting.vacuum): a bubble of {number(fig.BUBBLE_MM, 3)} mm takes {number(rise, 2)} min "
            f"through {number(step.rim, 3)} mm (Stokes, at the viscosity just mixed). That is optimistic, since "
            f"silicone thickens from the start: a quarter of the pot life, {number(allowed, 2)} min, is allowed."
        )
        work += fig.rest_min(spec, step.rim, silicone)
        where = "stand the syringe up, its tip up," if step.lid else "leave the mould alone"
        clears = f"Such bubbles should rise out: {where} for {number(rise, 2)} min."
        brush = "brush a thin coat of the mix now onto all that it will touch, then pour in a thread from one side"
        stand = f"stand the syringe up, its tip up, for {number(allowed, 2)} min, push out the air, and inject slowly"
        stays = f"{STAY}: get a vacuum, or {stand if step.lid else brush}."
        said = f"{stokes} {clears if rise <= allowed else stays}"
    late = work - pot
    slower = f" {LATE} {number(late, 2)} min after the pot life: cool the room, or take a slower silicone."
    return f"{said}{slower if late > 0 else ''}"


def _printed_slot_height(moulds: MouldSet, edges: Sequence[OffGrid]) -> float | None:
    """Return the thickness that the slicer gives a printed tongue, mm; None where it is the drawn one."""
    if all(tool.made != "printed" for tool in moulds.plan.of_kind("tongue")):
        return None
    return next((edge.nearest_mm for edge in edges if edge.piece == "tongue"), None)


def _walls(spec: Spec, without: Eccentricity, made: Eccentricity) -> list[Figure]:
    """Return how far the cups stand off the core's axis, and what that makes of the walls."""
    off = number(made.off_mm, 3)

    def at_most(what: str, each: Eccentricity, how: str) -> Figure:
        worst = f"; {number(each.at_worst_mm, 2)} where the gap is printed {off} mm off, the printer's play"
        return Figure(f"cups off the core's axis, {what}, at most", each.as_drawn_mm, "mm", f"computed: {how}{worst}")

    clearance = number(spec.moulds.plinth_clearance_mm, 3)
    figures = [at_most("without ribs", without, f"clearance of {clearance} mm a side x sqrt 2")]
    if made.ribs:
        pressed = "pushed back on leaves" if leaf_mm(printer_of(spec)) else "crushed"
        how = f"balance of {made.ribs} ribs that are {pressed} by {number(spec.moulds.rib_interference_mm, 3)} mm, "
        figures.append(at_most("with ribs", made, f"{how}each up to {UNEVEN:.0%} stronger or weaker (assumed)"))
    times = "1 x for Layer 1, 2 x beyond it" if len(spec.layers) > 1 else "1 x"
    source = f"computed: cups up to {number(made.at_worst_mm, 2)} mm off the axis, {times}"
    return figures + [
        Figure(f"layer {i + 1} wall, {extreme}", wall, "mm", source)
        for i in range(len(spec.layers))
        for extreme, wall in zip(("thinnest", "thickest"), fig.wall_range(spec, i, made.at_worst_mm), strict=True)
    ]
