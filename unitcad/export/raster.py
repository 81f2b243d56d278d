"""Shaded pictures of triangle meshes by numpy alone: parallel projection, a depth buffer, PNG. No display, no GPU.

Any mesh is drawn unchanged: open, turned inside out or passing through itself.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

BACKGROUND = (1.0, 1.0, 1.0)
INSIDE = (0.62, 0.50, 0.40)
"""The colour of faces seen from behind: the inside of a part, through a hole or a cut."""
CUT = (0.93, 0.87, 0.76)
LINE = (0.10, 0.10, 0.12)
_FRAGMENTS = 200_000  # a block's, which stay in the processor's cache
_FACES = 100_000
_PIXELS = 50_000


@dataclass(frozen=True)
class Camera:
    """A parallel view.

    Unit vectors to the right, up and towards the eye (3,), the point in the middle (3,) mm, pixels a mm, and the
    picture's size (width, height) in pixels.
    """

    right: np.ndarray
    up: np.ndarray
    eye: np.ndarray
    middle: np.ndarray
    scale: float
    size: tuple[int, int]

    def project(self, points: np.ndarray) -> np.ndarray:
        """Return points (n, 3) mm as pixels from the left, pixels from the top, and mm towards the eye."""
        seen = (np.asarray(points, float).reshape(-1, 3) - self.middle) @ np.stack([self.right, self.up, self.eye]).T
        seen[:, 0] = self.size[0] / 2 + seen[:, 0] * self.scale
        seen[:, 1] = self.size[1] / 2 - seen[:, 1] * self.scale
        return seen


def camera(
    towards_eye: tuple[float, float, float],
    middle: np.ndarray,
    reach: float | np.ndarray,
    size: tuple[int, int],
) -> Camera:
    """Return a view that holds a ball of radius `reach` mm round `middle`; given points (n, 3) instead, all of them."""
    eye = np.array(towards_eye, float) / np.linalg.norm(towards_eye)
    upwards = np.array([0.0, 0.0, 1.0]) if abs(eye[2]) < 0.99 else np.array([0.0, 1.0, 0.0])
    right = np.cross(upwards, eye)
    right /= np.linalg.norm(right)
    up = np.cross(eye, right)
    if isinstance(reach, np.ndarray):
        plan = (reach - middle) @ np.stack([right, up]).T
        low, high = plan.min(axis=0), plan.max(axis=0)
        middle = middle + np.stack([right, up]).T @ ((low + high) / 2)
        half = np.maximum((high - low) / 2, 1e-12) * 1.1
    else:
        half = np.full(2, max(reach, 1e-12))
    return Camera(right, up, eye, middle, float((np.array(size) / 2 / half).min()), size)


@dataclass(frozen=True)
class Seen:
    """The faces that a picture's pixels show: an index (height, width), -1 for none, and its depth in mm."""

    face: np.ndarray
    depth: np.ndarray


def look(
    vertices: np.ndarray, faces: np.ndarray, view: Camera, cut: float = np.inf, first: np.ndarray | None = None
) -> Seen:
    """Return what is seen of a mesh (n, 3) mm, (m, 3), without what is nearer the eye than `cut` (mm from the middle).

    Faces that `first` (m,) marks are seen before others of the same depth.
    """
    width, height = view.size
    seen = Seen(np.full((height, width), -1, np.int32), np.full((height, width), -np.inf))
    top, left, face, depth = nearest(vertices, faces, view, cut, first)
    at = np.s_[top : top + face.shape[0], left : left + face.shape[1]]
    seen.face[at], seen.depth[at] = face, depth
    return seen


def nearest(
    vertices: np.ndarray, faces: np.ndarray, view: Camera, cut: float = np.inf, first: np.ndarray | None = None
) -> tuple[int, int, np.ndarray, np.ndarray]:
    """Return what is seen of a mesh, as `look`, in the rectangle of pixels that it reaches.

    That is its first row and column, and of each pixel the face, -1 for none, and the depth in mm.
    """
    if not len(faces):
        return 0, 0, np.empty((0, 0), np.int32), np.empty((0, 0))
    points = view.project(vertices)
    low, high = np.floor(points[:, :2].min(axis=0)), np.ceil(points[:, :2].max(axis=0)) + 1
    (left, top), (right, bottom) = (np.clip(ends, 0, view.size).astype(int) for ends in (low, high))
    shape = int(bottom - top), int(right - left)
    points -= (left, top, 0.0)
    least = np.full(shape[0] * shape[1], -np.inf)
    shown = np.full(len(least), -1, np.int32)
    plain, begun = first is None and cut == np.inf, False
    for face, pixel, depth in _fragments(points, faces, shape):
        if begun or not plain:  # else all are the first in their pixels
            kept = depth <= cut
            if first is not None:
                depth = depth + first[face] * (0.25 / view.scale)
            kept &= depth > least[pixel]
            face, pixel, depth = face[kept], pixel[kept], depth[kept]
        begun = True
        np.maximum.at(least, pixel, depth)
        seen = depth == least[pixel]
        shown[pixel[seen]] = face[seen]
    return int(top), int(left), shown.reshape(shape), least.reshape(shape)


