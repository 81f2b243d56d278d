"""Finite elements of a unit: error against time, the sideways load on bare skin, and what fits the measured levels."""

from __future__ import annotations

import math
from functools import partial

import numpy as np

from benchmarks.accuracy.elements import amplitude, pressed_skin
from benchmarks.accuracy.fem_search import DRIVES, READINGS, drawn_levels, searches, unit_spec
from benchmarks.accuracy.machine import machine
from benchmarks.accuracy.result import Plot, Promise, Result, Say, Summary, Table
from unitcad.accuracy.measurements import PROCESSOR, PROCESSOR_NOTE, interleaved
from unitcad.attenuation.fem.unit import Draw, Drive, Setting, draw_unknowns, motion
from unitcad.attenuation.inputs import tissue_medium
from unitcad.attenuation.layered import UniformDisc
from unitcad.catalogue import measurements
from unitcad.estimate_inputs import estimate_input
from unitcad.validation import default_template, load

SEED, DRAWS = 1, 128
_RADII = np.array([0, 2, 5, 7, 10, 15, 20, 30]) * 1e-3
_LAYERS = ("E10/D30", "D10")
"""One unit of each measured design."""
_USED, _COARSE, _FINER = 1.0, 0.5, 2.0
"""Fineness of `level` and of the range's draws, one to try much with, and one to compare draws with."""


def run(quick: bool, say: Say) -> Result:
    """Compare meshes with their limit, both drives on bare skin with the layered solver, and draws with the table.

    `quick` leaves out the finest mesh and the search, which takes minutes.
    """
    finenesses = (0.5, 1.0, 2.0) if quick else (0.5, 1.0, 2.0, 4.0)
    meshes, plot, off = _error_against_time(finenesses, say)
    say("bare skin")
    bare, over = _bare_skin()
    say("meshes of draws")
    typical, worst = _draws_by_mesh(3 if quick else 12)
    tables = [meshes, bare]
    text = (
        "Finite elements of unit and body, model `fem`: harmonic 0 for an axial motor, 1 for a flat one. At "
        f"fineness {_USED:g}, which a level has by default, bonded units are within {off[_USED]:.1e} of their limit, "
        f"at {_COARSE:g} within {off[_COARSE]:.1e}. Draws of what is not known, near a resonance or with small levels "
        f"some of them, change by a median of {typical:.1e} and by {worst:.1e} at most from fineness {_USED:g} to "
        f"{_FINER:g}. "
    )
    if not quick:
        say(f"{DRAWS} draws of nine units")
        searched, said = _search()
        tables.append(searched)
        text += said
    return Result(
        suite="fem",
        title="Finite elements of a unit",
        text=text,
        tables=tuple(tables),
        plots=(plot,),
        promises=(
            Promise(f"bonded units at fineness {_USED:g}: error of a level", off[_USED], 0.01),
            Promise(f"bonded units at fineness {_COARSE:g}: error of a level", off[_COARSE], 0.03),
            Promise("bare skin, both drives: layered solver from the finer mesh, over the mesh's own error", over, 1.0),
            Promise(f"draws: median change of a level from fineness {_USED:g} to {_FINER:g}", typical, 0.01),
            Promise(f"draws: largest change of a level from fineness {_USED:g} to {_FINER:g}", worst, 0.25),
        ),
        measured=machine("numpy", "scipy", "scikit-fem"),
        summary=Summary(
            picks=(
                ("a level of `fem`", f"{off[_USED]:.1e}", f"fineness {_USED:g}"),
                ("the same, bonded, a try of many", f"{off[_COARSE]:.1e}", f"fineness {_COARSE:g}"),
            ),
            worst=f"a draw at fineness {_USED:g}: {worst:.1e} from fineness {_FINER:g}",
            plot=0,
        ),
    )


