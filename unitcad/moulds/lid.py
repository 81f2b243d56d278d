"""The lid for injection: a flat plate on a cup's rim with sprue and vents to every cavity, and a skirt to centre it.

    .---------. .----. .----------.   vents at the rim, halfway between the axes
    |         | |sprue| |          |
    '-.  .----'-'-----'-'-----.  .-'   z = rim
      |  |       cavity       |  |   skirt round the cup, above the windows

Over a ring, whose width no syringe's tip fits, the sprue narrows to a gate and replaces the first vent.
"""

from __future__ import annotations

import math

from unitcad.designs import Dimensions
from unitcad.designs.parts import BEYOND
from unitcad.designs.tooling import Layout
from unitcad.errors import Refusal
from unitcad.moulds.base import outline
from unitcad.moulds.cup import window_section
from unitcad.moulds.layout import MARK
from unitcad.moulds.trapped_air import MESH_ROOM, TILT_DEG, deepest
from unitcad.shape import Extrude, Revolve, Shape, cut, cylinder, moved, polygon
from unitcad.spec import Spec

THICKNESS, SKIRT, SKIRT_WALL, SKIRT_OFF_WINDOW = 3.0, 1.5, 1.6, 0.2
VENT, LEAST_VENT = 1.0, 0.8
"""Diameter of a vent, mm, and its least value over a narrow ring."""
VENT_COUNTS = tuple(range(4, 65, 4))
"""Multiples of four: the tilts of C400 then fall halfway between two vents, the worst case."""
SPRUE_OFF_VENT = 0.1
"""Wall between sprue and vents at the lid's upper face, at least, mm."""
GATE = 0.8
"""Diameter of an opening into a ring, over the ring's width."""


def lid(spec: Spec, dims: Dimensions, lay: Layout, layer: int) -> Shape:
    """Draw the lid of a layer's pour (from 0), lying on the cup's rim."""
    rim, top, play = dims.heights[layer], lid_top(dims, layer), spec.moulds.plinth_clearance_mm
    low = skirt_end(spec, dims, layer)
    tools = [Extrude(outline(lay.cup, MARK, play), low - BEYOND, rim), *channels(spec, dims, lay, layer, beyond=BEYOND)]
    return cut(Extrude(outline(lay.cup, MARK, play + SKIRT_WALL), low, top), tools)


def skirt_end(spec: Spec, dims: Dimensions, layer: int) -> float:
    """Return z of the lower edge of a lid's skirt: above the windows, a whole layer from its printed underside."""
    rim, top, height = dims.heights[layer], lid_top(dims, layer), spec.moulds.layer_mm
    low = rim - SKIRT
    if dims.exit:
        low = max(low, window_section(spec, dims.exit, rim)[2] + SKIRT_OFF_WINDOW)
    return top - math.floor((top - low) / height + 1e-6) * height


def lid_top(dims: Dimensions, layer: int) -> float:
    """Return z of the lid's upper face, at which sprue and vents are open."""
    return dims.heights[layer] + THICKNESS


def channels(spec: Spec, dims: Dimensions, lay: Layout, layer: int, beyond: float = 0.0) -> list[Shape]:
    """Draw sprue and vents, cell by cell, as they fill with silicone; `beyond` (mm) makes them longer at both ends."""
    rim, top, sprue = dims.heights[layer], lid_top(dims, layer), spec.moulds.sprue_mm / 2
    inner, outer = _ceiling(dims, layer)
    vent, count = vent_diameter(dims, layer) / 2, vents(spec, dims, layer)
    _check_sprue(spec, dims, layer, count)
    turns = [math.tau * (k + 0.5) / count for k in range(count)]
    drawn = [
        moved(cylinder(vent, rim - beyond, top + beyond), (outer - vent) * math.cos(a), (outer - vent) * math.sin(a))
        for a in turns
    ]
    if inner:
        gate, middle = min(sprue, GATE * (outer - inner) / 2), (inner + outer) / 2
        below = [(0, rim - beyond), (gate, rim - beyond)] if beyond else [(0, rim)]
        above = [(sprue, top + beyond), (0, top + beyond)] if beyond else [(0, top)]
        cone = Revolve(polygon(*below, (gate, rim), (sprue, top), *above))
        drawn[0] = moved(cone, middle * math.cos(turns[0]), middle * math.sin(turns[0]))
    else:
        drawn.insert(0, cylinder(sprue, rim - beyond, top + beyond))
    return [moved(shape, c.x, c.y) for c in lay.cells for shape in drawn]


