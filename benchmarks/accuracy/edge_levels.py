"""The edge level's models against the paper's table; finite elements against the layered solver on bare skin."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, partial

import numpy as np
from msgspec.structs import replace

from benchmarks.accuracy.elements import amplitude, pressed_skin
from benchmarks.accuracy.fem_search import unit_spec
from benchmarks.accuracy.level_scores import score_tables
from benchmarks.accuracy.machine import machine
from benchmarks.accuracy.result import Cell, Plot, Promise, Result, Say, Summary, Table, stars
from benchmarks.accuracy.unexplained import NineLevels, unexplained
from unitcad.accuracy.measurements import Timing, interleaved, timing
from unitcad.attenuation.edge.measured import CONTROL, MeasuredTable, measured_table
from unitcad.attenuation.edge.models import COMPARED, MODELS, RULE, edge_levels, stored
from unitcad.attenuation.edge.scoring import Assessment, Fit, assess, assessments, in_order
from unitcad.attenuation.edge.words import ANY_FORM
from unitcad.attenuation.fem.unit import Setting, motion
from unitcad.attenuation.inputs import tissue_medium
from unitcad.attenuation.layered import UniformDisc
from unitcad.catalogue import measurements
from unitcad.estimate_inputs import estimate_input
from unitcad.spec import Spec
from unitcad.validation import default_template, load

_TITLES = {"baseline": "baseline: four class means"}
_DRAWN, _BARE = "finite elements, as drawn", "finite elements, without the circuit"
_RADII = np.array([0, 2, 5, 7, 10, 15, 20, 30]) * 1e-3


@dataclass(frozen=True)
class _Model:
    """A model's comparison with the measured levels, its time, and how many constants were fitted to them."""

    assessed: Assessment
    time: Timing
    constants: str


def run(quick: bool, say: Say) -> Result:
    """Compare closed forms, baseline and finite elements with the measured levels and ratios.

    Bare skin and mesh convergence come with them.
    """
    table = measured_table()
    everyone = np.ones((1, len(table.names)), dtype=bool)
    levels = {name: one.levels(table, everyone)[0] for name, one in COMPARED.items()}
    calls: dict[str, Callable[[], object]] = {
        name: lambda name=name: edge_levels(table.inputs[4], name) for name in MODELS
    }
    times = interleaved(calls, 21)
    models = {
        _TITLES.get(name, name): _Model(
            assessments()[name], times[name if name in times else "published"], str(len(COMPARED[name].names))
        )
        for name in in_order(assessments())
    }
    solved: dict[str, NineLevels] = {}
    for pad, name in ((True, _DRAWN), (False, _BARE)):
        say(name)
        solved[name], seconds = finite_element_levels(1.0 if quick else 2.0, pad)
        models[name] = _Model(assess(_given(solved[name].in_order(table)), False, table), timing(seconds), "0")
    closed = {
        name: NineLevels({unit: {"": float(level)} for unit, level in zip(table.names, own, strict=True)})
        for name, own in levels.items()
    }
    marks = stars([(model.time.median, model.assessed.leave_one_out.geometric_mean) for model in models.values()])
    comparison = Table(
        "Against nine levels and twelve ratios to controls: geometric-mean factor error (1 is exact)",
        ("model", "constants", "levels", "left out", "ratios", "left out", "directions", "time a level", "frontier"),
        tuple((*_row(name, model), mark) for (name, model), mark in zip(models.items(), marks, strict=True)),
        "Nine units rank none of the forms of the rule, nor the baseline. The rule's constants, fitted when this runs: s "
        f"{stored()['rule']['s']:.4g}, q {stored()['rule']['q']:.4g}. Left out: each unit by constants fitted "
        "without it. Directions: of twelve ratios, how many lie on the right side of 1. baseline takes the "
        "time of published. The finite elements' time is the median over their solutions, one run each; the "
        "others are of 21 runs.",
    )
    plot = Plot(
        "Error against the measured levels, each unit left out, against time",
        "seconds a level",
        "geometric-mean factor error less 1",
        {
            name: ((model.time.median, model.assessed.leave_one_out.geometric_mean - 1),)
            for name, model in models.items()
        },
        frontier=True,
    )
    say("mesh convergence")
    finenesses = (1.0, 2.0) if quick else (1.0, 2.0, 4.0)
    convergence = tuple(
        _converging(f"{design} {unit}", unit_spec(design, unit), finenesses)
        for unit in _SHOWN
        for design in measurements().designs
    )
    shrink = max(abs(row[-2] - row[-3]) / row[-2] for row in convergence)
    apart = min(abs(row[-2] - _measured(table, row[0])) / row[-2] for row in convergence)
    meshes = Table(
        "Mesh convergence of the unit's edge level (as drawn)",
        ("unit", *(f"fineness {n:g}" for n in finenesses), "unknowns at the last"),
        convergence,
        "Fineness 1: 1 mm at corners, growing to 4 mm; 2 halves all of it. The last halving changes a level by at most "
        f"{shrink:.1e} of it; the one nearest to its measurement is off by {apart:.2g} of it, {apart / shrink:.0f} "
        "times as much.",
    )
    say("scores on shuffled and simulated tables")
    scores, of_scores = score_tables(1000)
    say("bare skin")
    bare, worst = bare_skin(finenesses, repeats=1 if quick else 3)
    return Result(
        suite="models",
        title="Models of the edge level",
        text=unexplained(table, solved, closed, assessments()["published"]),
        tables=(comparison, *scores, _units_table(table, closed, solved), meshes, bare),
        plots=(plot,),
        promises=(
            Promise("bare skin: layered solver from the finest mesh, over the mesh's own error", worst, 1.0),
            Promise("unit: last halving of the mesh changes a level by, relative", shrink, 0.01),
            *of_scores,
        ),
        measured=machine("numpy", "scipy", "scikit-fem"),
        summary=_summary(models),
    )


