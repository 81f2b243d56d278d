"""Shaded pictures of triangle meshes: parallel projection and a depth buffer by numpy, names and PNG by Pillow.

No display and no GPU: the same meshes give the same bytes. Any mesh is drawn unchanged: open, turned inside out or
passing through itself. A mesh is drawn once for a view, as a `Layer`, and serves every picture from that view.
"""

from __future__ import annotations

import io
import math
import unicodedata
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from PIL import Image, ImageChops, ImageDraw, ImageFont

from unitcad.geometry.components import components
from unitcad.text import printable

Colour = tuple[float, float, float]
"""Red, green and blue, 0 to 1."""
SHARPER = 2
"""Pixels of the depth buffer along a pixel of the picture, along either side."""
CREASE_DEG = 25.0
"""Faces that meet at more than this angle have a line between them."""
INK, WIRE, HATCH = 0.28, 0.4, 0.72
"""The part of its colour that a pixel keeps on a line, on the side of a face and on a hatch."""
LETTER_PX = 24
MOST_CHARACTERS = 28
"""The longest name that is written whole."""
MARGIN_PX, EDGE_PX, GAP_PX, APART_PX = 6, 8, 6, 12
"""White margin above and below the drawing; gap from a name to the picture's edge, to the drawing, to another name."""
_FRAGMENTS = 50_000  # a block's, which stay in the processor's cache
_FACES = 100_000


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


def aim(
    towards_eye: Colour, points: np.ndarray, size: tuple[int, int], reach: float = 0.0, turned: bool = False
) -> Camera:
    """Return a view of all `points` (n, 3) mm with a margin, and of a ball of radius `reach` mm in their middle.

    `turned`: upside down, like parts on their back.
    """
    eye = np.array(towards_eye, float) / np.linalg.norm(towards_eye)
    upwards = np.array([0.0, 0.0, 1.0]) if abs(eye[2]) < 0.99 else np.array([0.0, 1.0, 0.0])
    right = np.cross(upwards, eye)
    right /= np.linalg.norm(right)
    plane = np.stack([right, np.cross(eye, right)])
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    flat = (points - middle) @ plane.T
    low, high = flat.min(axis=0), flat.max(axis=0)
    half = np.maximum((high - low) / 2 * 1.1, max(reach, 1e-12))
    right, up = -plane if turned else plane
    scale = float((np.array(size) / 2 / half).min())
    return Camera(right, up, eye, middle + (low + high) / 2 @ plane, scale, size)


@dataclass(frozen=True)
class Layer:
    """A mesh in a view: the rectangle of the depth buffer that it reaches, from its `top` row and `left` column.

    For each pixel (height, width) there: depth in mm and face; minus infinity and -1 off the mesh. For each face (m,):
    colour, four bytes, and the number of its smooth patch, from 1; -1 for a cut.
    """

    top: int
    left: int
    depth: np.ndarray
    face: np.ndarray
    colours: np.ndarray
    patches: np.ndarray

    @property
    def window(self) -> tuple[slice, slice]:
        """The rectangle, as an index."""
        rows, columns = self.depth.shape
        return slice(self.top, self.top + rows), slice(self.left, self.left + columns)


@dataclass(frozen=True)
class Surface:
    """A mesh in a picture: vertices (n, 3) mm, faces (m, 3), its colour or one a face; `label` is written next to it.

    It is closed unless it has an `inside`: the colour of faces seen from behind.
    """

    vertices: np.ndarray
    faces: np.ndarray
    colour: Colour | np.ndarray
    label: str = ""
    inside: Colour | np.ndarray | None = None


@dataclass(frozen=True)
class Label:
    """A name in its place: its box in pixels of the picture, and the line from `start`, on the named part, to `end`."""

    text: str
    left: int
    top: int
    width: int
    height: int
    start: tuple[float, float]
    end: tuple[float, float] | None
    ring: bool


@dataclass(frozen=True)
class Name:
    """A name and a point (x, y, z) mm of the named part: under a dot, or in a `ring` if a dot would cover it.

    `on`: the name itself is written there, without a line to it.
    """

    text: str
    at: tuple[float, float, float]
    ring: bool = False
    on: bool = False


def draw(surfaces: Sequence[Surface], towards_eye: Colour, size: tuple[int, int]) -> bytes:
    """Draw surfaces as a PNG, seen from one side; those with a label are named."""
    view = aim(towards_eye, np.concatenate([surface.vertices for surface in surfaces]), size)
    layers = [render(surface, view) for surface in surfaces]
    return finish(layers, view, labels=[surface.label for surface in surfaces])


