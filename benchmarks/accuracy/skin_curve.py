"""The skin's curve against published measurements, the bodies within the template's sources, and contact."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
from msgspec.structs import replace

from benchmarks.accuracy.fem_search import unit_spec
from benchmarks.accuracy.machine import machine
from benchmarks.accuracy.result import Plot, Promise, Result, Say, Summary, Table
from unitcad.attenuation.curve import CONTACT_MM, contact, decay, ends
from unitcad.attenuation.fem.elements import Contact
from unitcad.attenuation.fem.unit import Draw, Setting, draw_unknowns, unit_fields
from unitcad.attenuation.inputs import Drive, EstimateInput, tissue_medium
from unitcad.attenuation.layered import UniformDisc
from unitcad.catalogue import measurements
from unitcad.estimate_inputs import estimate_input
from unitcad.validation import default_template, load

DRIVES: tuple[Drive, ...] = ("flat", "axial")
GRAVITY = 9.80665
FAR_MM = (40.0, 60.0, 80.0, 100.0)
"""Distances from the motor's middle between which the fall every 20 mm is taken."""
BANDS = {50.0: (0.79, 0.70, 0.88), 87.5: (0.80, 0.68, 0.92)}
"""SkinSource: what is left of the amplitude every 20 mm, median and range, at the middle of its bands, Hz."""
SEED, DRAWS = 1, 400
PAIRS = ("E10/D10", "E10/D30", "D10/E10", "D30")


@dataclass(frozen=True)
class Published:
    """A published measurement beside the template's range: whether it lies in it, and why the two may differ."""

    what: str
    measured: str
    computed: str
    holds: bool
    caveat: str


def forearm() -> EstimateInput:
    """Return the default unit on the forearm."""
    return estimate_input(load(default_template()))


def far(variant: EstimateInput, hertz: float, drive: Drive, end: dict[str, int] | None = None) -> float:
    """Return what is left of |u| every 20 mm over `FAR_MM`, the spreading of a circular wave taken off."""
    r = 1e-3 * np.array(FAR_MM)
    size = decay(variant, r, drive, hertz, end) * np.sqrt(r)
    return float((size[-1] / size[0]) ** (1.0 / (r.size - 1)))


def _over_ends(variant: EstimateInput, one: object) -> tuple[float, float, float]:
    """Return a figure at the nominal body, and the least and the largest over its ranges, one kind at a time."""
    every = [one(end) for end in ({}, *(end for end in ends(variant) if "frequency" not in end))]  # type: ignore[operator]
    return every[0], min(every), max(every)


def _shown(found: tuple[float, float, float]) -> str:
    return f"{found[0]:.2g} ({found[1]:.2g} to {found[2]:.2g})"


def published(variant: EstimateInput) -> Iterator[Published]:
    """Yield each published measurement beside the template."""
    for hertz, (median, low, high) in BANDS.items():
        band = "40 to 60 Hz" if hertz == 50.0 else "75 to 100 Hz"
        for drive in DRIVES:
            found = _over_ends(variant, partial(far, variant, hertz, drive))
            yield Published(
                f"SkinSource (Tummala 2024), hand and forearm, {band}: left every 20 mm, {drive} drive",
                f"{median:.2f} ({low:.2f} to {high:.2f})",
                _shown(found),
                found[1] <= high and found[2] >= low,
                "72 accelerometers, driven at the fingers: waves run along a limb and do not spread; spreading is "
                "taken off the computed ones",
            )
    motor = replace(variant, diameter=10e-3, geometry=replace(variant.geometry, motor_radius=5e-3))
    at = 1e-3 * np.array([5.0 + 8.0, 5.0 + 24.0])
    for drive in DRIVES:
        found = _over_ends(motor, lambda end, drive=drive: float(decay(motor, at[:1], drive, 150.0, end)[0]))  # type: ignore[arg-type]
        yield Published(
            f"Sofia and Jones 2013, forearm: 8 mm from the motor, {drive} drive",
            "markedly attenuated",
            _shown(found),
            found[2] <= 0.6,
            "no figure in the abstract: at most 0.6 is our reading; a pancake motor of 10 mm at 150 Hz is assumed",
        )
    for drive in DRIVES:
        g = {(hertz, mm): a for hertz, mm, a in _shah(variant, drive)}
        yield Published(
            f"Shah 2019, forearm: 0.45 G at 102 Hz to 2.35 G at 241 Hz at the motor, {drive} drive",
            "felt at 4 cm above 150 Hz only, nowhere beyond 8 cm",
            f"4 cm: {g[102.0, 40]:.2g} and {g[241.0, 40]:.2g} G; 8 cm: {g[102.0, 80]:.2g} and {g[241.0, 80]:.2g} G",
            max(g[102.0, 80], g[241.0, 80], g[102.0, 40]) < g[241.0, 40],
            "holds if one threshold of acceleration fits: below 241 Hz at 4 cm, above the other three",
        )
    speed = _speed(variant, 300.0)
    yield Published(
        "Manfredi 2012, finger: speed of the surface wave at high frequency",
        "7 m/s",
        f"{speed:.2g} m/s at 300 Hz, 10 to 20 mm from the middle",
        3.5 <= speed <= 14.0,
        "a finger, not a forearm: glabrous skin over bone; within a factor of 2 counts",
    )


