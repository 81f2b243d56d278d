"""Pictures of a check's findings, for `unitcad check --pictures`.

For each file with findings a folder with a picture a finding (PNG with two views): the whole part with the place named,
and the place from near.
"""

from __future__ import annotations

import hashlib
import io
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from unitcad import files
from unitcad.export import raster
from unitcad.export.raster import Colour, Name, Surface
from unitcad.meshcheck.findings import FileReport, Finding, Location
from unitcad.meshcheck.geometry.distance import nearest_of, refined
from unitcad.meshcheck.geometry.mesh import LARGEST, Mesh, weld_exact
from unitcad.meshcheck.rules.registry import rules

COLOURS = {"error": (0.86, 0.10, 0.12), "warning": (0.98, 0.58, 0.05), "info": (0.15, 0.45, 0.90)}
PART = (0.74, 0.79, 0.85)
INSIDE = (0.62, 0.50, 0.40)
"""The colour of faces seen from behind: the inside of a part, through a hole."""
CUT = (0.93, 0.87, 0.76)
SECOND = (0.55, 0.12, 0.75)
"""The other face of a pair."""
SIZE = (560, 440)
"""The size of one view, px."""
_DIRECTIONS = [
    (1.0, -1.4, 0.9), (-1.2, -1.3, 0.9), (1.2, 1.3, 0.9), (-1.2, 1.3, 0.9), (1.0, -1.4, -0.9), (-1.2, -1.3, -0.9),
    (1.2, 1.3, -0.9), (-1.2, 1.3, -0.9), (0.1, -1.0, 0.15), (1.0, 0.1, 0.15), (-0.1, 1.0, 0.15), (-1.0, -0.1, 0.15),
    (0.1, -0.15, 1.0), (0.1, -0.15, -1.0),
]  # fmt: skip
_MANY = 40_000  # faces, above which fewer directions are tried
_MOST = 3000  # places of a finding that are coloured


@dataclass(frozen=True)
class Scene:
    """A mesh as it is drawn: welded vertices (n, 3) mm, faces (k, 3), the diagonal of its box in mm.

    Faces with the same corners, the same way round, are drawn once: `drawn` (m,) is the face drawn for each of the mesh.
    """

    vertices: np.ndarray
    faces: np.ndarray
    drawn: np.ndarray
    size: float


def write(folder: Path, report: FileReport) -> FileReport:
    """Write the pictures of a report into a folder of its own below `folder`; the report without its meshes.

    A file without findings, or without a mesh that can be drawn, has none. Raises OSError.
    """
    scenes = [_scene(mesh) for mesh in report.meshes]
    if report.findings and any(scenes):
        own = folder / folder_name(report.path)
        own.mkdir(parents=True, exist_ok=True)
        for finding in report.findings:
            files.write(own / f"{finding.code}.png", draw(report, finding, scenes))
    return replace(report, meshes=())


def folder_name(path: str) -> str:
    """Return a name for a file's pictures that every system accepts: its path, with a hash if it is no plain name."""
    shown = os.path.relpath(path) if os.path.isabs(path) else os.path.normpath(path)
    name = re.sub(r"[^A-Za-z0-9._-]+", "_", shown).strip("._-") or "file"
    if name == shown and len(name) <= 80 and not re.match(r"(?i)(con|prn|aux|nul|com\d|lpt\d)(\.|$)", name):
        return name
    return f"{name[-80:].strip('._-')}-{hashlib.sha256(os.fsencode(shown)).hexdigest()[:8]}"


def draw(report: FileReport, finding: Finding, scenes: Sequence[Scene | None]) -> bytes:
    """Draw a finding as a PNG, on the mesh of its first place; the whole part alone if it has no place on a mesh."""
    placed = [place for place in finding.locations[:_MOST] if place.mesh is not None and scenes[place.mesh]]
    index = placed[0].mesh if placed else next(i for i, scene in enumerate(scenes) if scene)
    assert index is not None
    scene, mesh = scenes[index], report.meshes[index]
    assert scene is not None
    if not placed:
        surface, view = _painted(scene, [], PART), raster.aim(_DIRECTIONS[0], scene.vertices, SIZE)
        return raster.finish([raster.render(surface, view)], view)
    places = [place for place in placed if place.mesh == index]
    first = _region(places[0])
    corners = mesh.vertices[mesh.faces[first]].reshape(-1, 3)
    middle = np.array(places[0].xyz) if places[0].xyz is not None else corners.mean(axis=0)
    across = float(np.linalg.norm(np.ptp(corners, axis=0))) if len(corners) else 0.0
    pair = len(places[0].faces) == 2
    reach = (0.15 if pair else float(np.clip(0.9 * across / scene.size, 0.08, 0.3))) * scene.size
    towards, cut = _direction(scene, scene.drawn[first[:0] if pair else first], middle, reach)
    surface = _painted(scene, places, COLOURS[finding.severity], CUT if np.isfinite(cut) else INSIDE)
    name = Name(f"{finding.code} {rules()[finding.code].title}", tuple(middle.tolist()), ring=True)
    whole, near = raster.aim(towards, scene.vertices, SIZE), raster.aim(towards, middle[None], SIZE, reach)
    pictures = [
        raster.finish([raster.render(surface, whole)], whole, [name]),
        raster.finish([raster.render(surface, near, cut)], near, [name], wires=True),
    ]
    both = Image.new("RGB", (2 * SIZE[0], SIZE[1]), "white")
    for i, picture in enumerate(pictures):
        both.paste(Image.open(io.BytesIO(picture)), (i * SIZE[0], 0))
    return raster.encode_png(both)