def _summary(models: dict[str, _Model]) -> Summary:
    """Return the error of the rule's forms, which nine units do not rank, and the worst model."""
    score, name = max((model.assessed.leave_one_out.geometric_mean, name) for name, model in models.items())
    task = "amplitude at a unit's edge, this unit left out of the fit"
    return Summary(((task, ANY_FORM, f"{RULE}: {models[RULE].time}"),), f"{name}: off by a factor of {score:.2f}", 0)


_SHOWN = ("E10/D30", "D10")
"""Units whose convergence is shown, in each measured design."""


def edge_level(spec: Spec, fineness: float, pad: bool = True) -> tuple[float, int]:
    """Return |u_z| of the skin at r = D/2 over an axial motor's, and the number of unknowns; bonded, nominal values.

    Without `pad` there is no circuit. Raises UnitcadError for a material without a small-strain modulus.
    """
    variant = estimate_input(spec)
    if not pad:
        variant = replace(variant, geometry=replace(variant.geometry, pad=None))
    moved = motion(variant, "axial", Setting(), fineness)
    return amplitude(moved.skin, "axial", "normal") / abs(moved.motor), moved.unknowns


@cache
def finite_element_levels(fineness: float, pad: bool) -> tuple[NineLevels, list[float]]:
    """Return the units' levels and the seconds of each solution.

    A control has a level in both shapes, since the paper does not say which one was measured.
    """
    seconds: list[float] = []
    levels: dict[str, dict[str, float]] = {}
    for name in measured_table().names:
        design, unit = name.split(" ")
        for shape in measurements().designs if design == CONTROL else (design,):
            solve = partial(edge_level, unit_spec(shape, unit), fineness, pad)
            solved = interleaved({name: solve}, 1, warm=False)[name]
            levels.setdefault(name, {})[shape] = solved.value[0]
            seconds.append(solved.median)
    return NineLevels(levels), seconds


