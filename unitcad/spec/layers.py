"""Whole layers of a printer over its bed, the first of them of its own height."""

from __future__ import annotations

import math
from dataclasses import dataclass

from unitcad.spec.resolved import Spec

EPS = 1e-6
"""Share of a layer within which a height is at the end of one."""


@dataclass(frozen=True)
class Layers:
    """Layers of one height (mm) on a first one of another.

    Examples
    --------
    >>> from unitcad.spec.layers import Layers
    >>> layers = Layers(first=0.3, height=0.2)
    >>> round(layers.printed(8.11), 3), round(layers.up(4.0), 3), round(layers.down(4.0), 3)
    (8.1, 4.1, 3.9)
    """

    first: float
    height: float

    def printed(self, height: float) -> float:
        """Return the end of the last layer that a slicer makes of a solid as high as that: it cuts each at its middle.

        ``first + n h`` with ``n = floor((height - first) / h + 1/2)``; nothing below half of the first layer.
        """
        if height < self.first / 2 - EPS * self.height:
            return 0.0
        return self._end(math.floor((height - self.first) / self.height + 0.5 + EPS))

    def up(self, height: float) -> float:
        """Return the least end of a layer that is not below a height."""
        return self._end(math.ceil((height - self.first) / self.height - EPS))

    def down(self, height: float) -> float:
        """Return the largest end of a layer that is not above a height; 0, the bed, below the first one."""
        if height < self.first - EPS * self.height:
            return 0.0
        return self._end(math.floor((height - self.first) / self.height + EPS))

    def nearest(self, height: float) -> float:
        """Return the end of a layer nearest to a height, at least that of the first one."""
        return self._end(math.floor((height - self.first) / self.height + 0.5 + EPS))

    def steps(self, height: float) -> float:
        """Return a height in whole layers over the end of another layer, not less than it is."""
        return math.ceil(height / self.height - EPS) * self.height

    def _end(self, count: int) -> float:
        return round(self.first + max(count, 0) * self.height, 9)


def layers_of(spec: Spec) -> Layers:
    """Return the layers that the tools of a spec are printed in."""
    return Layers(spec.moulds.first_layer_mm, spec.moulds.layer_mm)
