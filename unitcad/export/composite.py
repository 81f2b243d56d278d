"""Pictures in which several bodies stand together: each is drawn once for a view, and serves every picture of it.

Closed meshes, parallel projection, no display and no GPU: the same bodies give the same bytes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from unitcad.export import picture_letters, raster
from unitcad.export.name_places import nearest_free
from unitcad.export.picture_letters import Name
from unitcad.export.raster import Camera
from unitcad.geometry.components import components

CREASE_DEG = 25.0
"""Faces that meet at more than this angle have a line between them."""
SHARPER = 2
"""Pixels of the view along a pixel of the picture, along either side."""
_INKED = (np.arange(256) * 0.28).astype(np.uint8)
"""What a line leaves of each of the 256 brightnesses under it."""
_WHITE = 0xFFFFFFFF
_BLACK = np.array([0, 0, 0, 255], np.uint8).view(np.uint32)[0]
_LANES, _HALF = np.uint32(0x00FF00FF), np.uint32(0x00020002)
_ROWS = 16
"""Of the picture at a time: they stay in the processor's cache."""
_TIE_MM = 1e-4
MARGIN_PX = 6
"""White above and below what a picture shows, pixels."""
LETTER_PX = 2.7
_APART = 12
"""A fourth of a small letter's height, in pixels of the picture."""
_EFFORT = 3
"""Of the compression: one more takes 1.7 times as long, for files a seventh smaller."""


@dataclass(frozen=True)
class DrawnBody:
    """A body in a view: the rectangle of pixels that it reaches, from its `top` row and `left` column.

    Of each pixel (height, width) there: depth in mm (minus infinity where the body is not), colour and smooth patch.
    A colour is four bytes, red, green, blue and 255, in one number.
    """

    top: int
    left: int
    depth: np.ndarray
    colour: np.ndarray
    patch: np.ndarray


def view(
    towards_eye: tuple[float, float, float], points: np.ndarray, size: tuple[int, int], turned: bool = False
) -> Camera:
    """Return a view that holds all `points` (n, 3) mm, for pictures of `size` (width, height) pixels.

    `turned`: upside down, as things look that lie on their back.
    """
    low, high = points.min(axis=0), points.max(axis=0)
    camera = raster.camera(towards_eye, (low + high) / 2, points, (SHARPER * size[0], SHARPER * size[1]))
    return replace(camera, right=-camera.right, up=-camera.up) if turned else camera


