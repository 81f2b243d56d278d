"""The casting procedure as data: the steps in order, with every figure's source; `procedure_text` writes it."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from unitcad import catalogue
from unitcad.casting.bill import Item, bill
from unitcad.casting.figures import Batch, Figure
from unitcad.casting.pouring import (
    after_pours,
    film_mm3,
    measurements,
    motor_in,
    pour_steps,
    release,
    skin_on,
)
from unitcad.casting.preparation import Printing, preparation, printing
from unitcad.casting.steps import BenchStep, Phase, phases
from unitcad.casting.troubles import Trouble, troubles
from unitcad.designs.printed import Height
from unitcad.moulds.heights import height_warnings, unit_heights
from unitcad.moulds.mould_set import MouldSet
from unitcad.rooms import load
from unitcad.validation import warnings


@dataclass(frozen=True)
class Pour:
    """One pour: its figures, the verdict on bubbles, the steps, and the drawing of it assembled.

    Times are those of the room. `drawing` is the section, each step's picture is in 3D. `unknown`: the values that no
    source gives.
    """

    index: int
    layer: str
    material: str
    figures: tuple[Figure, ...]
    verdict: str
    bubbles_stay: bool
    over_pot_life_min: float
    unknown: tuple[str, ...]
    part_a_g: float
    part_b_g: float
    pot_life_min: float | None
    cure_h: float
    steps: tuple[BenchStep, ...]
    drawing: str


@dataclass(frozen=True)
class Procedure:
    """A whole casting: numbered steps run on from `preparation` through the pours to `assembly`.

    `earliest_finish_min`: from the first step, the pieces just printed, until the units are out of the mould, of which
    `bench_min` with a person at the bench; `time_line` goes on until the motor is in.

    `makes`: the product; `last`: the purpose of `assembly`, for which silicone is mixed `later_mixes` times.
    `castings`: how often moulds of units are filled, if units are cast apart from the sheet.
    """

    name: str
    label: str
    cells: int
    vacuum: bool
    earliest_finish_min: float
    bench_min: float
    time_line: tuple[Phase, ...]
    printing: Printing
    preparation: tuple[BenchStep, ...]
    unit_heights: tuple[Height, ...]
    pours: tuple[Pour, ...]
    release: tuple[BenchStep, ...]
    assembly: tuple[BenchStep, ...]
    measure: tuple[str, ...]
    bill: tuple[Item, ...]
    warnings: tuple[str, ...] = ()
    troubles: tuple[Trouble, ...] = ()
    makes: str = "unit"
    last: str = "Motor in"
    later_mixes: int = 0
    castings: int = 0


def pour_of(batch: Batch, steps: Iterable[BenchStep]) -> Pour:
    """Return the record of a pour."""
    return Pour(
        index=batch.step.index,
        layer=batch.step.name,
        material=batch.silicone.name,
        figures=batch.figures,
        verdict=batch.verdict,
        bubbles_stay=batch.bubbles_stay,
        over_pot_life_min=batch.over_pot_life_min,
        unknown=batch.unknown,
        part_a_g=batch.mix.part_a_g,
        part_b_g=batch.mix.part_b_g,
        pot_life_min=batch.pot_min,
        cure_h=batch.cure_h,
        steps=tuple(steps),
        drawing=f"step{batch.step.index}-section.svg",
    )


def procedure(moulds: MouldSet, layer_volumes_mm3: Sequence[float], printed_mm3: float = 0.0) -> Procedure:
    """Return the procedure of a mould set: nothing is drawn, and nothing meshed if the volumes are given.

    `layer_volumes_mm3`: of each layer of one unit, from the inside out. `printed_mm3`: of all printed pieces.
    """
    spec, plan = moulds.spec, moulds.plan
    known, cells = catalogue.materials(spec.materials), len(plan.layout.cells)
    batches = [
        Batch(moulds, step, known[step.material], volume, cells)
        for step, volume in zip(plan.steps, layer_volumes_mm3, strict=True)
    ]
    own = {name: load(f"{plan.bench}:{name}") for name in ("preparation", "pour_steps", "release") if plan.bench}
    pours = tuple(pour_of(batch, own.get("pour_steps", pour_steps)(batch)) for batch in batches)
    silicones = [batch.silicone for batch in batches]
    grams = [batch.volume_mm3 * float(batch.silicone.density_g_cm3) / 1000 for batch in batches]
    skin_g = film_mm3(moulds) * float(silicones[-1].density_g_cm3) / 1000
    prepared = tuple(own.get("preparation", preparation)(moulds, list(dict.fromkeys(silicones))))
    out = tuple(own.get("release", release)(moulds, silicones[0]))
    motor, skin = tuple(motor_in(moulds, silicones)), tuple(skin_on(moulds, silicones))
    last = " and ".join(["motor in"] * bool(motor or not skin) + ["skin on"] * bool(skin))
    motor += skin
    after = after_pours(moulds, silicones)
    every = [*prepared, *(step for pour in pours for step in pour.steps), *out, *motor]
    return Procedure(
        name=spec.name,
        label=plan.label,
        cells=cells,
        vacuum=spec.casting.vacuum,
        **times(prepared, pours, out, last, motor),
        printing=printing(moulds, printed_mm3),
        preparation=prepared,
        unit_heights=tuple(unit_heights(moulds)),
        pours=pours,
        release=out,
        assembly=motor,
        measure=tuple(measurements(moulds, grams, skin_g)),
        warnings=(*(warnings(spec) if plan.makes == "unit" else ()), *height_warnings(moulds)),
        troubles=troubles(moulds),
        makes=plan.makes,
        bill=bill(moulds, batches, every, after),
        last=last.capitalize(),
        later_mixes=len(after),
    )


def times(
    prepared: Sequence[BenchStep],
    pours: Sequence[Pour],
    out: Sequence[BenchStep],
    last: str,
    motor: Sequence[BenchStep],
) -> dict[str, Any]:
    """Return the time line of a procedure, when the units are out of the mould, and the time at the bench."""
    stages = [("preparation", prepared), *((f"pour {pour.index}", pour.steps) for pour in pours)]
    line = phases([*stages, ("out of the mould", out), (last, motor)])
    until = [phase for phase in line if not phase.name.startswith(last)]
    bench = sum(phase.bench_min for phase in until)
    return {"earliest_finish_min": until[-1].end_min, "bench_min": bench, "time_line": line}
