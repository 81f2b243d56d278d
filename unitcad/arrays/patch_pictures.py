"""Pictures of a patch, flat and bent round its limb."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from manifold3d import Manifold

from unitcad.arrays.array import Array
from unitcad.arrays.patch import PatchMoulds, patch_bodies
from unitcad.export.raster import Surface, draw
from unitcad.kernels.mesh import arrays, bounds
from unitcad.moulds.plan import Plan, Step
from unitcad.shape import union
from unitcad.shape.body import Body

FINEST = 2.0
"""Length of an edge, at most, before it is mapped, mm: a long one would cut across the arc."""


def bent(array: Array, solid: Manifold) -> tuple[np.ndarray, np.ndarray]:
    """Return the mesh of a cast solid around the limb: vertices (n, 3) in mm and faces (m, 3).

    x becomes the angle x over the middle's radius, z the distance from the limb's axis, which is y: the sheet's middle
    keeps its length. The middle of the array is on top. A curved casting is so already. Raises ValueError for an
    array that is worn flat.
    """
    radius, middle = array.radius_mm, array.middle_radius_mm
    if radius is None or middle is None:
        raise ValueError("the array is worn flat")
    if array.cast == "curved":
        vertices, faces = arrays(solid)
        return np.asarray(vertices, float) + np.array([0.0, 0.0, radius]), np.asarray(faces, np.int64)
    vertices, faces = arrays(solid.refine_to_length(FINEST))
    return wrapped(np.asarray(vertices, float), radius, middle), np.asarray(faces, np.int64)


def wrapped(points: np.ndarray, radius: float, middle: float) -> np.ndarray:
    """Return points (n, 3) of the flat frame, bent around a limb (mm)."""
    angle, distance = points[:, 0] / middle, radius + points[:, 2]
    return np.column_stack([distance * np.sin(angle), points[:, 1], distance * np.cos(angle)])


def limb(array: Array) -> Manifold:
    """Return the limb that the array is worn on as a cylinder, a little longer than the sheet is wide."""
    _, y0, _, y1 = array.sheet.outline
    length = 1.1 * (y1 - y0)
    cylinder = Manifold.cylinder(length, array.radius_mm or 0.0, circular_segments=180, center=True)
    return cylinder.rotate((90.0, 0.0, 0.0)).translate((0.0, (y0 + y1) / 2, 0.0))


SIZE = (960, 640)
"""Of a picture, px."""
FOLDER = "pictures"
WORN = f"{FOLDER}/patch-bent.png"
GAP = 8.0
"""Between two pieces taken apart, mm."""
_Eye = tuple[float, float, float]
SKIN = (0.93, 0.80, 0.72)
ALONG = (0.35, -0.9, 0.45)
"""Along the limb, from the outside: sheet, units and skin are seen."""
SKIN_SIDE, BACK, ABOVE = (0.45, -0.8, -0.9), (0.45, -0.8, 0.9), (0.45, -1.0, 0.55)


def picture_names(moulds: PatchMoulds) -> dict[str, str]:
    """Return the scene of each picture, by its path: from the skin's side, from the back, the tools, each pour."""
    names = {
        f"{FOLDER}/patch-skin-side.png": "The patch from the skin's side",
        f"{FOLDER}/patch-back.png": "The patch from its back",
        f"{FOLDER}/tools.png": "The tools and the silicone, taken apart",
    }
    if moulds.arranged.radius_mm is not None:
        names[WORN] = "The patch round its limb"
    return names | {f"{FOLDER}/pour{s.index}.png": f"Pour {s.index}, cut open" for s in moulds.plan.steps}


def pictures(moulds: PatchMoulds) -> dict[str, bytes]:
    """Return the PNG of each picture by its path."""
    patch = [_solid(moulds, body) for body in patch_bodies(moulds.arranged)]
    drawn = {
        f"{FOLDER}/patch-skin-side.png": draw(patch, SKIN_SIDE, SIZE),
        f"{FOLDER}/patch-back.png": draw(patch, BACK, SIZE),
        f"{FOLDER}/tools.png": draw([_solid(moulds, *moved) for moved in taken_apart(moulds)], ABOVE, SIZE),
    }
    if moulds.arranged.radius_mm is not None:
        drawn[WORN] = draw(list(_worn(moulds)), ALONG, SIZE)
    cuts = [draw(list(_cut_open(moulds, step.index)), ABOVE, SIZE) for step in moulds.plan.steps]
    return drawn | {f"{FOLDER}/pour{i + 1}.png": picture for i, picture in enumerate(cuts)}


