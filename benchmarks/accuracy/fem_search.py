"""Which reading of the finite elements fits the nine measured levels: a seeded search over what is not known.

A hypothesis is one draw of every unknown, a drive, a reading, a component of it and what its level is taken over; the
same for all nine units. The choice among hypotheses is a fit, so beside the best one stand the error when it is chosen
without the unit that it predicts, and how often the best is as good on levels that were dealt to the units at random.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any, get_args

import numpy as np

from benchmarks.accuracy.elements import amplitude
from unitcad.attenuation.edge.measured import CONTROL, measured_table
from unitcad.attenuation.fem.unit import Draw, Drive, Reading, Setting, draw_unknowns, motion
from unitcad.catalogue import measurements
from unitcad.designs import shipped
from unitcad.estimate_inputs import estimate_input
from unitcad.spec import Spec
from unitcad.validation import from_data

DRIVES: tuple[Drive, ...] = get_args(Drive)
READINGS: tuple[Reading, ...] = get_args(Reading)
COMPONENTS = ("normal", "radial", "total")
REFERENCES = ("motor", "free")
"""What a level is over: the motor's own motion in the unit, or that of a motor in the air, F / (omega^2 m)."""
AXES = ("drive", "reading", "component", "reference")


def unit_spec(design: str, unit: str) -> Spec:
    """Return the spec of a measured unit in a design, "E10/D30" or a control "D10", with its walls and caps."""
    names, shared = measurements().layers(unit), measurements().unit
    wall = 2 * shared.wall_mm / len(names)
    layers = [
        {"material": name, "wall_mm": wall, **({"cap_mm": wall} if shipped()[design].caps else {})} for name in names
    ]
    return from_data({"name": unit, "design": design, "diameter_mm": shared.diameter_mm, "fpcb": {}, "layers": layers})


def unit_levels(unit: str, draw: Draw | None, fineness: float) -> np.ndarray:
    """Return the levels of a measured unit, (drives, readings, components, references).

    A control has the geometric mean of its levels in both shapes, since the paper does not say which one was measured.
    """
    design, layers = unit.split(" ")
    shapes = tuple(measurements().designs) if design == CONTROL else (design,)
    return np.exp(np.mean([np.log(_shape_levels(shape, layers, draw, fineness)) for shape in shapes], axis=0))


def _shape_levels(design: str, layers: str, draw: Draw | None, fineness: float) -> np.ndarray:
    variant, setting = estimate_input(unit_spec(design, layers)), Setting()
    if draw:
        variant, setting = draw_unknowns(variant, draw)
    free = 1 / ((2 * math.pi * variant.frequency.middle) ** 2 * variant.geometry.motor_mass.middle)
    levels = np.empty((len(DRIVES), len(READINGS), len(COMPONENTS), len(REFERENCES)))
    for i, drive in enumerate(DRIVES):
        moved = motion(variant, drive, setting, fineness)
        for j, at in enumerate((moved.skin, moved.edge)):
            for k, component in enumerate(COMPONENTS):
                levels[i, j, k] = amplitude(at, drive, component) / np.array([abs(moved.motor), free])
    return levels


def drawn_levels(seed: int, draws: int, fineness: float) -> Iterator[np.ndarray]:
    """Yield the levels of one draw after another, spread evenly: (units, drives, readings, components, references)."""
    for index in range(draws):
        yield np.array([unit_levels(unit, Draw(seed, index, draws), fineness) for unit in measured_table().names])


@dataclass(frozen=True)
class Searched:
    """What a search over hypotheses gave; factor errors, 1 is exact.

    best      geometric mean over the nine levels of the best hypothesis, which `what` names
    nested    the same when each level is predicted by the hypothesis that is best on the other eight
    chance    part of random dealings of the levels to the units whose best is as good or better
    count     how many hypotheses
    """

    best: float
    nested: float
    chance: float
    count: int
    what: str


def search(levels: np.ndarray, measured: np.ndarray, names: list[str], seed: int, dealings: int = 400) -> Searched:
    """Search hypotheses, `levels` of shape (hypotheses, units), without any fitted constant."""
    logs = np.log(levels)
    off = np.abs(logs - np.log(measured))
    mean = off.mean(axis=1)
    without = (off.sum(axis=1)[:, None] - off) / (off.shape[1] - 1)
    chosen = np.argmin(without, axis=0)
    nested = off[chosen, np.arange(off.shape[1])].mean()
    rng = np.random.default_rng(seed)
    dealt = [np.abs(logs - np.log(rng.permutation(measured))).mean(axis=1).min() for _ in range(dealings)]
    chance = (1 + np.sum(np.array(dealt) <= mean.min() + 1e-12)) / (dealings + 1)
    best = int(np.argmin(mean))
    return Searched(math.exp(mean[best]), math.exp(nested), float(chance), len(logs), names[best])


def searches(levels: np.ndarray, seed: int) -> dict[str, Searched]:
    """Search within each reading and drive, and within each reading; `levels` (draws, units, then as `AXES`)."""
    measured = measured_table().levels
    found = {}
    for j, reading in enumerate(READINGS):
        for drives in ((0,), (1,), (0, 1)):
            part = levels[:, :, list(drives), j]  # draws, units, drives, components, references
            named = [
                f"draw {d}, {DRIVES[i]}, {COMPONENTS[k]}, over {REFERENCES[m]}"
                for d in range(part.shape[0])
                for i in drives
                for k in range(part.shape[3])
                for m in range(part.shape[4])
            ]
            flat = np.moveaxis(part, 1, -1).reshape(-1, part.shape[1])
            title = f"{reading}, {DRIVES[drives[0]] if len(drives) == 1 else 'either drive'}"
            found[title] = search(flat, measured, named, seed)
    return found


def one_constant(levels: np.ndarray, measured: np.ndarray) -> tuple[float, float]:
    """Return the factor error of levels times one fitted constant, on all units and with the unit left out."""
    off = np.log(measured / levels)
    every = np.abs(off - np.median(off)).mean()
    out = np.mean([abs(off[i] - np.median(np.delete(off, i))) for i in range(off.size)])
    return math.exp(every), math.exp(out)


def as_data(seed: int, fineness: float, nominal: np.ndarray, levels: np.ndarray) -> dict[str, Any]:
    """Return levels along the drive over the motor's motion, to four digits, and the searches over all of them."""
    along = [COMPONENTS.index("radial" if drive == "flat" else "normal") for drive in DRIVES]

    def short(values: np.ndarray) -> Any:
        chosen = np.stack([values[..., i, :, k, 0] for i, k in enumerate(along)], axis=-2)
        return np.vectorize(lambda v: float(f"{v:.4g}"))(chosen).tolist()

    return {
        "what": "levels by finite elements, along the drive over the motor's: units, drives, readings; draws first",
        "seed": seed,
        "fineness": fineness,
        "units": list(measured_table().names),
        "drives": list(DRIVES),
        "readings": list(READINGS),
        "searches": {name: asdict(one) for name, one in searches(levels, seed).items()},
        "nominal": short(nominal),
        "draws": short(levels),
    }
