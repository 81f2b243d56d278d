"""Draws the procedure's views: a PNG each, the same bytes for the same geometry."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import cast

import numpy as np

from unitcad.casting.bench_extras import TOOL, Extra
from unitcad.casting.bench_views import Placed, View, picture_path, views
from unitcad.casting.cast_colour import cast_colour
from unitcad.export import composite
from unitcad.export.composite import DrawnBody
from unitcad.export.picture_letters import Name
from unitcad.export.raster import Camera
from unitcad.kernels.mesh import arrays, bounds, realise
from unitcad.moulds.mould_set import MouldSet
from unitcad.shape import Shape, moved, polygon
from unitcad.shape.tree import Revolve

SIZE, MANY = (540, 360), (540, 560)
"""Of a picture, px; of the pieces where tools are printed in several."""
_GAP = 9.0
"""Between pieces laid out side by side, mm."""
_Solid = tuple[np.ndarray, np.ndarray, tuple[float, float, float]]


def pictures(moulds: MouldSet) -> dict[str, bytes]:
    """Return the PNG of every view of a set's procedure by its path in the result's folder."""
    bench = BenchPictures(moulds)
    return {picture_path(name): bench.picture(name) for name in bench.names}


@dataclass(frozen=True)
class _Kind:
    """Views of one kind: they show things that stand alike, from one side, at one scale."""

    group: str
    eye: tuple[float, float, float]
    turned: bool


@dataclass(frozen=True)
class _Scene:
    """What the views of one kind show: solids at their places by their keys, and as they are drawn by `camera`."""

    kind: _Kind
    placed: dict[object, list[_Solid]]
    camera: Camera
    bodies: dict[object, list[DrawnBody]] = field(default_factory=dict)

    def drawn(self, key: object) -> list[DrawnBody]:
        """Return what stands for a key, drawn once."""
        if key not in self.bodies:
            self.bodies[key] = [composite.drawn(*solid, self.camera) for solid in self.placed[key]]
        return self.bodies[key]


class BenchPictures:
    """The pictures of a set's procedure, each drawn when it is asked for.

    Of what is drawn for one kind of view all pictures of that kind are made: ask for `names` in their order, or
    backwards.
    """

    def __init__(self, moulds: MouldSet) -> None:
        self._moulds = moulds
        self._views = views(moulds)
        self._kinds = {name: _Kind(view.group, view.eye, view.turned) for name, view in self._views.items()}
        self._solids: dict[object, list[_Solid]] = {}
        self._scene: _Scene | None = None

    @property
    def names(self) -> list[str]:
        """The names of the views, kind by kind."""
        kinds = list(dict.fromkeys(self._kinds.values()))
        return sorted(self._kinds, key=lambda name: kinds.index(self._kinds[name]))

    def picture(self, name: str) -> bytes:
        """Return the PNG of a view."""
        kind = self._kinds[name]
        if self._scene is None or self._scene.kind != kind:
            self._scene = self._scene_of(kind)
        scene, view = self._scene, self._views[name]
        written = _piece_names(self._moulds, scene.placed) if kind.group == "pieces" else view.names
        return composite.together([body for key in _keys(view) for body in scene.drawn(key)], scene.camera, written)

    def _scene_of(self, kind: _Kind) -> _Scene:
        own = [view for name, view in self._views.items() if self._kinds[name] == kind]
        placed = {key: solids for view in own for key, solids in self._of_view(view)}
        size = SIZE
        if kind.group == "pieces":
            placed = _laid_out(_together(self._moulds, placed))
            size = MANY if self._moulds.plan.splits else SIZE
        points = np.concatenate([vertices for each in placed.values() for vertices, _, _ in each])
        return _Scene(kind, placed, composite.view(kind.eye, points, size, turned=kind.turned))

    def _of_view(self, view: View) -> Iterable[tuple[object, list[_Solid]]]:
        """Yield what a view shows: a key, and the solids that stand for it, made once for all views."""
        for key in _keys(view):
            if key not in self._solids:
                self._solids[key] = list(self._made(key))
            yield key, self._solids[key]

    def _made(self, key: object) -> Iterable[_Solid]:
        moulds = self._moulds
        match key:
            case bool() as unit, Placed() as part:
                return _solids(moulds, part, unit)
            case Extra(shape=shape, colour=colour):
                return [(*_mesh(moulds, shape), colour)]
            case _:
                return [(*_mesh(moulds, _syringe(moulds, cast(Shape, key))), TOOL)]


def _piece_names(moulds: MouldSet, placed: dict[object, list[_Solid]]) -> list[Name]:
    """Name the tools laid out: each by itself, tongues and filaments of several cavities by their number.

    The pieces of a split tool have their numbers, written on them.
    """
    plan = moulds.plan
    split = {piece.name: (each.tool, str(i)) for each in plan.splits for i, piece in enumerate(each.pieces, 1)}
    runs: dict[str, list[list[_Solid]]] = {}
    numbers: list[Name] = []
    for key, solids in placed.items():
        if isinstance(key, tuple) and isinstance(key[1], Placed):
            (tool,) = (piece for piece in plan.pieces if piece.name == key[1].name)
            points = np.concatenate([vertices for vertices, _, _ in solids])
            of, numeral = split.get(tool.name, (tool.name, ""))
            if numeral:
                low, high = points.min(axis=0), points.max(axis=0)
                x, y, _ = ((low + high) / 2).tolist()
                numbers.append(Name(numeral, (x, y, float(high[2])), on=True))
            filament = "straight filament" if tool.step else "filament"
            name = {"tongue": "tongue", "stub": filament}.get(tool.kind, plan.called(of))
            runs.setdefault(name, []).append(solids)
    names = []
    split_tools = {plan.called(tool) for tool, _ in split.values()}
    for name, pieces in runs.items():
        points = np.concatenate([vertices for vertices, _, _ in pieces[0]])
        low, high = points.min(axis=0), points.max(axis=0)
        if name in split_tools:  # at the left edge of its first piece
            at = float(low[0]), float(low[1] + high[1]) / 2, float(high[2])
        else:  # near the front edge
            at = _seen_from_above(pieces[0], float(low[0] + high[0]) / 2, float(low[1] + 0.1 * (high[1] - low[1])))
        many = len(pieces) > 1 and name not in split_tools
        names.append(Name(f"{len(points)} {name}s" if many else name, at))
    return [*numbers, *names]


def _seen_from_above(solids: Sequence[_Solid], x: float, y: float) -> tuple[float, float, float]:
    """Return the highest point of solids at (x, y) mm; where they have none there, the middle of the nearest face."""
    corners = np.concatenate([vertices[faces] for vertices, faces, _ in solids])
    ax, ay, _ = (corners[:, 1] - corners[:, 0]).T
    bx, by, _ = (corners[:, 2] - corners[:, 0]).T
    upwards = ax * by - ay * bx > 1e-9
    corners, ax, ay, bx, by = corners[upwards], ax[upwards], ay[upwards], bx[upwards], by[upwards]
    dx, dy = x - corners[:, 0, 0], y - corners[:, 0, 1]
    area = ax * by - ay * bx
    two, three = (dx * by - dy * bx) / area, (ax * dy - ay * dx) / area
    shares = np.stack([1 - two - three, two, three], axis=1)
    inside = (shares >= 0).all(axis=1)
    if inside.any():
        return x, y, float((shares * corners[:, :, 2]).sum(axis=1)[inside].max())
    middles = corners.mean(axis=1)
    nearest = middles[np.argmin(np.hypot(middles[:, 0] - x, middles[:, 1] - y))]
    return float(nearest[0]), float(nearest[1]), float(nearest[2])


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
                return [(shape, cast_colour(moulds, step.index)) for shape in step.layer]
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


def _together(moulds: MouldSet, placed: dict[object, list[_Solid]]) -> list[dict[object, list[_Solid]]]:
    """Return what is laid out as one: each piece, or the pieces of a split tool as they belong together, apart."""
    of: dict[str, tuple[object, int, int]] = {}
    for split in moulds.plan.splits:
        of |= {piece.name: (split.tool, *divmod(i, split.columns)) for i, piece in enumerate(split.pieces)}
    groups: dict[object, dict[object, list[_Solid]]] = {}
    for key, solids in placed.items():
        name = key[1].name if isinstance(key, tuple) and isinstance(key[1], Placed) else ""
        tool, row, column = of.get(name, (key, 0, 0))
        by = np.array([column * _GAP, -row * _GAP, 0.0])
        groups.setdefault(tool, {})[key] = [(vertices + by, faces, colour) for vertices, faces, colour in solids]
    return list(groups.values())


def _laid_out(groups: list[dict[object, list[_Solid]]]) -> dict[object, list[_Solid]]:
    """Lay groups of pieces out side by side in rows, on one plane, in their order."""
    boxes = []
    for group in groups:
        points = np.concatenate([vertices for each in group.values() for vertices, _, _ in each])
        boxes.append((points.min(axis=0), points.max(axis=0)))
    width = 1.25 * float(np.sqrt(sum(float(np.prod((high - low)[:2] + _GAP)) for low, high in boxes)))
    spread: dict[object, list[_Solid]] = {}
    x = y = deep = 0.0
    for group, (low, high) in zip(groups, boxes, strict=True):
        if x and x + high[0] - low[0] > width:
            x, y, deep = 0.0, y - deep - _GAP, 0.0
        for key, each in group.items():
            shift = np.array([x - low[0], y - high[1], -low[2]])
            spread[key] = [(vertices + shift, faces, colour) for vertices, faces, colour in each]
        x, deep = x + high[0] - low[0] + _GAP, max(deep, high[1] - low[1])
    return spread