def _check_sprue(spec: Spec, dims: Dimensions, layer: int, count: int) -> None:
    """Raise Refusal for a sprue that runs into the vents."""
    inner, outer = _ceiling(dims, layer)
    vent = vent_diameter(dims, layer) / 2
    middle, rim = (inner + outer) / 2 if inner else 0.0, outer - vent
    apart = math.sqrt(middle**2 + rim**2 - 2 * middle * rim * math.cos(math.tau / count))
    most = math.floor(200 * (apart - vent - SPRUE_OFF_VENT)) / 100
    if spec.moulds.sprue_mm > most + 1e-9:
        limit = f"between {count} vents of {2 * vent:g} mm the sprue of pour {layer + 1} has at most {most:g} mm"
        raise Refusal("moulds.sprue_mm", spec.moulds.sprue_mm, limit, most if most > 0 else None)


def vent_diameter(dims: Dimensions, layer: int) -> float:
    """Return the diameter of each vent, mm: 1, or less over a narrow ring."""
    inner, outer = _ceiling(dims, layer)
    return min(VENT, GATE * (outer - inner)) if inner else VENT


def vents(spec: Spec, dims: Dimensions, layer: int) -> int:
    """Return how many vents a cavity has: as asked for, or the least number that clears the air.

    Raises Refusal for a number that can't clear, naming one that would, and for a ring too narrow for a vent.
    """
    inner, outer = _ceiling(dims, layer)
    width = GATE * (outer - inner)
    if _at_the_rim(dims, layer):
        # The tongue parts the ring: air would be trapped next to it, whatever the number of vents.
        raise Refusal("moulds.pour", "injected", "wires that leave at the rim need an open pour", "open")
    if inner and width < LEAST_VENT - 1e-9:
        raise Refusal(
            f"layers.{layer}.wall_mm",
            spec.layers[layer].wall_mm,
            f"a ring under a lid takes a vent of {LEAST_VENT} mm from {LEAST_VENT / GATE:g} mm on",
            LEAST_VENT / GATE,
        )
    limit = MESH_ROOM * deepest(spec, layer)
    enough = next((n for n in VENT_COUNTS if pocket_depth(dims, layer, n) <= limit), VENT_COUNTS[-1])
    asked = spec.moulds.vents
    if asked is None:
        return enough
    if asked % 4 or asked > VENT_COUNTS[-1]:
        nearest = min(VENT_COUNTS, key=lambda n: (n < enough, abs(n - asked)))
        raise Refusal("moulds.vents", asked, f"vents come in fours, up to {VENT_COUNTS[-1]}", nearest)
    if asked < enough:
        depth = pocket_depth(dims, layer, asked)
        raise Refusal(
            "moulds.vents",
            asked,
            f"tilted by {TILT_DEG:g} degrees, pour {layer + 1} keeps a pocket {depth:.3f} mm deep between two vents, "
            f"more than {limit:.3f}; {enough} would clear it",
            enough,
        )
    return asked


def pocket_depth(dims: Dimensions, layer: int, count: int) -> float:
    """Return the depth of the air that stays halfway between two of `count` vents when the lid is tilted there, mm.

    The rim's highest point is at the outer radius r; a vent's at (r - v) cos(pi / n) + v, v being the vent's radius.
    """
    outer, vent = _ceiling(dims, layer)[1], vent_diameter(dims, layer) / 2
    return (outer - vent) * (1 - math.cos(math.pi / count)) * math.sin(math.radians(TILT_DEG))


def _ceiling(dims: Dimensions, layer: int) -> tuple[float, float]:
    """Return inner and outer radius of the flat top of a layer; the inner one is 0 for a cap."""
    inside, top = dims.outside(layer - 1)[-1]
    return (inside if top >= dims.heights[layer] else 0.0), dims.rim_radius(layer)


def _at_the_rim(dims: Dimensions, layer: int) -> bool:
    return dims.exit is not None and dims.exit.high >= dims.heights[layer]