def _shah(variant: EstimateInput, drive: Drive) -> Iterator[tuple[float, int, float]]:
    """Yield (Hz, mm, G): the motor's own acceleration times the decay to 4 and 8 cm from its middle."""
    for hertz, source in ((102.0, 0.45), (241.0, 2.35)):
        found = decay(variant, np.array([0.04, 0.08]), drive, hertz)
        yield from ((hertz, mm, source * float(one)) for mm, one in zip((40, 80), found, strict=True))


def _speed(variant: EstimateInput, hertz: float) -> float:
    """Return the phase speed of u_z of the forearm from 10 to 20 mm under a normal force, m/s."""
    r, omega = np.linspace(10e-3, 20e-3, 41), 2 * math.pi * hertz
    found = tissue_medium(variant.tissue).response(UniformDisc(variant.motor_diameter / 2.0), omega, r, rtol=1e-4)
    return float(omega * (r[-1] - r[0]) / abs(np.unwrap(np.angle(found.u_z))[[0, -1]] @ [-1, 1]))


def bodies_in_range(variant: EstimateInput, draws: int) -> dict[Drive, tuple[float, ...]]:
    """Return, by drive, which share of bodies drawn within the template's sources holds each band, and both."""
    held: dict[Drive, list[list[bool]]] = {drive: [] for drive in DRIVES}
    for i in range(draws):
        made, _ = draw_unknowns(variant, Draw(SEED, i))
        for drive, rows in held.items():
            found = [far(made, hertz, drive) for hertz in BANDS]
            inside = [low <= one <= high for one, (_, low, high) in zip(found, BANDS.values(), strict=True)]
            rows.append([*inside, all(inside)])
    return {drive: tuple(np.mean(rows, axis=0).tolist()) for drive, rows in held.items()}


def contact_ratios(drive: Drive, stuck: Contact, frequencies: tuple[float, ...], fineness: float) -> np.ndarray:
    """Return |u| over that at the edge by finite elements of units, over that of bare skin: (units, `CONTACT_MM`)."""
    rows = []
    for hertz in frequencies:
        for design in measurements().designs:
            for pair in PAIRS:
                variant = estimate_input(unit_spec(design, pair), hertz)
                r = variant.diameter / 2.0 + 1e-3 * np.array(CONTACT_MM)
                rows.append(unit_decay(variant, drive, stuck, r, fineness) / decay(variant, r, drive, hertz))
    return np.array(rows)


def unit_decay(variant: EstimateInput, drive: Drive, stuck: Contact, r: np.ndarray, fineness: float) -> np.ndarray:
    """Return |u| of the skin at radii (m) over that at the first, by finite elements of a unit, its motor driven."""
    omega, shape = 2 * math.pi * variant.frequency.middle, variant.geometry
    fields = unit_fields(variant, drive, Setting(stuck), fineness)
    mass = shape.motor_mass.middle
    inertia = [mass, mass * (3 * shape.motor_radius**2 + shape.motor_height**2) / 12][: 1 + (drive == "flat")]
    motions = np.linalg.solve(fields.stiffness - omega**2 * np.diag(inertia), np.eye(len(inertia))[0])
    size = np.linalg.norm([part @ motions for part in fields.skin(r)], axis=0)
    return size / size[0]