def _solid(moulds: PatchMoulds, body: Body, by: _Eye = (0.0, 0.0, 0.0)) -> Surface:
    return Surface(*arrays(moulds.mesh(body).translate(by)), body.colour)


def _worn(moulds: PatchMoulds) -> Iterator[Surface]:
    """Yield the limb, and the patch's bodies around it."""
    array = moulds.arranged
    yield Surface(*arrays(limb(array)), SKIN)
    for body in patch_bodies(array):
        yield Surface(*bent(array, moulds.mesh(body)), body.colour)


def taken_apart(moulds: PatchMoulds) -> Iterator[tuple[Body, tuple[float, float, float]]]:
    """Yield tools and cast layers and how far each is moved (mm) to be shown apart.

    One over the other in the order of the pours; the pieces of a tool next to each other.
    """
    plan, top = moulds.plan, -np.inf
    first = [tool for tool in plan.tools if tool.step is None and tool.kind != "blade"]
    later = [row for step in plan.steps for row in _of_pour(moulds, step)]
    rows = [(first, 0.0), *((row, GAP) for row in later), (plan.of_kind("blade"), GAP)]
    for bodies, gap in rows:
        low = min((bounds(moulds.mesh(body))[2] for body in bodies), default=np.inf)
        up = max(0.0, top + gap - low) if gap and bodies else 0.0
        for body in bodies:
            top = max(top, bounds(moulds.mesh(body))[5] + up)
            pieces = plan.pieces_of(body.name) if body.role == "tool" else (body,)
            columns = next((split.columns for split in plan.splits if split.tool == body.name), 1)
            for k, piece in enumerate(pieces):
                row, column = divmod(k, columns)
                aside = column - (columns - 1) / 2, (len(pieces) / columns - 1) / 2 - row
                yield piece, (aside[0] * GAP, aside[1] * GAP, float(up))


def laid_elsewhere(plan: Plan, step: Step) -> bool:
    """Tell whether a pour's silicone is taken out and inserted into the last pour at another place."""
    last = plan.steps[-1]
    return step.index < last.index and not set(step.layer) <= set(last.earlier)


def _of_pour(moulds: PatchMoulds, step: Step) -> Iterator[tuple[Body, ...]]:
    """Yield the parts of one pour, from below: base and filaments, inserted layers, cup, silicone, lid."""
    plan, colours = moulds.plan, {body.step: body for body in moulds.unit}
    own = (*plan.standing(step, "base"), *plan.standing(step, "filament"))
    yield tuple(tool for tool in own if tool.step == step.index)
    before = plan.steps[step.index - 2] if step.index > 1 else None
    if before and laid_elsewhere(plan, before):
        yield tuple(colours[index] for index in range(1, step.index))
    yield from ((cup,) for cup in plan.standing(step, "cup"))
    cast = colours[step.index]
    if laid_elsewhere(plan, step):
        cast = replace(cast, name=f"{cast.name}-flat", shape=union(step.layer))
    yield (cast,)
    yield from ((lid,) for lid in plan.standing(step, "lid"))


def _cut_open(moulds: PatchMoulds, index: int) -> Iterator[Surface]:
    """Yield a pour as it is struck off, without its nearer half: cut through a row of units."""
    step = moulds.plan.steps[index - 1]
    y = min((place.y for place in moulds.arranged.places), key=abs) + 1 / 512
    solids = [(moulds.solids[name], moulds.plan.tool(name).colour) for name in step.tools]
    colours = {body.step: body.colour for body in moulds.unit}
    for shapes, pour in ((step.earlier, 1), (step.layer, index)):
        solids += [(solid, colours[pour]) for solid in moulds.meshes(shapes)]
    for solid, colour in solids:
        yield Surface(*arrays(solid.trim_by_plane((0, 1, 0), y)), colour)
