"""Volume, mass, centre of mass and inertia of a unit's bodies, from their meshes and the catalogue's densities."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from unitcad import text
from unitcad.catalogue import materials, motors
from unitcad.estimate_inputs import motor_mass
from unitcad.kernels.mesh import arrays
from unitcad.moulds.mould_set import MouldSet
from unitcad.shape.tree import Body
from unitcad.spec import Spec

CIRCUIT_G_CM3 = 1.9
"""Density of a flexible circuit (assumed): polyimide of 1.42 g/cm3 with a tenth of copper and adhesive."""
WIRE_G_CM3 = 4.0
"""Density of a wire with its insulation (assumed): copper over a third of its section, plastic over the rest."""


@dataclass(frozen=True)
class MassProperties:
    """Mass properties of a unit or of one of its bodies, in the frame of the unit: z = 0 at the skin.

    Parameters
    ----------
    volume_mm3 : float
        Volume, mm3.
    mass_g : float
        Mass, g.
    centre_mm : tuple of float
        Centre of mass (x, y, z), mm.
    inertia_g_mm2 : numpy.ndarray
        Tensor of inertia about the centre of mass, shape (3, 3), g mm2.
    density_source : str
        Source of the density; "" for a unit.
    parts : dict of str to MassProperties
        The bodies of a unit by name.

    Examples
    --------
    >>> import unitcad
    >>> whole = unitcad.Variant.of("encapsulating").mass_properties()
    >>> round(whole.parts["layer2"].mass_g, 2), round(whole.mass_g, 2) > 0.6
    (0.39, True)
    """

    volume_mm3: float
    mass_g: float
    centre_mm: tuple[float, float, float]
    inertia_g_mm2: np.ndarray
    density_source: str = ""
    parts: Mapping[str, MassProperties] = field(default_factory=dict)

    def __repr__(self) -> str:
        x, y, z = self.centre_mm
        return f"MassProperties({self.mass_g:.4g} g, {self.volume_mm3:.5g} mm3, centre ({x:.3g}, {y:.3g}, {z:.3g}) mm)"

    def _repr_html_(self) -> str:
        rows = [
            (name, one.volume_mm3, one.mass_g, ", ".join(f"{at:.3g}" for at in one.centre_mm), one.density_source)
            for name, one in {**self.parts, "all": self}.items()
        ]
        return text.table(("body", "volume, mm³", "mass, g", "centre, mm", "density"), rows)


def mass_properties(moulds: MouldSet) -> MassProperties:
    """Return the mass properties of a set's unit, and of each body in it."""
    parts = {body.name: _of_body(moulds, body) for body in moulds.unit}
    masses = np.array([one.mass_g for one in parts.values()])
    centres = np.array([one.centre_mm for one in parts.values()])
    centre = masses @ centres / masses.sum()
    inertia = sum(
        one.inertia_g_mm2 + one.mass_g * _steiner(at - centre) for one, at in zip(parts.values(), centres, strict=True)
    )
    volume = sum(one.volume_mm3 for one in parts.values())
    return MassProperties(volume, float(masses.sum()), _point(centre), np.asarray(inertia), parts=parts)


def _of_body(moulds: MouldSet, body: Body) -> MassProperties:
    """Return the properties of a body by the volume integrals over its mesh's tetrahedra from the origin."""
    vertices, triangles = arrays(moulds.mesh(body))
    corners = np.asarray(vertices, float)[np.asarray(triangles)]
    middle = corners.reshape(-1, 3).mean(axis=0)  # near the body: no digits are lost far from the origin
    corners = corners - middle
    sixth = np.linalg.det(corners) / 6.0
    volume = float(sixth.sum())
    total = corners.sum(axis=1)
    centre = np.einsum("i,ij->j", sixth, total) / (4.0 * volume)
    # Of a tetrahedron at the origin: the integral of x x^T is its volume times (s s^T + sum of c c^T) / 20.
    second = np.einsum("i,ij,ik->jk", sixth, total, total) + np.einsum("i,inj,ink->jk", sixth, corners, corners)
    about = second / 20.0 - volume * np.outer(centre, centre)
    g_mm3, source = _density(moulds.spec, body, volume)
    inertia = g_mm3 * (np.trace(about) * np.eye(3) - about)
    return MassProperties(volume, g_mm3 * volume, _point(centre + middle), inertia, source)


def _density(spec: Spec, body: Body, volume_mm3: float) -> tuple[float, str]:
    """Return a body's density in g/mm3 and its source."""
    if body.kind == "motor":
        motor = motors(spec.motors)[spec.motor.part] if spec.motor.part else None
        kg = motor_mass(spec, motor)
        return 1e3 * kg.middle / volume_mm3, kg.note or "mass of the catalogue's motor"
    step = body.step if body.made == "cast" else None
    if step is not None or body.kind == "film":  # a film without a pour is of the last layer's silicone
        silicone = materials(spec.materials)[spec.layers[-1 if step is None else step - 1].material]
        return float(silicone.density_g_cm3) / 1e3, f"{silicone.name}: {silicone.density_g_cm3.source}"
    assumed = WIRE_G_CM3 if body.kind == "wire" else CIRCUIT_G_CM3
    return assumed / 1e3, f"assumed: {assumed:g} g/cm3"


def _steiner(offset: np.ndarray) -> np.ndarray:
    """Return the inertia of a unit mass at an offset."""
    return float(offset @ offset) * np.eye(3) - np.outer(offset, offset)


def _point(at: Sequence[float] | np.ndarray) -> tuple[float, float, float]:
    x, y, z = (float(one) for one in at)
    return x, y, z
