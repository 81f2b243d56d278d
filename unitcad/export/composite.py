"""Pictures in which several bodies stand together: each is drawn once for a view, and serves every picture of it.

Closed meshes, parallel projection, no display and no GPU: the same bodies give the same bytes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from unitcad.export import raster
from unitcad.export.raster import Camera

CREASE_DEG = 25.0
"""Faces that meet at more than this angle have a line between them."""
SHARPER = 2
"""Pixels of the view along a pixel of the picture, along either side."""
_INK = 0.28
"""What a line leaves of the colour under it."""
_TIE_MM = 1e-4
_EFFORT = 6
"""Of the compression: half the time of the greatest, files a few per cent larger."""


@dataclass(frozen=True)
class DrawnBody:
    """A body in a view: the pixels (n,) that it covers, their depths in mm, colours and smooth patches (n,).

    A colour is four bytes, red, green, blue and 255, in one number.
    """

    pixel: np.ndarray
    depth: np.ndarray
    colour: np.ndarray
    patch: np.ndarray


def view(towards_eye: tuple[float, float, float], points: np.ndarray, size: tuple[int, int]) -> Camera:
    """Return a view that holds all `points` (n, 3) mm, for pictures of `size` (width, height) pixels."""
    low, high = points.min(axis=0), points.max(axis=0)
    return raster.camera(towards_eye, (low + high) / 2, points, (SHARPER * size[0], SHARPER * size[1]))


def drawn(vertices: np.ndarray, faces: np.ndarray, colour: tuple[float, float, float], of: Camera) -> DrawnBody:
    """Draw a closed mesh (n, 3) mm, (m, 3) in one colour, three numbers 0 to 1."""
    corners = vertices[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    towards = np.flatnonzero(normal @ of.eye > 0)  # nothing else of a closed mesh is seen
    seen = raster.look(vertices, faces[towards], of)
    pixel = np.flatnonzero(seen.face.reshape(-1) >= 0)
    face = towards[seen.face.reshape(-1)[pixel]]
    light = of.eye + 0.45 * of.up - 0.35 * of.right
    bright = 0.45 + 0.55 * np.abs(normal @ (light / np.linalg.norm(light)))
    tints = np.full((len(faces), 4), 255, np.uint8)
    tints[:, :3] = np.clip(np.round(bright[:, None] * np.array(colour) * 255), 0, 255)
    depth = seen.depth.reshape(-1)[pixel].astype(np.float32)
    return DrawnBody(pixel, depth, tints.view(np.uint32).reshape(-1)[face], _patches(faces, normal)[face])


def _patches(faces: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Return the number of the smooth patch, from 1, that each face lies in."""
    sides = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1).astype(np.int64)
    key = sides[:, 0] * (int(faces.max(initial=0)) + 1) + sides[:, 1]
    order = np.argsort(key, kind="stable")
    same = np.flatnonzero(key[order][1:] == key[order][:-1])
    one, two = order[same] // 3, order[same + 1] // 3
    smooth = np.einsum("ij,ij->i", normal[one], normal[two]) > math.cos(math.radians(CREASE_DEG))
    links = coo_array((np.ones(smooth.sum(), np.int8), (one[smooth], two[smooth])), shape=(len(faces), len(faces)))
    return connected_components(links, directed=False)[1] + 1


def together(bodies: Sequence[DrawnBody], of: Camera) -> bytes:
    """Return the picture of bodies drawn for one view as a PNG; of two in one place the later one is seen."""
    width, height = of.size
    depth = np.full(width * height, -np.inf, np.float32)
    colour = np.full(width * height, 0xFFFFFFFF, np.uint32)
    patch = np.zeros(width * height, np.int32)
    before = 0
    for body in bodies:
        nearer = body.depth >= depth[body.pixel] - _TIE_MM
        at = body.pixel[nearer]
        depth[at], colour[at], patch[at] = body.depth[nearer], body.colour[nearer], body.patch[nearer] + before
        before += int(body.patch.max(initial=0))
    field = patch.reshape(height, width)
    line = np.zeros((height, width), bool)
    for one, other in ((np.s_[:, 1:], np.s_[:, :-1]), (np.s_[1:], np.s_[:-1])):
        differs = field[one] != field[other]
        line[one] |= differs
        line[other] |= differs
    pixels = colour.view(np.uint8).reshape(height, width, 4)[:, :, :3]
    pixels[line] = (pixels[line] * _INK).astype(np.uint8)
    return raster.png(_shrunk(pixels), _EFFORT)


def _shrunk(picture: np.ndarray) -> np.ndarray:
    """Return a picture of bytes of which every pixel is the mean of SHARPER by SHARPER."""
    total = np.zeros((picture.shape[0] // SHARPER, picture.shape[1] // SHARPER, 3), np.uint16)
    for i in range(SHARPER):
        for j in range(SHARPER):
            total += picture[i::SHARPER, j::SHARPER]
    return ((total + SHARPER**2 // 2) // SHARPER**2).astype(np.uint8)
