"""Lids for injection, air that they would trap, and the tray of the film that closes a unit's skin side.

    .---------. .----. .----------.   vents at the rim, halfway between the axes
    |         | |sprue| |          |
    '-.  .----'-'-----'-'-----.  .-'   z = rim
      |  |       cavity       |  |   skirt round the cup, above the windows

Over a ring, whose width no syringe's tip fits, the sprue narrows to a gate and replaces the first vent.

The tray of the film that closes a unit's skin side: filled, struck off, and the unit set onto the wet film.

        .---.  .------------------.  .---.   rim, with the blade's groove round each recess
        |   '--'   film, skin_mm  '--'   |
        '--------------------------------'   floor

It has the outline of the cups, and its rim the height of the last one: the blade and the labels fit both.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from manifold3d import CrossSection

from unitcad.designs import Dimensions
from unitcad.designs.design import BEYOND
from unitcad.designs.dimensions import WIRE_GAP, Exit
from unitcad.designs.limits import EPS, down
from unitcad.errors import Refusal
from unitcad.kernels.mesh import thick_parts, widest
from unitcad.moulds.base import outline
from unitcad.moulds.cup import grooves, window_section
from unitcad.moulds.layout import MARK, Frame
from unitcad.shape import Extrude, Revolve, Shape, cut, cylinder, mm, moved, polygon, union
from unitcad.spec import Spec
from unitcad.spec.layers import layers_of

TILT_DEG = 5.0
"""The tilt that a mould must bear on the bench."""
DENT = 0.1
"""Depth of a pocket of air over the layer's thinnest part, up to which it is a dent that the printer's play exceeds."""
MESH_ROOM = 0.8
"""The part of that depth that vents and tongues may use: a mesh's polygons, and a gate in a vent's place, add to it."""


def deepest(spec: Spec, layer: int) -> float:
    """Return the depth of a dent that a layer (from 0) bears, mm."""
    drawn = spec.layers[layer]
    return DENT * min(drawn.wall_mm, drawn.cap_mm if drawn.cap_mm else drawn.wall_mm)


def under_tongue(dims: Dimensions, exit: Exit, layer: int) -> float:
    """Return the depth of the air trapped under a tongue at the bore, the mould tilted towards it, mm.

    The tongue's flat underside is a ceiling; its highest point is on the bore at r, and the way out leads round to the
    tongue's edge, half a width h aside: lower by (r - sqrt(r^2 - h^2)) sin(tilt).
    """
    bore, half = dims.radii[layer], exit.width / 2
    return (bore - math.sqrt(max(bore**2 - half**2, 0.0))) * math.sin(math.radians(TILT_DEG))


def widest_tongue(frame: Frame, layer: int) -> float:
    """Return the width up to which air under a tongue gets out of a pour, mm: `under_tongue` solved for it."""
    bore = frame.dims.radii[layer]
    drop = min(MESH_ROOM * deepest(frame.spec, layer) / math.sin(math.radians(TILT_DEG)), bore)
    return 2 * math.sqrt(bore**2 - (bore - drop) ** 2)


def check_tongue(frame: Frame) -> None:
    """Raise Refusal if a tongue is too wide for the air under it to get out."""
    spec, dims = frame.spec, frame.dims
    widths = [widest_tongue(frame, layer) for layer in range(len(spec.layers))]
    if not dims.exit or dims.exit.width <= min(widths) + EPS:
        return
    layer = widths.index(min(widths))
    widest = widths[layer] - spec.moulds.slot_width_clearance_mm
    depth = under_tongue(dims, dims.exit, layer)
    why = (
        f"tilted by {TILT_DEG:g} degrees, pour {layer + 1} keeps {depth:.3f} mm of air under the tongue, more than "
        f"{MESH_ROOM * deepest(spec, layer):.3f}"
    )
    if spec.wires:
        each = down((widest + WIRE_GAP) / spec.wires.count - WIRE_GAP)
        raise Refusal("wires.diameter_mm", spec.wires.diameter_mm, why, each if each > 0 else None)
    tail = spec.fpcb.tail_width_mm if spec.fpcb else 0.0
    raise Refusal("fpcb.tail_width_mm", tail, why, down(widest) if widest > 0.001 else None)


THICKNESS, SKIRT, SKIRT_WALL, SKIRT_OFF_WINDOW = 3.0, 1.5, 1.6, 0.2
VENT, LEAST_VENT = 1.0, 0.8
"""Diameter of a vent, mm, and its least value over a narrow ring."""
VENT_COUNTS = tuple(range(4, 65, 4))
"""Multiples of four: the tilts of C400 then fall halfway between two vents, the worst case."""
SPRUE_OFF_VENT = 0.1
"""Wall between sprue and vents at the lid's upper face, at least, mm."""
GATE = 0.8
"""Diameter of an opening into a ring, over the ring's width."""


