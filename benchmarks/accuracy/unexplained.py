"""The page's paragraph on what neither models nor finite elements explain of the measured levels."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from unitcad.attenuation.edge.closed_form import wave_speed
from unitcad.attenuation.edge.measured import CONTROL, MeasuredTable
from unitcad.attenuation.edge.scoring import Assessment
from unitcad.catalogue import measurements


@dataclass(frozen=True)
class NineLevels:
    """Levels of the table's units by name and shape (motor = 1): a control has one for each shape it was solved in."""

    levels: Mapping[str, Mapping[str, float]]

    def of(self, name: str) -> float:
        """Return one level a unit: the geometric mean over its shapes."""
        return math.exp(sum(map(math.log, self.levels[name].values())) / len(self.levels[name]))

    def in_order(self, table: MeasuredTable) -> tuple[float, ...]:
        """Return the level of every unit, in the table's order."""
        return tuple(self.of(name) for name in table.names)

    def range(self, names: tuple[str, ...]) -> tuple[float, float]:
        """Return the least and largest of single solutions, no means."""
        levels = [level for name in names for level in self.levels[name].values()]
        return min(levels), max(levels)

    def shown(self, name: str) -> str:
        """Return the level as text, and a control's by shape."""
        shapes = self.levels[name]
        apart = ", ".join(f"{level:.3f} {shape}" for shape, level in shapes.items())
        return f"{self.of(name):.3f}" + (f" ({apart})" if len(shapes) > 1 else "")


def unexplained(
    table: MeasuredTable, solved: Mapping[str, NineLevels], closed: Mapping[str, NineLevels], paper: Assessment
) -> str:
    """Write the paragraph.

    `solved`: finite elements by variant, as drawn first; `closed`: the models; `paper`: the paper's assessment.
    """
    soft = tuple(name for name, inside in zip(table.names, table.classes >= 2, strict=True) if inside)
    controls = tuple(name for name in table.names if name.startswith(CONTROL))
    measured = dict(zip(table.names, table.levels.tolist(), strict=True))
    everywhere = ", ".join(f"{_span(levels.range(table.names))} ({name})" for name, levels in solved.items())
    drawn, bare = list(solved.values())[:2]
    moved = {
        (f"{name} {shape}" if name in controls else name): bare.levels[name][shape] / level
        for name in table.names
        for shape, level in drawn.levels[name].items()
    }
    most = max(moved, key=lambda name: abs(math.log(moved[name])))
    return (
        f"**What no model explains.** The units with the soft layer inside were measured at "
        f"{_span(_ends(measured, soft))} of the motor's amplitude, the controls at {_span(_ends(measured, controls))}. "
        "Finite elements with nominal values, nothing fitted, the motor moving along its axis, give unit by unit "
        f"{everywhere}; for those with the soft layer inside "
        f"{', '.join(_span(levels.range(soft)) for levels in solved.values())}. The mesh changes too "
        "little to be the reason (as drawn: its table is below). Of the inputs only the circuit was varied, and its "
        f"stiffness is assumed: without it a level becomes up to {moved[most]:.2g} times what it was ({most}). "
        "Without the circuit Layer 1 fills the space between motor and cap. Not varied here, most of it in the model "
        "`fem`: the motor's axis and the sideways force of a flat ERM, the contact (bonded here), the phantom, "
        "what the measured amplitudes were divided by, the small-strain moduli and damping of the silicones, the air "
        "gap beside the motor, the rigid motor, the tail and its slot (the finite elements are axisymmetric). Any "
        "could be the reason; none is shown to be."
        f"\n\nThe paper's coefficient of two half-spaces puts {paper.directions} of {paper.ratios.count} ratios on the "
        f"measured side of 1 although a layer is {_thinness(table)} of a shear wavelength thick, so agreement with it "
        f"is no proof of its mechanics. {_orders(table, {**closed, **solved})}"
    )


def _orders(table: MeasuredTable, models: Mapping[str, NineLevels]) -> str:
    """Say which models give the measured order of the controls, and that of E10/D30 and E10/D10."""
    measured = dict(zip(table.names, table.levels.tolist(), strict=True))
    controls = sorted((name for name in table.names if name.startswith(CONTROL)), key=measured.__getitem__)
    same = [name for name, m in models.items() if _rising([m.of(control) for control in controls])]
    order = " < ".join(control.split(" ")[1] for control in controls)
    sentences = [f"The measured order of the controls, {order}, is given by {_named(same)}."]
    for design in measurements().designs:
        low, high = sorted((f"{design} E10/D30", f"{design} E10/D10"), key=measured.__getitem__)
        above = [name for name, m in models.items() if _rising([m.of(low), m.of(high)])]
        sentences.append(f"{high} above {low.split(' ')[1]}, as was measured, is given by {_named(above)}.")
    return " ".join(sentences)


def _rising(levels: list[float]) -> bool:
    return all(b > a * (1 + 1e-6) for a, b in itertools.pairwise(levels))


def _named(names: list[str]) -> str:
    return "; ".join(names) or "nothing here"


def _thinness(table: MeasuredTable) -> str:
    """Return the layers of the layered units over their shear wavelength, thickest and thinnest."""
    shares = []
    for i, layers in enumerate(table.layers):
        u = table.inputs[i]
        if len(layers) > 1:
            speed = wave_speed(u.youngs_modulus, u.density, u.poisson_ratio, "s")
            shares += np.ravel(2 * np.pi * speed / u.omega / u.thickness).tolist()
    return f"1/{min(shares):.0f} to 1/{max(shares):.0f}"


def _ends(levels: Mapping[str, float], names: tuple[str, ...]) -> tuple[float, float]:
    return min(levels[name] for name in names), max(levels[name] for name in names)


def _span(ends: tuple[float, float]) -> str:
    return f"{ends[0]:.2f} to {ends[1]:.2f}"
