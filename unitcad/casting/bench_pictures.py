"""Draws the procedure's views: a PNG each, the same bytes for the same geometry."""

from __future__ import annotations

from collections.abc import Collection, Iterable

import numpy as np

from unitcad.casting.bench_extras import TOOL
from unitcad.casting.bench_views import Placed, View, picture_path, views
from unitcad.designs import layer_colour
from unitcad.export import composite
from unitcad.export.picture_letters import Name
from unitcad.kernels.mesh import arrays, bounds, realise
from unitcad.moulds.mould_set import MouldSet
from unitcad.shape import Shape, moved, polygon
from unitcad.shape.tree import Revolve

SIZE = (540, 360)
"""Of a picture, px."""
_GAP = 9.0
"""Between pieces laid out side by side, mm."""
_Solid = tuple[np.ndarray, np.ndarray, tuple[float, float, float]]


def pictures(moulds: MouldSet, names: Collection[str] | None = None) -> dict[str, bytes]:
    """Return the PNG of every view of a set's procedure, or of `names`, by its path in the result's folder."""
    shown = views(moulds)
    solids: dict[object, list[_Solid]] = {}
    for view in shown.values():
        for part in view.parts:
            key = view.group == "unit", part
            if key not in solids:
                solids[key] = list(_solids(moulds, part, view.group == "unit"))
        for extra in view.extras:
            if extra not in solids:
                solids[extra] = [(*_mesh(moulds, extra.shape), extra.colour)]
        if view.syringe_on is not None and view.syringe_on not in solids:
            solids[view.syringe_on] = [(*_mesh(moulds, _syringe(moulds, view.syringe_on)), TOOL)]
    drawn = _drawn(moulds, shown, solids, shown.keys() if names is None else names)
    return {picture_path(name): content for name, content in drawn}


def _drawn(
    moulds: MouldSet, shown: dict[str, View], solids: dict[object, list[_Solid]], names: Collection[str]
) -> Iterable[tuple[str, bytes]]:
    kinds = {name: (view.group, view.eye, view.turned) for name, view in shown.items()}
    for group in dict.fromkeys(kinds[name] for name in shown if name in names):
        own = {name: view for name, view in shown.items() if kinds[name] == group}
        keys = {name: list(_keys(view)) for name, view in own.items()}
        placed = {key: solids[key] for each in keys.values() for key in each}
        if group[0] == "pieces":
            placed = _laid_out(placed)
        points = np.concatenate([vertices for each in placed.values() for vertices, _, _ in each])
        camera = composite.view(group[1], points, SIZE, turned=group[2])
        wanted = {name: each for name, each in keys.items() if name in names}
        bodies = {
            key: [composite.drawn(*solid, camera) for solid in placed[key]]
            for key in dict.fromkeys(key for each in wanted.values() for key in each)
        }
        for name, each in wanted.items():
            written = _piece_names(moulds, placed) if group[0] == "pieces" else own[name].names
            yield name, composite.together([body for key in each for body in bodies[key]], camera, written)


def _piece_names(moulds: MouldSet, placed: dict[object, list[_Solid]]) -> list[Name]:
    """Name the pieces laid out: each by itself, tongues and filaments of several cavities by their number."""
    runs: dict[str, list[np.ndarray]] = {}
    for key, solids in placed.items():
        if isinstance(key, tuple) and isinstance(key[1], Placed):
            (tool,) = (piece for piece in moulds.plan.pieces if piece.name == key[1].name)
            own = moulds.plan.called(tool.name).replace(",", "")
            filament = "straight filament" if tool.step else "filament"
            name = {"tongue": "tongue", "stub": filament}.get(tool.kind, own)
            runs.setdefault(name, []).append(np.concatenate([vertices for vertices, _, _ in solids]))
    names = []
    for name, points in runs.items():
        low, high = points[0].min(axis=0), points[0].max(axis=0)
        # At the nearer edge of the upper face, where most pieces are solid.
        at = float(low[0] + high[0]) / 2, float(low[1] + 0.1 * (high[1] - low[1])), float(high[2])
        names.append(Name(f"{len(points)} {name}s" if len(points) > 1 else name, at))
    return names


def _keys(view: View) -> Iterable[object]:
    yield from ((view.group == "unit", part) for part in view.parts)
    yield from view.extras
    if view.syringe_on is not None:
        yield view.syringe_on


def _solids(moulds: MouldSet, part: Placed, unit: bool) -> Iterable[_Solid]:
    """Yield the meshes of a piece, a layer (one a cell) or what is laid in, where the view has it."""
    cells = moulds.plan.layout.cells
    near = 0.0 if unit else min(cell.y for cell in cells)
    for shape, colour in _shapes(moulds, part.name, unit):
        solid = realise(shape, moulds.segments)
        if part.half:
            solid = solid.trim_by_plane((0, 1, 0), near + 1 / 512)
        if not solid.is_empty():
            yield (*_corners(*arrays(solid.translate(part.moved))), colour)


def _shapes(moulds: MouldSet, name: str, unit: bool) -> Iterable[tuple[Shape, tuple[float, float, float]]]:
    if not unit:
        for step in moulds.plan.steps:
            if step.name == name:
                return [(shape, layer_colour(step.index - 1)) for shape in step.layer]
    tools = dict.fromkeys((*moulds.plan.tools, *moulds.plan.pieces))
    bodies = (*moulds.unit, *moulds.laid_later, *moulds.pushed_in) if unit else (*tools, *moulds.plan.steps[-1].inserts)
    return [(body.shape, body.colour) for body in bodies if body.name == name]


def _mesh(moulds: MouldSet, shape: Shape) -> tuple[np.ndarray, np.ndarray]:
    return _corners(*arrays(realise(shape, moulds.segments)))


def _corners(vertices: object, faces: object) -> tuple[np.ndarray, np.ndarray]:
    return np.asarray(vertices, float), np.asarray(faces, np.int64)


def _syringe(moulds: MouldSet, channel: Shape) -> Shape:
    """Draw a syringe whose tip stands in a channel's mouth."""
    x0, y0, _, x1, y1, top = bounds(realise(channel, moulds.segments))
    tip = (x1 - x0) / 2
    outline = polygon((0, -1), (0.6 * tip, -1), (tip, 6), (4, 8), (4, 26), (6, 26), (6, 27), (0, 27))
    return moved(Revolve(outline), (x0 + x1) / 2, (y0 + y1) / 2, top)


def _laid_out(placed: dict[object, list[_Solid]]) -> dict[object, list[_Solid]]:
    """Lay pieces out side by side in rows, on one plane, in their order."""
    boxes = {
        key: (np.min([v.min(axis=0) for v, _, _ in each], axis=0), np.max([v.max(axis=0) for v, _, _ in each], axis=0))
        for key, each in placed.items()
    }
    width = 1.25 * float(np.sqrt(sum(float(np.prod((high - low)[:2] + _GAP)) for low, high in boxes.values())))
    spread: dict[object, list[_Solid]] = {}
    x = y = deep = 0.0
    for key, each in placed.items():
        low, high = boxes[key]
        if x and x + high[0] - low[0] > width:
            x, y, deep = 0.0, y - deep - _GAP, 0.0
        shift = np.array([x - low[0], y - high[1], -low[2]])
        spread[key] = [(vertices + shift, faces, colour) for vertices, faces, colour in each]
        x, deep = x + high[0] - low[0] + _GAP, max(deep, high[1] - low[1])
    return spread