def lid(frame: Frame, layer: int, drilled: Sequence[Shape], cores: Sequence[Shape] = ()) -> Shape:
    """Draw the lid of a layer's pour (from 0), on the cup's rim: with channels `drilled`, and `cores` under it."""
    rim, top, play = frame.dims.heights[layer], lid_top(frame.dims, layer), frame.spec.moulds.plinth_clearance_mm
    low = skirt_end(frame, layer)
    room = Extrude(outline(frame.lay.cup, MARK, play), low - BEYOND, rim)
    plate = Extrude(outline(frame.lay.cup, MARK, play + SKIRT_WALL), low, top)
    if cores:
        # A core has nothing over it, so a copy of it that is higher only joins it to the plate.
        return cut(union((cut(plate, [room]), *cores, *(moved(core, z=BEYOND) for core in cores))), drilled)
    return cut(plate, [room, *drilled])


def skirt_end(frame: Frame, layer: int) -> float:
    """Return z of the lower edge of a lid's skirt: above the windows, a whole layer from its printed underside."""
    dims = frame.dims
    rim, top, layers = dims.heights[layer], lid_top(dims, layer), layers_of(frame.spec)
    low = rim - SKIRT
    if dims.exit:
        low = max(low, window_section(frame.spec, dims.exit, rim)[2] + SKIRT_OFF_WINDOW)
    return top - layers.down(top - low)


def lid_top(dims: Dimensions, layer: int) -> float:
    """Return z of the lid's upper face, at which sprue and vents are open."""
    return dims.heights[layer] + THICKNESS


def channels(frame: Frame, layer: int, beyond: float = 0.0) -> list[Shape]:
    """Draw sprue and vents, cell by cell, as they fill with silicone; `beyond` (mm) makes them longer at both ends."""
    dims = frame.dims
    rim, top, sprue = dims.heights[layer], lid_top(dims, layer), frame.spec.moulds.sprue_mm / 2
    inner, outer = _ceiling(dims, layer)
    vent, count = vent_diameter(dims, layer) / 2, vents(frame, layer)
    _check_sprue(frame, layer, count)
    turns = [math.tau * (k + 0.5) / count for k in range(count)]
    drawn = [
        moved(cylinder(vent, rim - beyond, top + beyond), (outer - vent) * math.cos(a), (outer - vent) * math.sin(a))
        for a in turns
    ]
    if inner:
        middle = (inner + outer) / 2
        cone = _cone(min(sprue, GATE * (outer - inner) / 2), sprue, rim, top, beyond)
        drawn[0] = moved(cone, middle * math.cos(turns[0]), middle * math.sin(turns[0]))
    else:
        drawn.insert(0, cylinder(sprue, rim - beyond, top + beyond))
    return [moved(shape, c.x, c.y) for c in frame.lay.cells for shape in drawn]


def _cone(gate: float, sprue: float, rim: float, top: float, beyond: float) -> Shape:
    """Draw a sprue that narrows to a gate at the rim."""
    below = [(0, rim - beyond), (gate, rim - beyond)] if beyond else [(0, rim)]
    above = [(sprue, top + beyond), (0, top + beyond)] if beyond else [(0, top)]
    return Revolve(polygon(*below, (gate, rim), (sprue, top), *above))


def channels_over(frame: Frame, layer: int, ceiling: CrossSection, beyond: float = 0.0) -> list[Shape]:
    """Draw sprue and vents as `channels` does, over a flat top of any outline: the sprue in its widest place.

    Each part of the top has vents along its edge, as many as clear the air of a tilted mould.
    """
    spec = frame.spec
    rim, top, sprue = frame.dims.heights[layer], lid_top(frame.dims, layer), spec.moulds.sprue_mm / 2
    parts = [(*widest(part), part) for part in thick_parts(ceiling, LEAST_VENT)]
    width, (x, y), _ = max(parts, key=lambda each: each[0], default=(0.0, (0.0, 0.0), ceiling))
    drawn = [moved(_cone(min(sprue, GATE * width / 2), sprue, rim, top, beyond), x, y)]
    for width, _, part in parts:
        vent, places = min(VENT, GATE * width) / 2, []
        for count in VENT_COUNTS if spec.moulds.vents is None else (spec.moulds.vents,):
            places = [
                at for at in _along(part.offset(-vent), count) if math.dist(at, (x, y)) > sprue + vent + SPRUE_OFF_VENT
            ]
            if _deepest_pocket(part, np.array([*places, (x, y)]), vent) <= MESH_ROOM * deepest(spec, layer):
                break
        drawn += [moved(cylinder(vent, rim - beyond, top + beyond), *at) for at in places]
    return [moved(shape, c.x, c.y) for c in frame.lay.cells for shape in drawn]