def _measured(table: MeasuredTable, unit: str) -> float:
    """Return the measured level of a unit of the page, whose controls have a shape."""
    name = unit if unit in table.names else f"{CONTROL} {unit.split(' ')[1]}"
    return float(table.levels[table.names.index(name)])


def _units_table(table: MeasuredTable, closed: dict[str, NineLevels], solved: dict[str, NineLevels]) -> Table:
    rows: list[tuple] = []
    for i, name in enumerate(table.names):
        models = [level for model in ("rule", "published") for level in closed[model].levels[name].values()]
        rows.append((name, float(table.levels[i]), *models, *(levels.shown(name) for levels in solved.values())))
    return Table(
        "Each unit's edge level, motor = 1",
        ("unit", "measured", "rule", "published", *solved),
        tuple(rows),
        "The models carry constants from all nine levels, the finite elements none. The paper does not say in "
        "which shape a control was measured, so its finite-element level is the geometric mean of both, shown beside "
        "it.",
    )


def bare_skin(finenesses: Sequence[float], repeats: int) -> tuple[Table, float]:
    """Compare u_z of the forearm under the motor's disc by both methods.

    Returns the table, and the difference over the mesh's own error.
    """
    variant = estimate_input(load(default_template()))
    omega, disc = 2 * math.pi * variant.frequency.middle, variant.motor_diameter / 2
    medium = tissue_medium(variant.tissue)
    exact = medium.response(UniformDisc(disc), omega, _RADII, rtol=1e-9).u_z
    scale = np.max(np.abs(exact))
    calls = {n: partial(pressed_skin, medium, omega, "axial", disc, n) for n in finenesses}
    times = {n: interleaved({n: call}, repeats, warm=False)[n] for n, call in calls.items()}
    # The finite elements count z upwards.
    values = [-time.value.skin(_RADII)[2][:, 0] for time in times.values()]
    rows = []
    for i, (n, solved) in enumerate(times.items()):
        from_solver = float(np.max(np.abs(values[i] - exact)) / scale)
        own = float(np.max(np.abs(values[i] - values[i - 1])) / scale) if i else None
        rows.append((f"{n:g}", solved.value.unknowns, from_solver, own, str(solved)))
    solver = interleaved({"": lambda: medium.response(UniformDisc(disc), omega, _RADII, rtol=1e-6)}, 5)[""]
    own_error = float(np.max(np.abs(values[-1] - values[-2])) / scale)
    table = Table(
        "Bare skin under the motor's disc: finite elements against the layered solver",
        ("fineness", "unknowns", "difference from the solver", "change from the mesh before", "time"),
        tuple(rows),
        f"Largest over 0 to 30 mm, over the largest |u_z|. Times of {f'{repeats} runs' if repeats > 1 else 'one run'} "
        f"each; the layered solver takes {solver} at rtol 1e-6, 5 runs. The change to the mesh before bounds the finer "
        f"mesh's own error; the solver differs by {rows[-1][2] / own_error:.2g} of it.",
    )
    return table, rows[-1][2] / own_error


def _given(levels: Sequence[float]) -> Fit:
    def fit(table: MeasuredTable, chosen: np.ndarray) -> np.ndarray:
        return np.broadcast_to(levels, chosen.shape)

    return fit


def _row(name: str, model: _Model) -> tuple[Cell, ...]:
    assessed, ratios = model.assessed, model.assessed.leave_one_out_ratios
    return (
        name,
        model.constants,
        assessed.levels.geometric_mean,
        assessed.leave_one_out.geometric_mean,
        assessed.ratios.geometric_mean,
        ratios.geometric_mean if ratios else None,
        f"{assessed.directions} of {assessed.ratios.count}",
        str(model.time),
    )


def _converging(name: str, spec: Spec, finenesses: Sequence[float]) -> tuple:
    solved = [edge_level(spec, n) for n in finenesses]
    return (name, *(level for level, _ in solved), solved[-1][1])