def render(surface: Surface, view: Camera, cut: float = np.inf) -> Layer:
    """Draw a surface, without faces nearer the eye than `cut` (mm from the view's middle).

    If it is cut, faces seen from behind are the cut: hatched, in their colour as it is. Others are lit.
    """
    corners = surface.vertices[surface.faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    towards = normal @ view.eye
    inside = surface.inside
    kept = np.flatnonzero(towards > 0) if inside is None else np.arange(len(towards))
    top, left, face, depth = rasterise(surface.vertices, surface.faces[kept], _fine(view), cut)
    light = view.eye + 0.45 * view.up - 0.35 * view.right
    bright = 0.45 + 0.55 * np.abs(normal @ (light / np.linalg.norm(light)))
    behind = towards < 0
    hatched = behind & np.isfinite(cut)
    colour = surface.colour if inside is None else np.where(behind[:, None], inside, surface.colour)
    tints = np.full((len(towards), 4), 255, np.uint8)
    tints[:, :3] = np.clip(np.round(colour * np.where(hatched, 1.0, bright)[:, None] * 255), 0, 255)
    patches = np.where(hatched, -1, _patches(surface.faces, normal)).astype(np.int32)
    return Layer(top, left, depth.astype(np.float32), face, tints[kept], patches[kept])


def _fine(view: Camera) -> Camera:
    return replace(view, scale=SHARPER * view.scale, size=(SHARPER * view.size[0], SHARPER * view.size[1]))


def _patches(faces: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Return the number of each face's smooth patch, from 1."""
    sides = np.sort(np.stack([faces, np.roll(faces, -1, axis=1)], axis=2).reshape(-1, 2), axis=1).astype(np.int64)
    key = sides[:, 0] * (int(faces.max(initial=0)) + 1) + sides[:, 1]
    order = np.argsort(key, kind="stable")
    same = np.flatnonzero(key[order][1:] == key[order][:-1])
    one, two = order[same] // 3, order[same + 1] // 3
    smooth = np.einsum("ij,ij->i", normal[one], normal[two]) > math.cos(math.radians(CREASE_DEG))
    return components(len(faces), one[smooth], two[smooth]) + 1


def look(vertices: np.ndarray, faces: np.ndarray, view: Camera) -> tuple[np.ndarray, np.ndarray]:
    """Return, of each pixel of a picture (height, width), the face that it shows, -1 for none, and its depth in mm."""
    top, left, face, depth = rasterise(vertices, faces, view)
    below, right = view.size[1] - top - face.shape[0], view.size[0] - left - face.shape[1]
    room = ((top, below), (left, right))
    return np.pad(face, room, constant_values=-1), np.pad(depth, room, constant_values=-np.inf)


def rasterise(
    vertices: np.ndarray, faces: np.ndarray, view: Camera, cut: float = np.inf
) -> tuple[int, int, np.ndarray, np.ndarray]:
    """Return the visible part of a mesh, cut off nearer to the eye than `cut`, in the rectangle that it reaches.

    That is the rectangle's first row and column, and for each pixel the face, -1 for none, and the depth in mm. The
    later of two faces in one place, to a part of a pixel, is visible.
    """
    points = view.project(vertices)
    reached = points[faces].reshape(-1, 3)[:, :2]
    ends = reached.min(axis=0, initial=np.inf), reached.max(axis=0, initial=-np.inf) + 1
    (left, top), (right, bottom) = (np.clip(np.floor(end), 0, view.size).astype(int) for end in ends)
    shape = max(int(bottom - top), 0), max(int(right - left), 0)
    steps = 16 * view.scale
    least = np.full(shape[0] * shape[1], -np.inf)
    shown = np.full(len(least), -1, np.int32)
    for face, pixel, depth in _fragments(points - (left, top, 0.0), faces, shape):
        depth = np.round(depth * steps)
        kept = (depth <= cut * steps) & (depth >= least[pixel])
        face, pixel, depth = face[kept], pixel[kept], depth[kept]
        np.maximum.at(least, pixel, depth)
        seen = depth == least[pixel]
        shown[pixel[seen]] = face[seen]
    return int(top), int(left), shown.reshape(shape), (least / steps).reshape(shape)


def _fragments(
    points: np.ndarray, faces: np.ndarray, shape: tuple[int, int]
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Yield face, pixel and depth of every pixel's middle inside a face, in blocks: row by row of each face.

    A pixel's number is that in a picture of `shape` (height, width), row by row.
    """
    height, width = shape
    for begin in range(0, len(faces), _FACES):
        corners = points[faces[begin : begin + _FACES]]
        one, heights, sides = corners[:, 0], corners[:, :, 1], _sides(corners)
        normal = np.cross(corners[:, 1] - one, corners[:, 2] - one)
        area = normal[:, 2]
        across, down = -normal[:, :2].T / np.where(area, area, 1.0)
        low = np.clip(np.ceil(heights.min(axis=1) - 0.5), 0, height).astype(int)
        high = np.clip(np.floor(heights.max(axis=1) - 0.5), -1, height - 1).astype(int)
        which = np.flatnonzero((np.abs(area) > 1e-12) & (high >= low))
        rows = (high - low + 1)[which]
        for some in _blocks(rows):
            face, row = np.repeat(which[some], rows[some]), _count_from(low[which[some]], rows[some])
            left, right = _span(sides, face, row + 0.5)
            left, right = np.maximum(np.ceil(left - 0.5), 0), np.minimum(np.floor(right - 0.5), width - 1)
            met = np.flatnonzero(right >= left)  # a sliver has most rows between the middles of pixels
            face, row, left, right = face[met], row[met], left[met].astype(int), right[met].astype(int)
            number = right - left + 1
            lean = across[face]
            level = one[face, 2] + down[face] * (row + 0.5 - one[face, 1]) + lean * (left + 0.5 - one[face, 0])
            for block in _blocks(number):
                times = number[block]
                step = _count_from(np.zeros_like(times), times)
                depth = np.repeat(level[block], times) + step * np.repeat(lean[block], times)
                pixel = np.repeat((row * width + left)[block], times) + step
                yield np.repeat((face[block] + begin).astype(np.int32), times), pixel, depth


def _blocks(count: np.ndarray) -> list[np.ndarray]:
    """Return the numbers of the entries of `count` (n,) in blocks, of which each counts some _FRAGMENTS in all."""
    ends = np.cumsum(count)
    marks = np.arange(_FRAGMENTS, ends[-1] if len(ends) else 0, _FRAGMENTS)
    return np.split(np.arange(len(count)), np.searchsorted(ends, marks))


def _count_from(start: np.ndarray, count: np.ndarray) -> np.ndarray:
    """Return, for each pair, the whole numbers from `start` on, `count` of them, one list behind the other."""
    return np.arange(count.sum()) + np.repeat(start - (np.cumsum(count) - count), count)


class _Sides(NamedTuple):
    """The sides of faces (n): of each x, y, run, rise, least and largest x (3n, 6); the lowest and the middle y (n,).

    `long` goes from the lowest to the highest corner, past the middle one; `below` and `above` meet there.
    """

    table: np.ndarray
    least: np.ndarray
    middle: np.ndarray
    highest: np.ndarray
    long: np.ndarray
    below: np.ndarray
    above: np.ndarray

    def cross(self, side: np.ndarray, level: np.ndarray) -> np.ndarray:
        """Return the x (m,) at which sides, or the lines that they are on, meet y = `level` (m,)."""
        x, y, run, rise, low, high = self.table[side].T
        return np.clip(x + (level - y) / rise * run, low, high)


def _sides(corners: np.ndarray) -> _Sides:
    """Return the sides of faces with `corners` (n, 3, 3) in px."""
    x0, y0 = corners[:, :, 0], corners[:, :, 1]
    x1, y1 = np.roll(x0, 1, axis=1), np.roll(y0, 1, axis=1)
    rise = np.where(y0 != y1, y1 - y0, 1.0)
    table = np.stack([x0, y0, x1 - x0, rise, np.minimum(x0, x1), np.maximum(x0, x1)], axis=2).reshape(-1, 6)
    order = np.argsort(y0, axis=1, kind="stable")
    opposite = (order - 1) % 3 + 3 * np.arange(len(corners))[:, None]  # the number of the side opposite a corner
    above, long, below = np.ascontiguousarray(opposite.T)
    least, middle, highest = np.ascontiguousarray(np.take_along_axis(y0, order, axis=1).T)
    return _Sides(table, least, middle, highest, long, below, above)


def _span(sides: _Sides, face: np.ndarray, level: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return start and end (px) of the line y = `level` in faces, all of which meet it: (m,) each."""
    middle = sides.middle[face]
    first = (level < middle) | ((level == middle) & (sides.least < sides.middle)[face])
    one = sides.cross(sides.long[face], level)
    other = sides.cross(np.where(first, sides.below[face], sides.above[face]), level)
    start, end = np.minimum(one, other), np.maximum(one, other)
    if len(both := np.flatnonzero((level == middle) & first & (sides.middle < sides.highest)[face])):
        third = sides.cross(sides.above[face[both]], level[both])
        start[both], end[both] = np.minimum(start[both], third), np.maximum(end[both], third)
    return start, end


def compose(layers: Sequence[Layer], view: Camera, wires: bool = False) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Draw layers over one another, with lines round smooth patches and, with `wires`, along the sides of all faces.

    Return pixels of the depth buffer (height, width): colour in bytes (.., 4), depth in mm, and the number of the face
    from 1 on, counted through all layers. The later of two layers in one place, to a tenth of a pixel, is visible.
    """
    width, height = _fine(view).size
    depth, shown = np.full((height, width), -np.inf, np.float32), np.zeros((height, width), np.int32)
    tints, patches = [np.full((1, 4), 255, np.uint8)], [np.zeros(1, np.int32)]
    count = 1
    for one in layers:
        at = one.window
        nearer = one.depth > depth[at] - 0.05 / view.scale
        np.copyto(depth[at], one.depth, where=nearer)
        np.add(one.face, np.int32(count), out=shown[at], where=nearer)
        tints.append(one.colours)
        patches.append(np.where(one.patches > 0, one.patches + np.int32(count), -1))
        count += len(one.patches)
    numbers = np.concatenate(patches)
    patch = numbers[shown]
    shade = np.zeros(patch.shape, np.int32)
    if wires:
        thin = (shown[:, 1:] != shown[:, :-1])[1:] | (shown[1:] != shown[:-1])[:, 1:]
        shade[1:, 1:][thin & (patch[1:, 1:] > 0)] = 1
    if numbers.min() < 0:
        shade[(patch < 0) & (np.add.outer(np.arange(height), np.arange(width)) % 16 < 3)] = 2
    for one, other in ((np.s_[:, 1:], np.s_[:, :-1]), (np.s_[1:], np.s_[:-1])):
        differs = patch[one] != patch[other]
        for side in (one, other):
            np.copyto(shade[side], 3, where=differs)
    tint = np.concatenate(tints)
    table = np.concatenate([tint * np.array([part, part, part, 1.0]) for part in (1.0, WIRE, HATCH, INK)])
    shade *= count
    shade += shown
    return table.astype(np.uint8).view(np.uint32)[shade, 0].view(np.uint8).reshape(height, width, 4), depth, shown


def finish(
    layers: Sequence[Layer],
    view: Camera,
    names: Sequence[Name] = (),
    labels: Sequence[str] = (),
    wires: bool = False,
) -> bytes:
    """Return the picture of layers drawn for one view as a PNG, without the empty rows above and below.

    Names, and the `labels` of layers, are clear of the drawing and of each other if there is room, each with a line to
    the named part.
    """
    colour, _, shown = compose(layers, view, wires)
    shown = shown[::SHARPER, ::SHARPER]
    picture = Image.fromarray(colour).convert("RGB")
    names = [*name_layers(layers, labels, shown, view), *names]
    pen, font = ImageDraw.Draw(picture), picture_font()
    for label in place_names(names, shown > 0, view):
        corner = SHARPER * label.left, SHARPER * label.top
        if label.end:
            (x, y), radius = label.start, 7.0 if label.ring else 3.0
            away = max(math.dist(label.start, label.end), radius)
            share = radius / away if label.ring else 0.0
            ends = x + share * (label.end[0] - x), y + share * (label.end[1] - y), *label.end
            line = [SHARPER * value for value in ends]
            pen.line(line, "white", 3 * SHARPER)
            pen.line(line, "black", SHARPER)
            ball = [SHARPER * value for value in (x - radius, y - radius, x + radius, y + radius)]
            pen.ellipse(ball, None if label.ring else "black", "black", SHARPER)
        pen.text(corner, label.text, "black", font, stroke_width=2 * SHARPER, stroke_fill="white")
    picture = picture.reduce(SHARPER)
    _, top, _, bottom = ImageChops.invert(picture).getbbox() or (0, 0, *view.size)
    return encode_png(picture.crop((0, max(top - MARGIN_PX, 0), view.size[0], min(bottom + MARGIN_PX, view.size[1]))))


def name_layers(layers: Sequence[Layer], labels: Sequence[str], shown: np.ndarray, view: Camera) -> list[Name]:
    """Name the visible part of each layer that has a label, well inside it near its left end; from left to right.

    `shown` (height, width): the number of the face of each pixel, as `compose` counts them.
    """
    names, count = [], 1
    for text, one in zip(labels, layers, strict=False):
        seen = (shown >= count) & (shown < count + len(one.patches))
        count += len(one.patches)
        if text and seen.any():
            rows, columns = np.nonzero(seen)
            left, top = find_free_box(~seen, (columns.min(), (rows.min() + rows.max()) / 2), (6, 6))
            at = int(np.argmin(np.hypot(columns - left - 3, rows - top - 3)))
            right, down = (np.array([columns[at], rows[at]]) + 0.5 - np.array(view.size) / 2) / view.scale
            names.append(Name(text, tuple((view.middle + right * view.right - down * view.up).tolist())))
    return sorted(names, key=lambda name: float(view.right @ name.at))


def place_names(names: Sequence[Name], drawn: np.ndarray, view: Camera) -> list[Label]:
    """Give names a place in a picture, clear of the `drawn` pixels (height, width) and of each other."""
    covered = Image.fromarray(drawn.astype(np.uint8))
    cover, font, labels = ImageDraw.Draw(covered), picture_font(), []
    for name in names:
        text = name.text if len(name.text) <= MOST_CHARACTERS else f"{name.text[: MOST_CHARACTERS - 3]}..."
        # Pillow's font has the letters of ASCII: others lose their accents.
        plain = (letter for letter in unicodedata.normalize("NFKD", text) if not unicodedata.combining(letter))
        text = printable("".join(plain).encode("ascii", "replace").decode())
        x, y = view.project(np.array(name.at))[0, :2].tolist()
        wide, high = math.ceil(font.getlength(text) / SHARPER), math.ceil(sum(font.getmetrics()) / SHARPER)
        end = None
        if name.on:
            left, top = round(x - wide / 2), round(y - high / 2)
            left, top = min(max(left, 0), view.size[0] - wide), min(max(top, 0), view.size[1] - high)
        else:
            left, top = find_free_box(np.asarray(covered) > 0, (x, y), (wide, high))
            end = min(max(x, left), left + wide), min(max(y, top), top + high)
            cover.line((x, y, *end), 1, 8)
        cover.rectangle((left - APART_PX, top - APART_PX, left + wide + APART_PX, top + high + APART_PX), 1)
        labels.append(Label(text, left, top, wide, high, (x, y), end, name.ring))
    return labels


@lru_cache(maxsize=16)
def picture_font(size: float = SHARPER * LETTER_PX) -> ImageFont.FreeTypeFont:
    """Return Pillow's own font of a size (px), set letter by letter, which is the same on every machine."""
    font = ImageFont.load_default(size)
    assert isinstance(font, ImageFont.FreeTypeFont), "Pillow lacks FreeType"
    return font.font_variant(layout_engine=ImageFont.Layout.BASIC)


def find_free_box(taken: np.ndarray, at: tuple[float, float], size: tuple[int, int]) -> tuple[int, int]:
    """Return the left column and top row of the box of `size` (width, height) nearest to a point (x, y).

    `taken` (height, width): the pixels that the box, with a gap round it, keeps clear of; if no place is clear, it
    covers as few of them as it can.
    """
    height, width = taken.shape
    left = np.arange(EDGE_PX, max(width - EDGE_PX - size[0], EDGE_PX) + 1, 2)
    top = np.arange(EDGE_PX, max(height - EDGE_PX - size[1], EDGE_PX) + 1, 2)
    total = np.zeros((height + 1, width + 1), np.int32)
    total[1:, 1:] = taken.cumsum(axis=0, dtype=np.int32).cumsum(axis=1)
    right, bottom = np.minimum(left + size[0] + GAP_PX, width), np.minimum(top + size[1] + GAP_PX, height)
    upper, lower = total[top - GAP_PX], total[bottom]
    covered = lower[:, right] - lower[:, left - GAP_PX] - upper[:, right] + upper[:, left - GAP_PX]
    across = np.maximum(np.maximum(left - at[0], at[0] - left - size[0]), 0.0)
    down = np.maximum(np.maximum(top - at[1], at[1] - top - size[1]), 0.0)
    cost = np.hypot(across[None, :], down[:, None]) + 1e6 * covered
    row, column = np.unravel_index(int(cost.argmin()), cost.shape)
    return int(left[column]), int(top[row])


def encode_png(picture: Image.Image) -> bytes:
    """Return a picture as a PNG file (ISO/IEC 15948): same pixels, same bytes."""
    content = io.BytesIO()
    picture.save(content, "PNG", compress_level=4)
    return content.getvalue()