def _error_against_time(finenesses: tuple[float, ...], say: Say) -> tuple[Table, Plot, dict[float, float]]:
    """Return the table, its plot, and the largest error at each fineness."""
    rows: list[tuple] = []
    series: dict[str, list[tuple[float, float]]] = {}
    off = dict.fromkeys(finenesses, 0.0)
    for design, layers in zip(measurements().designs, _LAYERS, strict=True):
        variant = estimate_input(unit_spec(design, layers))
        for drive in DRIVES:
            say(f"meshes of {design} {layers}, {drive}")
            calls = {n: partial(motion.__wrapped__, variant, drive, Setting(), n) for n in finenesses}
            times = {n: interleaved({n: call}, 1, warm=False, clock=PROCESSOR)[n] for n, call in calls.items()}
            levels = {
                n: [amplitude(at, drive, "along") / abs(t.value.motor) for at in (t.value.skin, t.value.edge)]
                for n, t in times.items()
            }
            before, last = (np.array(levels[n]) for n in finenesses[-2:])
            limit = 2 * last - before  # first order, as at the re-entrant corner of unit and skin
            for n in finenesses:
                errors = np.abs(np.array(levels[n]) / limit - 1)
                off[n] = max(off[n], float(errors.max()))
                name = f"{design} {layers}, {drive}"
                rows.append((name, f"{n:g}", times[n].value.unknowns, str(times[n]), *levels[n], *map(float, errors)))
                series.setdefault(name, []).append((times[n].median, float(errors.max())))
    table = Table(
        "Levels by fineness of the mesh",
        ("unit, drive", "fineness", "unknowns", "time", "skin", "own edge", "error, skin", "error, own edge"),
        tuple(rows),
        "Bonded, nominal values, the circuit as drawn. A level is the amplitude along the drive over the motor's. Both "
        "readings come from one solution. Errors are against the two finest meshes, extrapolated at first order, which "
        f"is the slowest that the corners allow. One run each. {PROCESSOR_NOTE}",
    )
    title = "Error of a unit's level against time"
    points = {name: tuple(values) for name, values in series.items()}
    return table, Plot(title, "processor seconds a level, both readings", "relative error", points, frontier=True), off


def _bare_skin() -> tuple[Table, float]:
    """Compare every component of both drives on bare skin with the layered solver."""
    variant = estimate_input(load(default_template()))
    omega, disc = 2 * math.pi * variant.frequency.middle, variant.motor_diameter / 2
    medium = tissue_medium(variant.tissue)
    rows, worst = [], 0.0
    cases: tuple[tuple[Drive, str], ...] = (("axial", "normal"), ("flat", "tangential"))
    for drive, direction in cases:
        exact = medium.response(UniformDisc(disc, direction), omega, _RADII, rtol=1e-9)  # type: ignore[arg-type]
        solved = [pressed_skin(medium, omega, drive, disc, n).skin(_RADII) for n in (1.0, 2.0)]
        # The finite elements count z upwards.
        pairs = {"u_r": (0, exact.u_r), "u_theta": (1, exact.u_theta), "u_z": (2, -exact.u_z)}
        scale = max(np.max(np.abs(wanted)) for _, wanted in pairs.values() if wanted is not None)
        for name, (i, wanted) in pairs.items():
            if drive == "axial" and name == "u_theta":
                continue
            coarse, fine = (u[i][:, 0] for u in solved)
            off = float(np.max(np.abs(fine - wanted)) / scale)
            own = float(np.max(np.abs(fine - coarse)) / scale)
            worst = max(worst, off / own)
            rows.append((f"{drive}, {name}", float(np.max(np.abs(coarse - wanted)) / scale), off, own))
    table = Table(
        "Bare skin under the motor's disc, both drives: finite elements against the layered solver",
        ("drive, component", "fineness 1 from the solver", "fineness 2 from the solver", "one from the other"),
        tuple(rows),
        "Largest over 0 to 30 mm, over the drive's largest component.",
    )
    return table, worst


def _draws_by_mesh(count: int) -> tuple[float, float]:
    """Return the median and largest relative change of the levels of draws on a finer mesh."""
    changes = []
    variant = estimate_input(load(default_template()))
    for index in range(count):
        made, setting = draw_unknowns(variant, Draw(SEED, index))
        for drive in DRIVES:
            coarse, fine = (motion(made, drive, setting, n) for n in (_USED, _FINER))
            for reading in READINGS:
                one, two = (amplitude(getattr(m, reading), drive, "along") / abs(m.motor) for m in (coarse, fine))
                changes.append(abs(one / two - 1))
    return float(np.median(changes)), max(changes)


def _search() -> tuple[Table, str]:
    levels = np.array(list(drawn_levels(SEED, DRAWS, _USED)))
    found = searches(levels, SEED)
    rows = tuple((name, one.count, one.best, one.nested, one.chance, one.what) for name, one in found.items())
    table = Table(
        "Readings of draws against the nine measured levels, nothing fitted but the choice",
        ("read on, drive", "hypotheses", "best", "chosen without the unit", "p", "the best one"),
        rows,
        "Factor errors, 1 is exact. p: how often the best is as good when the levels are dealt to the units at random.",
    )
    skin, edge = found["skin, either drive"], found["edge, either drive"]
    return table, (
        f"Of {skin.count} hypotheses on each reading the best on the skin is off by {skin.best:.2f} (chosen without "
        f"the unit {skin.nested:.2f}, p {skin.chance:.2g}), on the unit's own edge by {edge.best:.2f} "
        f"({edge.nested:.2f}, p {edge.chance:.2g})."
    )
