"""Draws the procedure's views: a PNG each, the same bytes for the same geometry."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from unitcad.casting.drawings import Extra
from unitcad.casting.views import Placed, View, picture_path, shapes, views
from unitcad.export import raster
from unitcad.export.raster import Name, Surface
from unitcad.export.threemf import layout
from unitcad.kernels.mesh import arrays, realise
from unitcad.moulds.mould_set import MouldSet

SIZE, MANY = (540, 360), (540, 560)
"""Size of a picture, px; of that of the pieces if tools are printed in several."""
_GAP = 9.0
"""Between pieces laid out side by side, mm."""
_Key = tuple[Placed | Extra, bool]
"""The content of a view, and whether it is of the unit, not of its moulds."""


def pictures(moulds: MouldSet) -> dict[str, bytes]:
    """Return the PNG of every view of a set's procedure by its path in the result's folder."""
    bench = BenchPictures(moulds)
    return {picture_path(name): bench.picture(name) for name in bench.names}


class BenchPictures:
    """The pictures of a set's procedure, each drawn when it is asked for.

    Views of one kind show like scenes, from one side, at one scale: a drawing made for one of them serves all. Ask for
    `names` in their order, or backwards.
    """

    def __init__(self, moulds: MouldSet) -> None:
        self._moulds, self._views = moulds, views(moulds)
        self._kind: object = None
        kinds = [_kind(view) for view in self._views.values()]
        self.names = sorted(self._views, key=lambda name: kinds.index(_kind(self._views[name])))

    def picture(self, name: str) -> bytes:
        """Return the PNG of a view."""
        view = self._views[name]
        if self._kind != _kind(view):
            self._kind, self._drawn, self.written = _kind(view), {}, view.names
            alike = (key for other in self._views.values() if _kind(other) == self._kind for key in _keys(other))
            self._solids = {key: list(_solids(self._moulds, *key)) for key in dict.fromkeys(alike)}
            size = MANY if view.group == "pieces" and self._moulds.plan.splits else SIZE
            if view.group == "pieces":
                self._solids, self.written = _laid_out(self._moulds, self._solids)
            points = np.concatenate([solid.vertices for each in self._solids.values() for solid in each])
            self._camera = raster.aim(view.eye, points, size, turned=view.turned)
        bodies = []
        for key in _keys(view):
            if key not in self._drawn:
                self._drawn[key] = [raster.render(solid, self._camera) for solid in self._solids[key]]
            bodies += self._drawn[key]
        return raster.finish(bodies, self._camera, self.written if view.group == "pieces" else view.names)


def _kind(view: View) -> object:
    return view.group, view.eye, view.turned


def _keys(view: View) -> list[_Key]:
    return [(item, view.group == "unit") for item in (*view.parts, *view.extras)]


def _solids(moulds: MouldSet, item: Placed | Extra, unit: bool) -> Iterator[Surface]:
    """Yield the meshes of a view's content, in place; a layer has one mesh a cell."""
    near = 0.0 if unit else min(cell.y for cell in moulds.plan.layout.cells)
    for shape, colour in shapes(moulds, item, unit):
        solid = realise(shape, moulds.segments)
        if isinstance(item, Placed) and item.half:
            solid = solid.trim_by_plane((0, 1, 0), near + 1 / 512)
        if not solid.is_empty():
            yield Surface(*arrays(solid.translate(item.moved)), colour)


def _laid_out(
    moulds: MouldSet, solids: dict[_Key, list[Surface]]
) -> tuple[dict[_Key, list[Surface]], tuple[Name, ...]]:
    """Lay tools out side by side in rows, on one plane, the pieces of a split one as they belong together; name them.

    Tongues and filaments of several cavities are named by their number; pieces have their numbers written on them.
    """
    plan = moulds.plan
    places = {
        piece.name: (split.tool, *divmod(i, split.columns))
        for split in plan.splits
        for i, piece in enumerate(split.pieces)
    }
    groups: dict[str, list[tuple[_Key, list[Surface]]]] = {}
    for key, each in solids.items():
        name = getattr(key[0], "name", "")
        tool, row, column = places.get(name, (name, 0, 0))
        groups.setdefault(tool, []).append((key, _shifted(each, (column * _GAP, -row * _GAP, 0.0))))
    boxes = [_box([solid for _, each in group for solid in each])[1:] for group in groups.values()]
    sizes = [tuple((high - low)[:2] + _GAP) for low, high in boxes]
    corners = layout(sizes, (1.25 * float(np.sqrt(np.prod(sizes, axis=1).sum())), 0.0))
    laid: dict[_Key, list[Surface]] = {}
    found: dict[str, list[tuple[float, float, float]]] = {}
    numbers = []
    for (name, group), (low, high), (x, y) in zip(groups.items(), boxes, corners, strict=True):
        laid |= {key: _shifted(each, (x - low[0], -y - high[1], -low[2])) for key, each in group}
        tool = plan.tool(name)
        points, low, high = _box(laid[group[0][0]])
        x, y, _ = (low + high) / 2
        if len(group) > 1:  # at the left edge of its first piece
            at = low[0], y, high[2]
            for i, (key, _) in enumerate(group, 1):
                _, low, high = _box(laid[key])
                numbers.append(Name(str(i), (*((low + high) / 2)[:2].tolist(), float(high[2])), on=True))
        else:  # near the front edge
            off = np.hypot(points[:, 0] - x, points[:, 1] - 0.9 * low[1] - 0.1 * high[1]).round(1)
            at = points[np.lexsort((-points[:, 2], off))[0]]
        filament = "straight filament" if tool.step else "filament"
        called = {"tongue": "tongue", "filament": filament}.get(tool.kind, plan.called(name))
        found.setdefault(called, []).append((float(at[0]), float(at[1]), float(at[2])))
    names = (Name(f"{len(at)} {name}s" if len(at) > 1 else name, at[0]) for name, at in found.items())
    return laid, (*numbers, *names)


def _shifted(solids: list[Surface], by: tuple[float, float, float]) -> list[Surface]:
    return [replace(solid, vertices=solid.vertices + by) for solid in solids]


def _box(solids: list[Surface]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the points of solids, the lowest and the highest corner of their box."""
    points = np.concatenate([solid.vertices for solid in solids])
    return points, points.min(axis=0), points.max(axis=0)
