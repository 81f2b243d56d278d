"""What a rival is, and draws of what it does not know: material constants within their ranges, fitted constants.

A rival predicts the amplitude at a unit's edge over the motor's. What multiplies all of its readings by one number
cancels in the ratios that are compared.

Draws are spread evenly (`attenuation.even_draws`). Every name has a stream of its own: a new name changes no other.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from unitcad.attenuation.edge.bush import sections
from unitcad.attenuation.edge.closed_form import Units
from unitcad.attenuation.even_draws import positions
from unitcad.attenuation.inputs import EstimateInput, Quantity, SiliconeLayer


@dataclass(frozen=True)
class Draws:
    """Draws for one rival. Of one name all conditions of a draw share the value.

    count  how many are spread evenly
    kept   indices of those that are there, all for None
    held   they are, or will be, held to measured levels: a constant that is fitted to these has its prior instead
    """

    count: int
    seed: int
    rival: str = ""
    kept: tuple[int, ...] | None = None
    held: bool = False

    @property
    def indices(self) -> tuple[int, ...]:
        """Which of the `count` are there."""
        return tuple(range(self.count)) if self.kept is None else self.kept

    def uniform(self, name: str) -> np.ndarray:
        """Return the draws of that name between 0 and 1, shape (draws,)."""
        found = positions(self.seed, f"{self.rival}\n{name}", self.count)
        return found if self.kept is None else found[list(self.kept)]

    def between(self, name: str, low: float, high: float) -> np.ndarray:
        """Return draws from `low` to `high`, uniform in the logarithm if both are above 0."""
        part = self.uniform(name)
        return low * (high / low) ** part if low > 0 else low + (high - low) * part

    def quantity(self, name: str, quantity: Quantity) -> np.ndarray:
        """Return draws within a quantity's range; its value where it has none."""
        return self.between(name, *quantity.ends)

    def silicone(self, layer: SiliconeLayer) -> dict[str, np.ndarray]:
        """Return draws of a layer's modulus (Pa), Poisson's ratio and loss factor, the same for all of its material."""
        return {
            "youngs_modulus": self.quantity(f"{layer.material}.youngs_modulus", layer.youngs_modulus),
            "poisson_ratio": self.quantity(f"{layer.material}.poisson_ratio", layer.poisson_ratio),
            "tan_delta": self.quantity(f"{layer.material}.tan_delta", layer.tan_delta),
        }

    def units(self, variant: EstimateInput) -> Units:
        """Return the closed forms' input of a variant, a row for each draw, at the variant's frequency."""
        drawn = [self.silicone(layer) for layer in variant.layers]
        columns = {field: np.stack([one[field] for one in drawn], axis=-1) for field in drawn[0]}
        return Units(
            **columns,
            density=np.tile([layer.density for layer in variant.layers], (len(self.indices), 1)),
            thickness=np.tile([layer.thickness for layer in variant.layers], (len(self.indices), 1)),
            omega=np.full(len(self.indices), 2.0 * np.pi * variant.frequency.middle),
            passes=variant.passes,
            section=sections([variant.geometry]),
        )


@dataclass(frozen=True)
class Rival:
    """An account of the level: its name, what it says, and `levels`, draws of a variant's reading, shape (draws,).

    `costly`: a draw is not a matter of microseconds. `unread` tells in which draws an instrument shows its own noise
    instead of a reading, shape (draws,); None where nothing limits the readings.
    """

    name: str
    says: str
    levels: Callable[[EstimateInput, Draws], np.ndarray]
    costly: bool = False
    unread: Callable[[EstimateInput, Draws], np.ndarray] | None = None
