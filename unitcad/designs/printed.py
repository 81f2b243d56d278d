"""Heights as a printer makes them: whole layers over its bed, the first of them of its own height.

A slicer cuts each layer at its middle, so a face at a height becomes the end of the layer whose middle it just covers.

bed |___first___|_height_|_height_|    printed(h) = first + n height, n = floor((h - first) / height + 1/2)
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from unitcad.designs.dimensions import Dimensions, growth
from unitcad.spec import Spec
from unitcad.spec.layers import EPS, Layers, layers_of

OVER_ALL = "height over all"
SHORT = 0.05
"""By how much a printed cavity may be shallower than its content, mm: calipers hardly show it (assumed)."""
NEAR_TIE = 0.05
"""Share of a layer from a middle within which a slicer may round either way."""


@dataclass(frozen=True)
class Height:
    """A height of the cured unit, mm: as asked for, and as whole layers of the tools make it."""

    what: str
    asked_mm: float
    printed_mm: float

    @property
    def error(self) -> float:
        """The printed height's error, as a share of the asked one."""
        return abs(self.printed_mm / self.asked_mm - 1)


def in_layers(spec: Spec, dims: Dimensions) -> Dimensions:
    """Return the lengths of tools whose cavity and caps print right, from those of the silicone.

    Each cap is rounded over the one below as it is printed, so that errors do not add up, and a cavity whose content
    would not fit goes up by a layer. Only a height that a slicer would round otherwise is moved, to its whole layer.
    """
    layers, seat = layers_of(spec), _seat(spec)

    def kept(height: float, target: float, bed: float) -> float:
        """Return a height over the seat that prints as `target`: itself, or else the target."""
        both = {layers.printed(bed + height + off * layers.height) for off in (-NEAR_TIE, NEAR_TIE)}
        return height if both == {layers.printed(bed + target)} else target

    core = dims.core_height
    capped = [height > core + EPS for height in dims.heights]
    if any(capped):
        printed = layers.printed(seat + core) - layers.printed(seat)
        if printed < core - SHORT:
            printed = layers.up(layers.printed(seat) + core) - layers.printed(seat)
        core = kept(core, printed, seat)
        below = printed, dims.core_height
    else:
        below = 0.0, 0.0
    heights = []
    for height, has_cap in zip(dims.heights, capped, strict=True):
        start = below if has_cap else (0.0, 0.0)
        target = _nearest(layers, start[0] + height - start[1], height)
        if not has_cap and target < height - SHORT:  # the motor would stand out of an open ring
            target = layers.up(height)
        heights.append(kept(height, target, 0.0))
        below = target, height
    if not any(capped):  # a core below its rim would leave a film over the ring's opening
        core = max(core, *heights)
    exit = dims.exit
    if exit and exit.high >= dims.heights[0] - EPS:  # a notch stays open at the top
        exit = replace(exit, high=heights[0])
    return replace(dims, core_height=core, heights=tuple(heights), exit=exit)


def _seat(spec: Spec) -> float:
    """Return the height of the seat over the bed of the base, mm."""
    return spec.moulds.plate_mm + spec.moulds.plinth_height_mm


def _nearest(layers: Layers, wanted: float, drawn: float) -> float:
    """Return the end of a layer nearest to a height; of two alike the one nearer to the height as drawn."""
    low, high = layers.down(wanted), layers.up(wanted)
    if abs((wanted - low) - (high - wanted)) < 2 * NEAR_TIE * layers.height:
        return min((low, high), key=lambda end: abs(end - drawn))
    return low if wanted - low < high - wanted else high


def printed_heights(spec: Spec, asked: Dimensions, tools: Dimensions, seat: float) -> list[Height]:
    """Return the cavity's depth, each layer's cap (or height), and the height over all, as printed.

    `asked`: the unit's lengths; `tools`: those that the tools are drawn to; `seat`: its height over the base's bed, mm.
    They are heights of the cured unit.
    """
    layers, shrunk = layers_of(spec), growth(spec)
    core = layers.printed(seat + tools.core_height) - layers.printed(seat)
    capped = [height > asked.core_height + EPS for height in asked.heights]
    heights = [Height("cavity", asked.core_height, core / shrunk)] if any(capped) else []
    below = core, asked.core_height
    for i, (height, drawn, cap) in enumerate(zip(asked.heights, tools.heights, capped, strict=True), 1):
        printed, low = layers.printed(drawn), below if cap else (0.0, 0.0)
        name = f"layer {i}'s {'cap' if cap else 'height'}"
        heights.append(Height(name, height - low[1], (printed - low[0]) / shrunk))
        below = printed, height
    heights.append(Height(OVER_ALL, below[1], below[0] / shrunk))
    return [replace(each, asked_mm=round(each.asked_mm, 4), printed_mm=round(each.printed_mm, 4)) for each in heights]
