"""The casting procedure as data: what a person does, in order, with every figure's source; `casting_text` writes it.

A procedure is made from a spec, its plan and the volumes of its layers; nothing here meshes or draws.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from unitcad import catalogue
from unitcad.casting import figures as fig
from unitcad.casting.bill import Item, bill
from unitcad.casting.figures import Figure, Mix, sourced
from unitcad.casting.instructions import measurements, pour_steps, preparation, release
from unitcad.casting.layer_grid import OffGrid, off_grid
from unitcad.catalogue import Material
from unitcad.designs import Dimensions
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.plan import Plan, Step
from unitcad.shape import exact_volume
from unitcad.spec import Spec, printer_of


@dataclass(frozen=True)
class Pour:
    """One pour: its figures, the verdict on bubbles, what the person does, and the drawing of it assembled."""

    index: int
    layer: str
    material: str
    figures: tuple[Figure, ...]
    verdict: str
    steps: tuple[str, ...]
    drawing: str


@dataclass(frozen=True)
class Procedure:
    """A whole casting: numbered steps run on from `preparation` through the pours to `assembly`."""

    name: str
    label: str
    cells: int
    preparation: tuple[str, ...]
    off_grid: tuple[OffGrid, ...]
    pours: tuple[Pour, ...]
    release: tuple[str, ...]
    assembly: tuple[str, ...]
    measure: tuple[str, ...]
    walls: tuple[Figure, ...]
    bill: tuple[Item, ...]


def procedure(moulds: MouldSet, layer_volumes_mm3: Sequence[float]) -> Procedure:
    """Return the procedure of a mould set. `layer_volumes_mm3`: of each layer of one unit, from the inside out."""
    spec, plan, dims = moulds.spec, moulds.plan, moulds.plan.dimensions
    known = catalogue.materials(spec.materials)
    silicones = [known[layer.material] for layer in spec.layers]
    mixes = [
        fig.mix(spec, silicone, len(plan.layout.cells) * volume + _channels_mm3(step))
        for silicone, volume, step in zip(silicones, layer_volumes_mm3, plan.steps, strict=True)
    ]
    edges = tuple(off_grid(spec, dims))
    grams = [
        volume * float(silicone.density_g_cm3) / 1000
        for silicone, volume in zip(silicones, layer_volumes_mm3, strict=True)
    ]
    resin = printer_of(spec).technology.value == "sla"
    pours = []
    for i, (step, silicone, mix, volume) in enumerate(
        zip(plan.steps, silicones, mixes, layer_volumes_mm3, strict=True)
    ):
        numbers, verdict = _figures(spec, dims, plan, i, silicone, mix, volume), _verdict(spec, step, silicone)
        steps = pour_steps(spec, plan, step, silicone, mix, verdict)
        pours.append(
            Pour(step.index, step.name, silicone.name, numbers, verdict, steps, f"step{step.index}-section.svg")
        )
    return Procedure(
        name=spec.name,
        label=plan.label,
        cells=len(plan.layout.cells),
        preparation=preparation(spec, plan, resin),
        off_grid=edges,
        pours=tuple(pours),
        release=release(spec, plan, silicones[0]),
        assembly=tuple(moulds.design.assembly(spec, dims)),
        measure=measurements(spec, dims, grams, _slot_as_printed(spec, plan, edges), plan.by_complement),
        walls=tuple(_walls(spec)),
        bill=bill(spec, dims, plan, list(zip(silicones, mixes, strict=True))),
    )


def _figures(
    spec: Spec, dims: Dimensions, plan: Plan, layer: int, silicone: Material, mix: Mix, volume: float
) -> tuple[Figure, ...]:
    casting, step = spec.casting, plan.steps[layer]
    rule = "assumed: half the time for every 10 K more; at 23 degC " + sourced(silicone.pot_life_min)
    depth = step.rim
    channels = " + sprue and vents" if step.channels else ""
    weep = fig.weep_mm3(spec, dims, plan.layout, layer, silicone)
    found = [
        Figure("volume of one layer", volume, "mm3", "computed: the drawn layer's mesh"),
        *([Figure("sprue and vents", _channels_mm3(step), "mm3", "computed: as drawn")] if channels else []),
        Figure("density", float(silicone.density_g_cm3), "g/cm3", sourced(silicone.density_g_cm3)),
        Figure("in the cavities, net", mix.net_g, "g", f"computed: (volume x cavities{channels}) x density"),
        Figure("to mix", mix.mix_g, "g", f"assumed: {casting.waste:.0%} more, at least {casting.minimum_mix_g:g} g"),
        Figure("part A", mix.part_a_g, "g", "mix ratio, " + sourced(silicone.mix_ratio)),
        Figure("part B", mix.part_b_g, "g", "mix ratio, " + sourced(silicone.mix_ratio)),
        Figure("scale's error on a part, net", mix.net_error_pct, "%", f"half of {casting.scale_resolution_g:g} g"),
        Figure("scale's error on a part, mixed", mix.mix_error_pct, "%", f"half of {casting.scale_resolution_g:g} g"),
        Figure("pot life in this room", fig.at_room(float(silicone.pot_life_min), casting.room_c), "min", rule),
        Figure("mixing", fig.MIXING_MIN, "min", "assumed: usual practice"),
        *([Figure("degassing", fig.DEGASSING_MIN, "min", "assumed: usual practice")] if casting.vacuum else []),
        Figure("pouring and striking off", fig.POURING_MIN, "min", "assumed: usual practice"),
        Figure("viscosity, mixed", float(silicone.mixed_viscosity_cps), "cps", sourced(silicone.mixed_viscosity_cps)),
        Figure("depth of this pour", depth, "mm", "computed: the rim over the seat"),
        Figure(
            f"rise of a {fig.BUBBLE_MM} mm bubble through it",
            fig.bubble_rise_s(depth, silicone),
            "s",
            "computed: Stokes' law at constant viscosity, so optimistic; the bubble is assumed",
        ),
        Figure(
            "degassing container, at least", fig.CONTAINER * mix.millilitres, "ml", "assumed: 4 x the mix, it foams up"
        ),
        Figure(
            "vacuum", fig.VACUUM_INHG, "inHg", f"assumed: usual advice; {fig.VACUUM_INHG * fig.KPA_PER_INHG:.1f} kPa"
        ),
        Figure(
            "cure in this room",
            fig.at_room(float(silicone.cure_h), casting.room_c),
            "h",
            "assumed: half the time for every 10 K more; at 23 degC " + sourced(silicone.cure_h),
        ),
    ]
    if weep:
        share = 100 * weep / volume
        under = "computed: flow in the clearance under the pour's own weight"
        if step.lid:
            under += "; the syringe's pressure comes on top"
        found.append(Figure("weep by the windows, no grease", share, "% of a layer", under))
    return tuple(found)


def _channels_mm3(step: Step) -> float:
    return sum(map(exact_volume, step.channels))


def _verdict(spec: Spec, step: Step, silicone: Material) -> str:
    """Whether the pot life, less mixing, degassing and pouring, lets the bubbles rise out of the pour."""
    rise = fig.bubble_rise_s(step.rim, silicone)
    pot = 60 * fig.at_room(float(silicone.pot_life_min), spec.casting.room_c)
    work = 60 * (fig.MIXING_MIN + fig.POURING_MIN)
    spent = f"the pot life of {pot:.0f} s less {work:.0f} s for mixing and pouring"
    if rise <= pot - work:
        return f"Bubbles clear by themselves: {rise:.0f} s through {step.rim:.2f} mm, within {spent}."
    if spec.casting.vacuum:
        left = pot - work - 60 * fig.DEGASSING_MIN
        told = f"Degas for {fig.DEGASSING_MIN:g} min (assumed) before pouring: a bubble needs {rise:.0f} s, more than "
        told += f"{spent}."
        if left < 0:
            told += f" Degassing ends {-left:.0f} s after the pot life: cool the room, or take a slower silicone."
        return told
    return (
        f"Bubbles stay: {rise:.0f} s against {spent}, and no vacuum (casting.vacuum). Get one, or brush a thin coat "
        "onto core and bore first and pour in a thread from one side."
    )


def _slot_as_printed(spec: Spec, plan: Plan, edges: Sequence[OffGrid]) -> float | None:
    """The tongue's thickness as the slicer makes it, where that is another one; a tongue that is cut has its own."""
    printed = any(tool.made == "printed" for tool in plan.of_kind("tongue"))
    heights = [edge.nearest_mm for edge in edges if edge.piece == "tongue"]
    return heights[0] if printed and heights else None


def _walls(spec: Spec) -> list[Figure]:
    times = "1 x for Layer 1, 2 x beyond it" if len(spec.layers) > 1 else "1 x"
    source = f"computed: play of {spec.moulds.plinth_clearance_mm:g} mm a side, {times}"
    found = []
    for i in range(len(spec.layers)):
        thin, thick = fig.wall_range(spec, i)
        found.append(Figure(f"layer {i + 1} wall, thinnest", thin, "mm", source))
        found.append(Figure(f"layer {i + 1} wall, thickest", thick, "mm", source))
    return found