def _fragments(
    points: np.ndarray, faces: np.ndarray, shape: tuple[int, int]
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Yield face, pixel and depth of every pixel's middle that lies in a face, in blocks: row by row of each face.

    A pixel's number is that in a picture of `shape` (height, width), row by row.
    """
    height, width = shape
    for begin in range(0, len(faces), _FACES):
        corners = points[faces[begin : begin + _FACES]]
        one, two, three = (corners[:, k] for k in range(3))
        first, second = two - one, three - one
        area = first[:, 0] * second[:, 1] - second[:, 0] * first[:, 1]
        low = np.clip(np.ceil(corners[:, :, 1].min(axis=1) - 0.5), 0, height).astype(int)
        high = np.clip(np.floor(corners[:, :, 1].max(axis=1) - 0.5), -1, height - 1).astype(int)
        across = (first[:, 2] * second[:, 1] - second[:, 2] * first[:, 1]) / np.where(area, area, 1.0)
        down = (second[:, 2] * first[:, 0] - first[:, 2] * second[:, 0]) / np.where(area, area, 1.0)
        which = np.flatnonzero((np.abs(area) > 1e-12) & (high >= low))
        rows = (high - low + 1)[which]
        for some in _blocks(rows):
            face, row = np.repeat(which[some], rows[some]), _counted(low[which[some]], rows[some])
            left, right = _span(corners, face, row + 0.5)
            left = np.clip(np.ceil(left - 0.5), 0, width).astype(int)
            right = np.clip(np.floor(right - 0.5), -1, width - 1).astype(int)
            number = np.maximum(right - left + 1, 0)
            lean, from_left = across[face], left + 0.5 - one[face, 0]
            level = one[face, 2] + down[face] * (row + 0.5 - one[face, 1]) + lean * from_left
            pixel = row * width + left
            for block in _blocks(number):
                times = number[block]
                step = _counted(np.zeros_like(times), times)
                depth = step * np.repeat(lean[block], times)
                depth += np.repeat(level[block], times)
                step += np.repeat(pixel[block], times)
                yield np.repeat((face[block] + begin).astype(np.int32), times), step, depth


def _blocks(count: np.ndarray) -> list[np.ndarray]:
    """Return the numbers of the entries of `count` (n,) in blocks, of which each counts some _FRAGMENTS in all."""
    ends = np.cumsum(count)
    return (
        np.split(np.arange(len(count)), np.searchsorted(ends, np.arange(_FRAGMENTS, ends[-1], _FRAGMENTS)))
        if len(count)
        else []
    )


def _counted(start: np.ndarray, count: np.ndarray) -> np.ndarray:
    """Return, for each pair, the whole numbers from `start` on, `count` of them, one list behind the other."""
    return np.arange(count.sum()) + np.repeat(start - (np.cumsum(count) - count), count)


def _span(corners: np.ndarray, face: np.ndarray, level: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return from where to where (px) the line y = `level` lies in faces of `corners` (n, 3, 3): (m,) each."""
    left, right = np.full(len(face), np.inf), np.full(len(face), -np.inf)
    for k in range(3):
        x0, y0 = corners[face, k, 0], corners[face, k, 1]
        x1, y1 = corners[face, k - 2, 0], corners[face, k - 2, 1]
        crosses = (np.minimum(y0, y1) <= level) & (level <= np.maximum(y0, y1)) & (y0 != y1)
        share = (level - y0) / np.where(y0 != y1, y1 - y0, 1.0)
        x = np.clip(x0 + share * (x1 - x0), np.minimum(x0, x1), np.maximum(x0, x1))
        left, right = np.where(crosses, np.minimum(left, x), left), np.where(crosses, np.maximum(right, x), right)
    return left, right


def shade(
    vertices: np.ndarray,
    faces: np.ndarray,
    colours: np.ndarray,
    plain: np.ndarray,
    seen: Seen,
    view: Camera,
    lines: np.ndarray,
    cut: bool = False,
) -> np.ndarray:
    """Return pixels (height, width, 3), 0 to 1: faces in their `colours` (m, 3), lighter towards the light.

    From behind, `plain` faces (m,) have the colour INSIDE, others their own one, darker. `lines` (m, 3): how wide, in
    pixels, the side from corner k to the next is drawn on its face. Where the part is `cut`, what lies behind the cut
    and is seen from behind is solid: it is hatched.
    """
    height, width = seen.face.shape
    which, index = np.unique(seen.face, return_inverse=True)
    none = int(which[0] < 0)  # the first one stands for no face
    corners = vertices[faces[which[none:]]]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    light = view.eye + 0.45 * view.up - 0.35 * view.right
    behind = np.asarray(normal @ view.eye < 0)
    bright = np.abs(normal @ (light / np.linalg.norm(light)))
    bright = np.where(plain[which[none:]], 0.45 + 0.55 * bright, 0.7 + 0.3 * bright)
    own, bare = colours[which[none:]], plain[which[none:], None]
    back = (
        np.where(bare, np.array(CUT), (own + np.array(CUT)) / 2)
        if cut
        else np.where(bare, np.array(INSIDE), own * 0.78)
    )
    tint = np.where(behind[:, None], back, own) * np.where(behind & cut, 1.0, bright)[:, None]
    wide = np.where((behind & cut)[:, None], 0.0, lines[which[none:]])
    tint = np.concatenate([np.array([BACKGROUND] * none).reshape(-1, 3), tint])
    side_lines = np.concatenate([np.zeros((none, 3, 3)), _side_lines(view.project(corners).reshape(-1, 3, 3))])
    wide = np.concatenate([np.zeros((none, 3)), wide])
    hatched = np.concatenate([np.zeros(none, bool), behind & cut])
    picture = np.empty((height * width, 3))
    index = index.reshape(-1)
    for begin in range(0, height * width, _PIXELS):
        pixel = np.arange(begin, min(begin + _PIXELS, height * width))
        at = index[pixel]
        row, column = np.divmod(pixel, width)
        colour = tint[at]
        stripe = hatched[at] & ((row + column) % 16 < 3)
        colour[stripe] *= 0.72
        a, b, c = np.moveaxis(side_lines[at], 2, 0)
        distance = a * (column + 0.5)[:, None] + b * (row + 0.5)[:, None] + c
        near = np.clip(wide[at] - np.abs(distance), 0, 1).max(axis=1)[:, None]
        picture[pixel] = colour + near * (np.array(LINE) - colour)
    return picture.reshape(height, width, 3)


def _side_lines(corners: np.ndarray) -> np.ndarray:
    """Return, for each side of triangles (n, 3, 3) in px, (a, b, c) by which a x + b y + c is the distance to it."""
    along = (np.roll(corners, -1, axis=1) - corners)[:, :, :2]
    length = np.maximum(np.linalg.norm(along, axis=2), 1e-9)
    a, b = -along[:, :, 1] / length, along[:, :, 0] / length
    return np.stack([a, b, -a * corners[:, :, 0] - b * corners[:, :, 1]], axis=2)


def shrunk(picture: np.ndarray, times: int) -> np.ndarray:
    """Return a picture of which every pixel is the mean of `times` by `times`."""
    height, width, _ = picture.shape
    return picture.reshape(height // times, times, width // times, times, 3).mean(axis=(1, 3))


def png(picture: np.ndarray, effort: int = 9) -> bytes:
    """Return a picture (height, width, 3), 0 to 1 or bytes, as a PNG file (ISO/IEC 15948): same pixels, same bytes."""
    height, width, _ = picture.shape
    if picture.dtype != np.uint8:
        picture = np.clip(np.round(picture * 255), 0, 255).astype(np.uint8)
    rows = np.zeros((height, 1 + width * 3), np.uint8)  # each begins with 0: as it is, no filter
    rows[:, 1:] = picture.reshape(height, width * 3)
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    chunks = ((b"IHDR", header), (b"IDAT", zlib.compress(rows.tobytes(), effort)), (b"IEND", b""))
    body = b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in chunks
    )
    return b"\x89PNG\r\n\x1a\n" + body
