"""Readers of a drawing for tests: each length measured on the mesh by trimesh, texts and lines compared by shapely."""

import re
from itertools import combinations

import numpy as np
import shapely
import trimesh

from unitcad.export import paper
from unitcad.kernels.mesh import area_true, arrays

ISO_5455 = {f"{n}:1" for n in (2, 5, 10, 20, 50)} | {f"1:{n}" for n in (1, 2, 5, 10, 20, 50, 100)}


def allowed(length, segments):
    """Return how far a length of an exported mesh may be off, mm: by its facets, a caliper's 0.01 mm and a taper."""
    return 0.013 + length * (area_true(segments) - 1)


def cells(page):
    """Return the texts of the title block by the name of their cell."""
    texts = [mark for mark in page.marks if isinstance(mark, paper.Text)]
    names = {(mark.at[0], mark.at[1] - 4.0): mark.text for mark in texts if mark.size <= 2.0}
    near = {at: name for at, name in names.items()}
    return {
        name: mark.text
        for mark in texts
        for at, name in near.items()
        if mark.text != name and abs(mark.at[0] - at[0]) < 0.1 and abs(mark.at[1] - at[1]) < 0.8
    }


def table(page):
    """Return (x, y, size) of each row of the tables of holes, by its name."""
    texts = [mark for mark in page.marks if isinstance(mark, paper.Text) and mark.anchor == "start"]
    lines = {}
    for text in sorted(texts, key=lambda text: text.at[0]):
        lines.setdefault(round(text.at[1], 3), []).append(text.text)
    rows = [row[i : i + 4] for row in lines.values() for i in range(len(row) - 3)]
    found = [row for row in rows if re.fullmatch(r"(-?\d+\.\d\d)(-?\d+\.\d\d)(Ø.*|.* x .*)", "".join(row[1:]))]
    return {name: (float(x), float(y), size) for name, x, y, size in found}


def faults(page):
    """Yield texts that touch a line, another text, or the frame's outside."""
    segments = paper.segments(page.marks)
    texts = [mark for mark in page.marks if isinstance(mark, paper.Text) and mark.text]
    boxes = [shapely.box(*mark.box) for mark in texts]
    lines = shapely.STRtree(shapely.linestrings(segments.reshape(-1, 2, 2)))
    for text, box in zip(texts, boxes, strict=True):
        if len(lines.query(box, predicate="intersects")):
            yield f"{text.text} at {text.at} is on a line"
    for (a, one), (b, other) in combinations(zip(texts, boxes, strict=True), 2):
        if one.intersects(other):
            yield f"{a.text} is on {b.text}"
    x0, y0, x1, y1 = paper.frame(page.size)
    left, low, right, high = paper.extent(page.marks)
    if left < x0 or low < y0 or right > x1 or high > y1:
        yield "beyond the frame"


def crossings(mesh, point, axis):
    """Return where a line along an axis through a point crosses a mesh's section, in the plane of y or of z."""
    normal = 2 if axis == 1 else 1
    cut = np.asarray(trimesh.intersections.mesh_plane(mesh, np.eye(3)[normal], point)).reshape(-1, 2, 3)
    other = ({0, 1, 2} - {axis, normal}).pop()
    a, b = cut[:, 0], cut[:, 1]
    met = (a[:, other] > point[other]) != (b[:, other] > point[other])
    a, b = a[met], b[met]
    share = (point[other] - a[:, other]) / (b[:, other] - a[:, other])
    return a[:, axis] + share * (b[:, axis] - a[:, axis])


def measured(solid, sheet):
    """Yield each length of a tool's sheet with what its mesh measures there, from the text's number; None: no face."""
    vertices, faces = arrays(solid)
    mesh = trimesh.Trimesh(vertices, faces, process=False)

    def at(point, axis, value):
        found = crossings(mesh, np.asarray(point), axis)
        return found[np.argmin(abs(found - value))] if len(found) else np.nan

    (low, high), inward = mesh.bounds, 0.004
    for one in sheet.front.lengths:
        (x0, z0), (x1, z1) = one.start, one.end
        if one.side == "below":
            z = max(z0, z1)
            pairs = [
                [at((0, sheet.cut, z + dz), 0, x) for x in (x0, x1)]
                for dz in (inward, -inward)
                if low[2] < z + dz < high[2]
            ]
        elif one.side == "left":
            # A round face of the mesh is up to its facets' error beside the drawn one; a bevel is steep.
            sides = [(x1 + dx, sheet.cut, 0) for dx in ((0.03, -0.03) if one.running else (inward, -inward))]
            pairs = [[z0 if one.running else at(side, 2, z0), at(side, 2, z1)] for side in sides]
            pairs += [[z0, high[2]]] if one.name == "height" else []
            assert not one.running or abs(z0 - low[2]) < 1e-6
        else:
            pairs = [[at((x0 + dx, sheet.cut, 0), 2, z) for z in (z0, z1)] for dx in (inward, -inward)]
        yield one, min((b - a for a, b in pairs if b - a == b - a), key=lambda got: abs(got - one.value), default=None)
    for one in sheet.plan.lengths:
        axis = 0 if one.side == "below" else 1
        ends = [vertices[:, axis][np.argmin(abs(vertices[:, axis] - point[axis]))] for point in (one.start, one.end)]
        if one.name in ("length", "width"):
            ends = low[axis], high[axis]
        yield one, ends[1] - ends[0]


def number(text, last=False):
    """Return the first number of a length's text, or the last: of a window its height."""
    found = re.findall(r"\d+(?:\.\d+)?", text.split("× ")[-1])
    return float(found[-1 if last else 0])