CHANGED = (0.86, 0.10, 0.12)
_TOWARDS = ((1.0, -1.4, 0.9), (-1.2, 1.3, -0.9))
_PIECES = 1 / 60  # side of the pieces that are coloured, as part of the diagonal


def versions(folder: Path, path: str, old: np.ndarray, new: np.ndarray) -> None:
    """Draw the old (left) and new version (right) of a file from two sides, triangles (n, 3, 3), mm.

    Places away from the other version's surface are red. Raises OSError.
    """
    both = np.concatenate([old, new]).reshape(-1, 3)
    size = float(np.linalg.norm(np.ptp(both, axis=0)))
    sheet = Image.new("RGB", (2 * SIZE[0], 2 * SIZE[1]), "white")
    for i, (mine, theirs) in enumerate(((old, new), (new, old))):
        pieces = refined(mine, size * _PIECES)
        away = nearest_of(theirs).distances(pieces.mean(axis=1)) > _AWAY * size
        points, faces = weld_exact(pieces)
        colours, behind = (np.where(away[:, None], CHANGED, paint) for paint in (PART, INSIDE))
        surface = Surface(points, faces, colours, inside=behind)
        for j, towards in enumerate(_TOWARDS):
            view = raster.aim(towards, both, SIZE)
            panel = Image.open(io.BytesIO(raster.finish([raster.render(surface, view)], view)))
            ImageDraw.Draw(panel).text((12, 10), ("old", "new")[i], fill="black", font_size=20)
            sheet.paste(panel, (i * SIZE[0], j * SIZE[1]))
    folder.mkdir(parents=True, exist_ok=True)
    files.write(folder / f"{folder_name(path)}.png", raster.encode_png(sheet))


_AWAY = 1e-4
"""Distance from which a place differs, as part of the diagonal."""


def _region(place: Location) -> np.ndarray:
    """Return the faces of a place."""
    return np.asarray(place.region if place.region is not None else [], np.int64)


def _painted(scene: Scene, places: Sequence[Location], colour: Colour, inside: Colour = INSIDE) -> Surface:
    """Return a mesh with the faces of places in a colour: the first one's in full, a pair's second face in its own."""
    palette = np.array([PART, np.add(colour, PART) / 2, SECOND, colour])
    kind = np.zeros(len(scene.faces), int)
    for place in places[1:]:
        kind[scene.drawn[_region(place)]] = 1
    for place in places[:1]:
        region = scene.drawn[_region(place)]
        kind[region[1:]] = 2 if len(place.faces) == 2 else 3
        kind[region[:1]] = 3
    order = np.argsort(kind, kind="stable")  # marked faces come last: they hide other faces in their place
    behind = palette * 0.9
    behind[0] = inside
    return Surface(scene.vertices, scene.faces[order], palette[kind[order]], inside=behind[kind[order]])


def _scene(mesh: Mesh) -> Scene | None:
    if not len(mesh.faces) or not (np.abs(mesh.vertices) <= LARGEST).all():
        return None
    vertices, faces = weld_exact(mesh.vertices[mesh.faces])
    size = float(np.linalg.norm(np.ptp(vertices, axis=0)))
    if size <= 0:
        return None
    turned = np.take_along_axis(faces, (np.argmin(faces, axis=1)[:, None] + np.arange(3)) % 3, axis=1)
    _, first, alike = np.unique(turned, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)  # the faces stay in the order of the file
    return Scene(vertices, faces[first[order]], np.argsort(order)[alike.reshape(-1)], size)


def _direction(scene: Scene, faces: np.ndarray, point: np.ndarray, reach: float) -> tuple[Colour, float]:
    """Return the direction from which most of the faces, or the point if there are none, are visible.

    With it how near to the eye the part is cut to show the point, mm from the view's middle: infinity if it is visible.
    """
    best, most = _DIRECTIONS[0], 0.0
    for i, towards in enumerate(_DIRECTIONS[:4] if len(scene.faces) > _MANY else _DIRECTIONS):
        view = raster.aim(towards, point[None], (SIZE[0] // 4, SIZE[1] // 4), reach)
        face, depth = raster.look(scene.vertices, scene.faces, view)
        if len(faces):
            score = float(np.isin(face, faces).mean())
        else:
            score = float(depth[depth.shape[0] // 2, depth.shape[1] // 2] <= 1.5 / view.scale)
        if score > most * (1.0 if i == 0 else 1.3):
            best, most = towards, score
        if most * 1.3 >= 1.0:  # no other can show more
            break
    return best, np.inf if most > 0.004 else 0.0