def run(quick: bool, say: Say) -> Result:
    """Set the curve beside published numbers, draw bodies, and solve units on skin."""
    variant = forearm()
    say("published measurements")
    rows = list(published(variant))
    say("bodies within the sources")
    draws = 40 if quick else DRAWS
    shares = bodies_in_range(variant, draws)
    tables = [
        Table(
            "Published measurements beside the template",
            ("measurement", "measured", "template (range)", "ranges overlap", "caveat"),
            tuple((one.what, one.measured, one.computed, "yes" if one.holds else "no", one.caveat) for one in rows),
            "Range: moduli, damping and thicknesses of the forearm to either end of their sources, one kind at a time.",
        ),
        Table(
            f"Of {draws} bodies drawn within the template's sources, the share that SkinSource's ranges hold",
            ("drive", "40 to 60 Hz", "75 to 100 Hz", "both"),
            tuple((drive, *share) for drive, share in shares.items()),
            f"All moduli, damping and thicknesses drawn at once, seed {SEED}. The template keeps its middle values, "
            "and the estimate says beyond 2 cm that the curve falls too fast.",
        ),
    ]
    outside, contact_rows = 0.0, []
    frequencies = (125.0,) if quick else (100.0, 125.0, 150.0)
    for drive in DRIVES:
        low, high = contact(drive, np.array(CONTACT_MM))
        for stuck in ("bonded", "resting"):
            say(f"contact: {drive}, {stuck}")
            found = contact_ratios(drive, stuck, frequencies, 1.0)
            outside = max(outside, float(np.max([low / found.min(axis=0), found.max(axis=0) / high])) - 1.0)
            ends_of = [f"{a:.2f} to {b:.2f}" for a, b in zip(found.min(axis=0), found.max(axis=0), strict=True)]
            contact_rows.append((drive, stuck, *ends_of[1:]))
    tables.append(
        Table(
            "What a unit on the skin changes: |u| over that at the edge, over bare skin's, by mm from the edge",
            ("drive", "contact", *(f"{mm:g} mm" for mm in CONTACT_MM[1:])),
            tuple(contact_rows),
            "Finite elements of the paper's designs with four pairs of silicones each, nominal values. The curve's "
            "range goes over both contacts.",
        )
    )
    measurements = {one.what.rpartition(",")[0] or one.what for one in rows}
    held = len({one.what.rpartition(",")[0] or one.what for one in rows if one.holds})
    return Result(
        suite="skin",
        title="The curve on the skin against published measurements",
        text=(
            "The curve is a layered half-space's: waves spread over a circle. Near the motor it agrees with what was "
            "measured on forearms. Beyond 2 cm arms keep more of the vibration than the template, and than nearly "
            "every body within its sources. Two of the measurements state no figure: their row is our reading."
        ),
        tables=tuple(tables),
        plots=(_plot(variant),),
        promises=(
            Promise("contact: how far finite elements of units leave the curve's range, relative", outside, 0.05),
        ),
        measured=machine("numpy", "scipy", "scikit-fem"),
        summary=Summary(
            ((f"the skin, {held} of {len(measurements)} published measurements overlap", "see its page", "curve"),),
            f"both of SkinSource's bands: {100 * shares['flat'][-1]:.2g} % of bodies under a flat motor",
            0,
        ),
    )


def _plot(variant: EstimateInput) -> Plot:
    mm = np.arange(20.0, 101.0, 10.0)
    series = {}
    for hertz, (median, low, high) in BANDS.items():
        for name, ratio in (("SkinSource, low", low), ("SkinSource, median", median), ("SkinSource, high", high)):
            if hertz == 87.5:
                series[name] = tuple((float(r), ratio ** ((r - 20.0) / 20.0)) for r in mm)
        for drive in DRIVES:
            size = decay(variant, 1e-3 * mm, drive, hertz) * np.sqrt(mm)
            series[f"{drive}, {hertz:g} Hz"] = tuple(zip(mm.tolist(), (size / size[0]).tolist(), strict=True))
    axes = "distance from the motor's middle, mm", "|u| over that at 20 mm, without spreading"
    return Plot("Forearm template and SkinSource", *axes, series, curves=tuple(series), linear_x=True)