def drawn(vertices: np.ndarray, faces: np.ndarray, colour: tuple[float, float, float], of: Camera) -> DrawnBody:
    """Draw a closed mesh (n, 3) mm, (m, 3) in one colour, three numbers 0 to 1."""
    corners = vertices[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    towards = np.flatnonzero(normal @ of.eye > 0)  # nothing else of a closed mesh is seen
    top, left, face, depth = raster.nearest(vertices, faces[towards], of)
    light = of.eye + 0.45 * of.up - 0.35 * of.right
    bright = 0.45 + 0.55 * np.abs(normal[towards] @ (light / np.linalg.norm(light)))
    # The last entries are of the face -1: where the body is not.
    tints = np.full((len(towards) + 1, 4), 255, np.uint8)
    tints[:-1, :3] = np.clip(np.round(bright[:, None] * np.array(colour) * 255), 0, 255)
    patches = np.append(_patches(faces, normal)[towards], 0).astype(np.int32)
    return DrawnBody(top, left, depth.astype(np.float32), tints.view(np.uint32)[face, 0], patches[face])


def _patches(faces: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Return the number of the smooth patch, from 1, that each face lies in."""
    sides = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1).astype(np.int64)
    key = sides[:, 0] * (int(faces.max(initial=0)) + 1) + sides[:, 1]
    order = np.argsort(key, kind="stable")
    same = np.flatnonzero(key[order][1:] == key[order][:-1])
    one, two = order[same] // 3, order[same + 1] // 3
    smooth = np.einsum("ij,ij->i", normal[one], normal[two]) > math.cos(math.radians(CREASE_DEG))
    return components(len(faces), one[smooth], two[smooth]) + 1


def together(bodies: Sequence[DrawnBody], of: Camera, names: Sequence[Name] = ()) -> bytes:
    """Return the picture of bodies drawn for one view as a PNG, without the empty rows above and below.

    Of two bodies in one place the later one is seen.

    Names stand clear of the bodies and of each other where there is room, each with a line to what it names.
    """
    width, height = of.size
    colour = np.full((height, width), _WHITE, np.uint32)
    drawn = np.zeros((height, width), bool)
    if seen := [body for body in bodies if body.depth.size]:
        # A pixel more on each side, for the lines at a body's rim.
        top, left = max(min(b.top for b in seen) - 1, 0), max(min(b.left for b in seen) - 1, 0)
        bottom = min(max(b.top + b.depth.shape[0] for b in seen) + 1, height)
        right = min(max(b.left + b.depth.shape[1] for b in seen) + 1, width)
        inside = np.s_[top:bottom, left:right]
        field = colour[inside]
        patch = _stacked(seen, (top, left), field)
        drawn[inside] = patch > 0
        line = np.zeros(patch.shape, bool)
        for one, other in ((np.s_[:, 1:], np.s_[:, :-1]), (np.s_[1:], np.s_[:-1])):
            differs = patch[one] != patch[other]
            line[one] |= differs
            line[other] |= differs
        field[line] = _INKED[field[line].view(np.uint8)].view(np.uint32) | _BLACK
    _write(colour, drawn, names, of)
    rows = np.flatnonzero((colour != _WHITE).any(axis=1))
    top, bottom = (int(rows[0]), int(rows[-1]) + 1) if len(rows) else (0, height)
    top, bottom = max(top // SHARPER - MARGIN_PX, 0), min(-(-bottom // SHARPER) + MARGIN_PX, height // SHARPER)
    return raster.png(_shrunk(colour[SHARPER * top : SHARPER * bottom]), _EFFORT)


def _stacked(bodies: Sequence[DrawnBody], corner: tuple[int, int], colour: np.ndarray) -> np.ndarray:
    """Draw bodies into the `colour` of a rectangle that has its upper left at `corner`; return its smooth patches.

    Patches are numbered through all bodies, from 1; 0 where there is none.
    """
    depth = np.full(colour.shape, -np.inf, np.float32)
    patch = np.zeros(colour.shape, np.int32)
    before = 0
    for body in bodies:
        rows, columns = body.depth.shape
        top, left = body.top - corner[0], body.left - corner[1]
        at = np.s_[top : top + rows, left : left + columns]
        if not before:
            depth[at], colour[at], patch[at] = body.depth, body.colour, body.patch
        else:
            nearer = body.depth > depth[at] - _TIE_MM
            np.copyto(depth[at], body.depth, where=nearer)
            np.copyto(colour[at], body.colour, where=nearer)
            np.add(body.patch, before, out=patch[at], where=nearer)
        before += int(body.patch.max())
    return patch


def _write(colour: np.ndarray, drawn: np.ndarray, names: Sequence[Name], of: Camera) -> None:
    """Write names into a picture (height, width), black on a white border, beside what is `drawn`."""
    taken = drawn.copy()
    for name in names:
        ink = picture_letters.written(name.text, SHARPER * LETTER_PX)
        x, y, _ = of.project(np.array(name.at))[0]
        rows, columns = ink.shape
        if name.on:
            left, top = round(x - columns / 2), round(y - rows / 2)
            left, top = min(max(left, 0), of.size[0] - columns), min(max(top, 0), of.size[1] - rows)
        else:
            left, top = nearest_free(taken, (x, y), (columns, rows))
        end = min(max(x, left), left + columns), min(max(y, top), top + rows)
        steps = np.linspace(0, 1, max(int(np.hypot(end[0] - x, end[1] - y)), 2))[:, None]
        line = np.round(np.array([y, x]) + steps * (np.array(end[::-1]) - (y, x))).astype(int)
        line = np.clip(line, 0, np.array(drawn.shape) - 1)
        # All that changes lies round line, dot and letters: the rest of the picture is left alone.
        dot, reach = (7.0 if name.ring else 3.0) * SHARPER, 3 * SHARPER + 1
        low = np.floor(np.minimum(line.min(axis=0), np.minimum((top, left), (y - dot, x - dot)))).astype(int) - reach
        high = np.ceil(np.maximum(line.max(axis=0), np.maximum((top + rows, left + columns), (y + dot, x + dot))))
        (up, side), (down, far) = np.maximum(low, 0), np.minimum(high.astype(int) + reach, drawn.shape)
        window = np.s_[up:down, side:far]
        mask = np.zeros((down - up, far - side), bool)
        if not name.on:
            mask[tuple((line - (up, side)).T)] = True
            mask = _grown(mask, 1)
            mask[_disc(window, (x, y), dot)] = True
            if name.ring:
                mask[_disc(window, (x, y), dot - 1.2 * SHARPER)] = False
        mask[top - up : top - up + rows, left - side : left - side + columns] |= ink
        colour[window][_grown(mask, (3 if name.on else 1) * SHARPER)] = _WHITE
        colour[window][mask] = _BLACK
        taken[window] |= _grown(mask, 3 * SHARPER)
        taken[max(top - _APART, 0) : top + rows + _APART, max(left - _APART, 0) : left + columns + _APART] = True


def _grown(mask: np.ndarray, pixels: int) -> np.ndarray:
    """Return a mask that reaches further by some pixels, counted along rows and columns."""
    for _ in range(pixels):
        grown = mask.copy()
        grown[1:] |= mask[:-1]
        grown[:-1] |= mask[1:]
        grown[:, 1:] |= mask[:, :-1]
        grown[:, :-1] |= mask[:, 1:]
        mask = grown
    return mask


def _disc(window: tuple[slice, slice], middle: tuple[float, float], radius: float) -> np.ndarray:
    row, column = np.ogrid[window]
    return (column + 0.5 - middle[0]) ** 2 + (row + 0.5 - middle[1]) ** 2 <= radius**2


def _shrunk(colour: np.ndarray) -> np.ndarray:
    """Return colours (h, w), as of a body, as bytes (h', w', 3): every pixel is the mean of SHARPER by SHARPER."""
    picture = np.empty((colour.shape[0] // SHARPER, colour.shape[1] // SHARPER, 4), np.uint8)
    for begin in range(0, len(picture), _ROWS):
        some = colour[SHARPER * begin : SHARPER * (begin + _ROWS)]
        lanes = picture[begin : begin + _ROWS].view(np.uint32)[..., 0]
        # Two of the four bytes at once: the sum of each has sixteen bits, and takes fewer.
        for shift in (0, 8):
            bytes_of = (some >> shift) & _LANES
            rows = bytes_of[::SHARPER] + bytes_of[1::SHARPER]
            mean = (rows[:, ::SHARPER] + rows[:, 1::SHARPER] + _HALF) >> 2 & _LANES
            if shift:
                lanes |= mean << shift
            else:
                lanes[...] = mean
    return picture[..., :3]
