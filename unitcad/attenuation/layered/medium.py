"""A layered half-space and its displacement under a load."""

from __future__ import annotations

from typing import Any

from unitcad.attenuation.layered.loads import Load
from unitcad.attenuation.layered.response import Response, respond
from unitcad.attenuation.layered.stack import HalfSpace, Layer, Stack

__all__ = ["HalfSpace", "Layer", "LayeredMedium"]


class LayeredMedium(Stack):
    """Layers, top first, on a half-space: `LayeredMedium(layers, half_space)`.

    >>> from unitcad.attenuation import HalfSpace, Layer, LayeredMedium, LossFactor, UniformDisc
    >>> skin = Layer(thickness=1.5e-3, density=1100, youngs_modulus=130e3, poisson_ratio=0.49, damping=LossFactor(0.14))
    >>> medium = LayeredMedium([skin], HalfSpace(density=1050, youngs_modulus=12e3, poisson_ratio=0.495))
    >>> response = medium.response(UniformDisc(3.5e-3), omega=785.0, r=[7e-3, 20e-3], rtol=1e-6)
    >>> response.u_z.shape
    (2,)
    >>> bool(response.error < 1e-6 * abs(response.u_z).max())
    True
    """

    def response(self, load: Load, omega: float, r: Any, z: float = 0.0, rtol: float = 1e-6) -> Response:
        """Return the displacement at radii r (m, any shape) and depth z (m) under `load` at omega (rad/s).

        In metres per pascal under a `UniformDisc`, per newton under a `Point`; rtol is the wanted error over the
        largest |u| of all radii. Raises `Refusal` and `UnitcadError` as `unitcad.attenuation.layered.response.respond`.
        """
        return respond(self, load, omega, r, z, rtol)
