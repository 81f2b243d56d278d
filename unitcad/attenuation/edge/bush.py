"""The unit as bonded rubber bushes in a row: how much of a motor's sideways motion reaches the edge, in closed form.

A flat motor moves sideways. Layer i is a ring bonded to what is inside it and to the layer round it. Its stiffness
against a sideways motion of its inside relative to its outside is that of a short bush, with cap and floor in shear:

    K_i = G_i (beta_i h_i + 2 pi r_i^2 / c_i),    G = E (1 + i tan delta) / (2 (1 + nu))

h_i is the height and r_i the radius of what it closes over, c_i the thickness of its cap (open rings have neither cap
nor floor). beta is that of a rigid disc in a rigid ring with a bonded annulus from a to b between them:

    beta = 2 pi kappa (kappa + 1) / (kappa^2 ln(b/a) - (b^2 - a^2)/(b^2 + a^2))

with Kolosov's constant kappa = (3 - nu)/(1 + nu) in plane stress: the short bush, free to bulge at its ends. At
nu = 1/2 that is 80 pi (a^2 + b^2) / (25 (a^2 + b^2) ln(b/a) - 9 (b^2 - a^2)) (Adkins and Gent, British Journal of
Applied Physics 5, 354, 1954). A long bush has kappa = 3 - 4 nu (plane strain): 4 pi over the same with kappa = 1.

Each layer outside the first stands on a stiff base, and what it closes over moves it there in shear:

    B_i = G_i (pi (b_i^2 - a_i^2) / H_i + pi a_i^2 / c_i)

H_i is its whole height, the second part its floor. The motions u_i at the inner faces follow from the balance of
forces, K_(i-1) (u_(i-1) - u_i) = B_i u_i + K_i (u_i - u_(i+1)), and the outermost layer moves with its inner face.
Two layers make a divider, u = 1 / (1 + B_2/K_1): kappa n of `closed_form.divider` follows from lengths. A single layer
counts as two of half its wall and cap, as the measured controls stand beside units of two.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from unitcad.attenuation.edge.closed_form import Section, Units
from unitcad.attenuation.inputs import Geometry


@dataclass(frozen=True)
class Form:
    """A reading of the bushes.

    `floors`: layers with caps have floors as thick; otherwise the motor lies on the skin, as unitcad draws it.
    `filled`: Layer 1 reaches the motor even where the design leaves a gap. `long`: the bush in plane strain.
    """

    floors: bool = True
    filled: bool = False
    long: bool = False


CHOSEN = Form()
"""The form behind the model `bush`."""


def sections(geometries: Sequence[Geometry]) -> Section:
    """Return the lengths of units of one number of layers, an array row each."""
    return Section(
        cavity_radius=[g.cavity_radius for g in geometries],
        motor_radius=[g.motor_radius for g in geometries],
        core_height=[g.core_height for g in geometries],
        outer_radii=[[layer.outer_radius for layer in g.layers] for g in geometries],
        caps=[[layer.cap for layer in g.layers] for g in geometries],
    )


def bush_coefficient(inner: Any, outer: Any, poisson_ratio: Any, long: bool = False) -> Any:
    """Return beta: force over shear modulus, length and sideways motion of a bonded annulus of those radii (m)."""
    nu = poisson_ratio
    kappa = 3.0 - 4.0 * nu if long else (3.0 - nu) / (1.0 + nu)
    ratio = (outer / inner) ** 2
    spread = kappa**2 * np.log(ratio) / 2.0 - (ratio - 1.0) / (ratio + 1.0)
    return 2.0 * np.pi * kappa * (kappa + 1.0) / spread


def bush(units: Units, form: Form = CHOSEN) -> Any:
    """Return the edge's motion over the motor's, shape (...), without the constant s.

    Raises ValueError for units without a section.
    """
    if units.section is None:
        raise ValueError("bush reads a unit's section")
    shear = units.youngs_modulus / (2.0 * (1.0 + units.poisson_ratio)) * (1.0 + 1j * units.tan_delta)
    nu, cap, outer = units.poisson_ratio, units.section.caps, units.section.outer_radii
    core = units.section.motor_radius if form.filled else units.section.cavity_radius
    sides = 2.0 if form.floors else 1.0
    if outer.shape[-1] == 1:
        outer = np.concatenate([(outer + core[..., None]) / 2.0, outer], axis=-1)
        shear, nu, cap = (np.repeat(each, 2, axis=-1) for each in (shear, nu, cap / 2.0))
    inner = np.concatenate([np.broadcast_to(core[..., None], outer[..., :1].shape), outer[..., :-1]], axis=-1)
    faces = np.concatenate([units.section.motor_radius[..., None] + 0.0 * inner[..., :1], inner[..., 1:]], axis=-1)
    height = units.section.core_height[..., None] + sides * np.cumsum(cap, axis=-1)
    within = height - sides * cap
    per_cap = np.divide(np.pi, cap, out=np.zeros(cap.shape), where=cap > 0)
    stiffness = shear * (bush_coefficient(inner, outer, nu, form.long) * within + sides * per_cap * faces**2)
    ring = np.pi * (outer**2 - inner**2) / height
    base = shear * (ring + (per_cap * inner**2 if form.floors else 0.0))
    motion, load = 1.0, base[..., -1]
    with np.errstate(invalid="ignore"):  # a modulus that is not known is NaN, and so is the level
        for i in range(outer.shape[-1] - 2, -1, -1):
            passed = stiffness[..., i] / (stiffness[..., i] + load)
            motion, load = motion * passed, base[..., i] + passed * load
    return np.abs(motion)