def _along(section: CrossSection, count: int) -> list[tuple[float, float]]:
    """Return points along a section's longest outline, evenly spaced: air under a tilted top goes to its edge."""
    loops = [np.vstack([loop, loop[:1]]) for loop in section.to_polygons()]
    runs = [np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(loop, axis=0).T))]) for loop in loops]
    run, loop = max(zip(runs, loops, strict=True), key=lambda each: each[0][-1])
    at = (np.arange(count) + 0.5) * run[-1] / count
    return [(mm(x), mm(y)) for x, y in zip(*(np.interp(at, run, axis) for axis in loop.T), strict=True)]


def _deepest_pocket(part: CrossSection, vents: np.ndarray, vent: float) -> float:
    """Return the depth of the air under the highest corner of a flat top, tilted in any direction, mm."""
    turns = np.linspace(0, math.tau, 180, endpoint=False)
    ways = np.stack([np.cos(turns), np.sin(turns)])
    corners = np.concatenate(part.to_polygons())
    high = (corners @ ways).max(axis=0) - (vents @ ways).max(axis=0) - vent
    return float(high.max()) * math.sin(math.radians(TILT_DEG))


def _check_sprue(frame: Frame, layer: int, count: int) -> None:
    """Raise Refusal for a sprue that runs into the vents."""
    inner, outer = _ceiling(frame.dims, layer)
    vent = vent_diameter(frame.dims, layer) / 2
    middle, rim = (inner + outer) / 2 if inner else 0.0, outer - vent
    apart = math.sqrt(middle**2 + rim**2 - 2 * middle * rim * math.cos(math.tau / count))
    most = math.floor(200 * (apart - vent - SPRUE_OFF_VENT)) / 100
    if frame.spec.moulds.sprue_mm > most + 1e-9:
        limit = f"between {count} vents of {2 * vent:g} mm the sprue of pour {layer + 1} has at most {most:g} mm"
        raise Refusal("moulds.sprue_mm", frame.spec.moulds.sprue_mm, limit, most if most > 0 else None)


def vent_diameter(dims: Dimensions, layer: int) -> float:
    """Return the diameter of each vent, mm: 1, or less over a narrow ring."""
    inner, outer = _ceiling(dims, layer)
    return min(VENT, GATE * (outer - inner)) if inner else VENT


def vents(frame: Frame, layer: int) -> int:
    """Return how many vents a cavity has: as asked for, or the least number that clears the air.

    Raises Refusal for a number that can't clear, naming one that would, and for a ring too narrow for a vent.
    """
    spec, dims = frame.spec, frame.dims
    inner, outer = _ceiling(dims, layer)
    width = GATE * (outer - inner)
    if dims.exit and dims.exit.high >= dims.heights[layer]:
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


FLOOR_MM = 2.0
"""Least thickness under the film, mm, before it ends a whole layer."""


def skin_tray(frame: Frame) -> Shape:
    """Draw the tray, its rim at the top of the last layer."""
    dims = frame.dims
    rim, layers = dims.heights[-1], layers_of(frame.spec)
    floor = layers.up(FLOOR_MM + dims.skin) - dims.skin
    film = cylinder(dims.outer_radius, rim - dims.skin, rim + BEYOND)
    recesses = [moved(film, cell.x, cell.y) for cell in frame.lay.cells]
    closed = replace(frame, dims=replace(dims, exit=None))
    blank = Extrude(outline(frame.lay.cup, MARK), rim - dims.skin - floor, rim)
    return cut(blank, [*recesses, *grooves(closed, len(dims.heights) - 1)])


def films(frame: Frame) -> list[Shape]:
    """Draw the films in their tray, one a cell."""
    dims = frame.dims
    film = cylinder(dims.outer_radius, dims.heights[-1] - dims.skin, dims.heights[-1])
    return [moved(film, cell.x, cell.y) for cell in frame.lay.cells]
