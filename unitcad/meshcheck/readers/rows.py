"""Tables of text: rows of numbers in OFF, OBJ and PLY, and the polygons that become a mesh.

A text is taken in blocks of whole lines, so that what is made on the way has the size of a block.

Polygons as a file has them, cut into triangles: input from the readers of PLY, OBJ and OFF.

A polygon is cut in its own plane. A fan from a corner is taken if all its triangles turn the same way; concave
polygons, and those with corners on a line, are cut by manifold3d.
"""

from __future__ import annotations

import codecs
import math
import re
import warnings
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from manifold3d import triangulate

from unitcad.geometry.arrays import Bools, Floats, Ints
from unitcad.meshcheck.findings import Finding, Location, Unreadable, counted, number
from unitcad.meshcheck.geometry.mesh import LARGEST, Mesh, Source, weld_points
from unitcad.meshcheck.rules.f_file import (
    F001,
    F002,
    F003,
    F004,
    F008,
    F009,
    F011,
    F013,
    Deadline,
    Limits,
    not_a_number,
)
from unitcad.meshcheck.rules.p_package import P011
from unitcad.meshcheck.rules.t_topology import unreferenced
from unitcad.meshcheck.rules.v_values import faces_not_finite

NUMBER = re.compile(rb"[+-]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?", re.IGNORECASE)
NOT_FINITE = r"[+-]?(?:nan(?:\(\w*\))?|inf(?:inity)?)"
"""How programs write a number that is not finite, in either case."""
_MICROSOFT = re.compile(rb"\b1\.#(?:ind|inf|[qs]nan)\w*", re.IGNORECASE)  # not a comment
NOT_FINITE_BYTES = re.compile(NOT_FINITE.encode(), re.IGNORECASE)
_INTEGER = re.compile(rb"[+-]?\d{1,18}")
_WORD = re.compile(rb"\S+")
BLOCK = 2_000_000
UTF16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
"""Byte order marks with which a text in UTF-16 begins."""
NEWLINE, HASH, SLASH, SPACE = 10, 35, 47, 32


def table_of(characters: bytes) -> Bools:
    """Return which of the 256 bytes are among `characters`."""
    table = np.zeros(256, bool)
    table[list(characters)] = True
    return table


BLANK = table_of(b" \t\n\v\f\r")
_IN_NUMBERS = table_of(b"0123456789+-.eEnNaAiIfFtTyY \t\n\v\f\r")
_IN_INTEGERS = table_of(b"0123456789+- \t\n\v\f\r")


@dataclass(frozen=True, eq=False)
class Rows:
    """Numbers of the lines that have any: row r is values[starts[r] : starts[r + 1]], on line lines[r] (from 1)."""

    values: Floats
    starts: Ints
    lines: Ints

    def __len__(self) -> int:
        return len(self.lines)

    @property
    def sizes(self) -> Ints:
        """Numbers a row."""
        return np.diff(self.starts)


def plain(raw: bytes, findings: list[Finding]) -> bytes:
    """Return a text in UTF-8 with LF line ends and without a byte order mark; an odd encoding is a finding."""
    if raw.startswith(UTF16):
        findings.append(F009.finding("UTF-16 text with a byte order mark"))
        raw = raw.decode("utf-16", "replace").encode()
    elif raw.startswith(codecs.BOM_UTF8):
        findings.append(F009.finding("a UTF-8 byte order mark at the start"))
        raw = raw[3:]
    if b"\r" in raw:
        if b"\n" not in raw:
            findings.append(F009.finding("CR-only line ends"))
        raw = raw.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    return _MICROSOFT.sub(b"nan", raw)


def blocks(raw: bytes, at: int, deadline: Deadline, line: int = 1) -> Iterator[tuple[Ints, int]]:
    """Yield whole lines from `at` on as bytes (n,), each ending in a newline, with the number of its first line."""
    while at < len(raw):
        deadline.tick()
        cut = raw.find(b"\n", min(at + BLOCK, len(raw)))
        cut = len(raw) if cut < 0 else cut + 1
        piece = raw[at:cut]
        block = np.frombuffer(piece if piece.endswith(b"\n") else piece + b"\n", np.uint8)
        yield block, line
        line += int(np.count_nonzero(block == NEWLINE))
        at = cut


def between(block: Ints, mark: int, stop: Bools) -> Bools:
    """Return which bytes stand behind a `mark`, itself included, with no `stop` in between."""
    marked = block == mark
    if not marked.any():
        return marked
    places = np.arange(1, len(block) + 1, dtype=np.int32)
    last = np.maximum.accumulate(np.where(marked, places, 0))
    return last > np.maximum.accumulate(np.where(stop, places, 0))


def words(block: Ints) -> tuple[Ints, Ints]:
    """Return where words begin, and how many of them began before each line's end."""
    blank = BLANK[block]
    first = ~blank
    first[1:] &= blank[:-1]
    starts = np.flatnonzero(first)
    return starts, np.searchsorted(starts, np.flatnonzero(block == NEWLINE))


def rows_of(block: Ints, line: int, *, integers: bool = False, which: Ints | None = None) -> Rows:
    """Return the numbers of a block that begins on `line`: a row for each line that has any, or for the lines `which`.

    Raises `Unreadable` (F004) for a word that is no number.
    """
    starts, ends = words(block)
    values = _parse(block, len(starts), integers)
    if values is None:
        values = _slowly(block, line, integers)
    used = np.flatnonzero(np.diff(ends, prepend=0)) if which is None else which
    return Rows(values, np.concatenate([[0], ends[used]]), line + used)


def all_rows(raw: bytes, at: int, line: int, deadline: Deadline, *, comments: bool) -> Rows:
    """Return the numbers of a text from `at`, which stands on `line`; with `comments` a # begins one."""
    return joined(
        [
            rows_of(without_comments(block) if comments else block, first)
            for block, first in blocks(raw, at, deadline, line)
        ]
    )


def without_comments(block: Ints) -> Ints:
    """Return the block with blanks from each # to the end of its line."""
    return np.where(between(block, HASH, block == NEWLINE), np.uint8(SPACE), block)


def spread(firsts: Ints, counts: Ints, step: int = 1) -> Ints:
    """Return the places firsts[i], firsts[i] + step ... of all runs, counts[i] each."""
    ends = np.cumsum(counts)
    places = np.arange(int(ends[-1]) if len(ends) else 0) - np.repeat(ends - counts, counts)
    places *= step
    places += np.repeat(firsts, counts)
    return places


def columns(table: Rows, which: slice, most: int) -> Floats:
    """Return the first `most` numbers of each row. Raises `Unreadable` (F003) for a row that has fewer."""
    sizes, lines = table.sizes[which], table.lines[which]
    short = np.flatnonzero(sizes < most)
    if len(short):
        text = f"a vertex with {counted(int(sizes[short[0]]), 'number')}"
        raise F003.unreadable(text, len(short), [Location(line=int(lines[short[0]]))])
    return table.values[table.starts[:-1][which, None] + np.arange(most)]


def lengths(counts: Floats, room: Ints, lines: Ints, what: str = "face") -> Ints:
    """Return the lengths of lists whose rows have `room` numbers for them.

    Raises `Unreadable` (F003) where one is longer.
    """
    bad = np.flatnonzero(~((counts >= 0) & (counts <= room) & (counts == np.floor(counts))))
    if len(bad):
        row = int(bad[0])
        of = f"{counts[row]:.15g}"
        text = f"a {what} of {of} {'vertex' if of == '1' else 'vertices'} names {max(int(room[row]), 0)}"
        raise F003.unreadable(text, len(bad), [Location(line=int(lines[row]))])
    return counts.astype(np.int64)


def integers(values: Floats) -> Ints:
    """Return indices from numbers. Raises `Unreadable` (F004) for one that is no integer."""
    bad = np.flatnonzero(~((values == np.floor(values)) & (np.abs(values) < 2**53)))
    if len(bad):
        raise F004.unreadable(f"'{values[bad[0]]:.15g}' is not a vertex's index", len(bad))
    return values.astype(np.int64)


def joined(parts: list[Rows]) -> Rows:
    """Return rows after each other."""
    if not parts:
        return Rows(np.empty(0), np.zeros(1, np.int64), np.empty(0, np.int64))
    ends = np.cumsum([len(part.values) for part in parts])
    starts = [part.starts[1:] + end - len(part.values) for part, end in zip(parts, ends, strict=True)]
    return Rows(
        np.concatenate([part.values for part in parts]),
        np.concatenate([[0], *starts]),
        np.concatenate([part.lines for part in parts]),
    )


def _parse(block: Ints, count: int, integers: bool) -> Floats | None:
    """Return the numbers where all words of the block are some; None where one may be none."""
    if not (_IN_INTEGERS if integers else _IN_NUMBERS)[block].all():
        return None
    return numbers_of(block.tobytes(), count, integers=integers)


def numbers_of(words: bytes, count: int, *, integers: bool) -> Floats | Ints | None:
    """Return the numbers of `count` words, all of characters that numbers have; None where one word is none."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            values = np.fromstring(words, np.int64 if integers else np.float64, sep=" ")
        except (DeprecationWarning, ValueError):
            return None
    return values if len(values) == count else None  # "1-2" is two numbers to numpy


def _slowly(block: Ints, line: int, integers: bool) -> Floats:
    """Return the numbers word by word. Raises `Unreadable` for the first word that is none."""
    text = block.tobytes()
    values = []
    for match in _WORD.finditer(text):
        word = match.group()
        finite = (_INTEGER if integers else NUMBER).fullmatch(word)
        if not finite and (integers or not NOT_FINITE_BYTES.fullmatch(word)):
            place = [Location(line=line + text.count(b"\n", 0, match.start()))]
            if integers:
                shown = word[:30].decode("utf-8", "replace")
                raise F004.unreadable(f"{shown!r} is not a vertex's index", places=place)
            raise Unreadable(not_a_number(word, place))
        values.append(math.nan if not finite else int(word) if integers else float(word))
    return np.array(values, np.int64 if integers else np.float64)


FLAT = 1e-3  # F013: distance of a corner from the polygon's plane, as part of the polygon's size
_CHUNK = 50_000  # corners looked at together
_MOST_CROSSING = 500  # corners of a polygon that crosses itself and is judged
_PROPER = 1e-12  # least area of a fan's triangle, as part of the squared length of its polygon


def check_promise(n: int, size: int, limits: Limits) -> None:
    """Raise `Unreadable` if a header promises more vertices or faces than the limits (F011) or the file (F002)."""
    if n > 3 * limits.max_faces:
        raise F011.unreadable(f"{n} vertices or faces promised")
    if n > size:
        raise F002.unreadable(f"{n} vertices or faces promised in {size} bytes")


Polygons = tuple[Floats, Ints, Ints, Source]
"""Vertices (n, 3) mm, corners of all polygons (c,), how many each has (p,), and their places in the file."""


def mesh_of(
    polygons: Polygons, limits: Limits, deadline: Deadline, findings: list[Finding], counts_from: int = 0
) -> Mesh | None:
    """Return the mesh, none if a vertex is not finite, and add the faults of the polygons to the findings.

    `counts_from`: the format's first index, for messages.
    Raises `Unreadable` if there is no polygon (F001), too many (F011), or one names a missing vertex (P011).
    """
    vertices, corners, sizes, source = polygons
    short = np.flatnonzero(sizes < 3)
    if len(short):
        text = f"{counted(len(short), 'face')} with fewer than three vertices"
        findings.append(F008.finding(text, len(short), _places(source, short)))
    if len(sizes) == len(short):
        raise F001.unreadable("the file has no face")
    limits.check_faces(int(np.maximum(sizes - 2, 0).sum()))
    missing = np.flatnonzero((corners < 0) | (corners >= len(vertices)))
    if len(missing):
        wrong = missing[0]
        counting = "" if counts_from else ", counted from 0"
        text = f"a face names vertex {corners[wrong] + counts_from} of {len(vertices)}{counting}"
        raise P011.unreadable(text, places=_places(source, np.searchsorted(np.cumsum(sizes), [wrong], "right")))
    used = np.zeros(len(vertices), bool)
    used[corners] = True
    if unused := len(used) - int(np.count_nonzero(used)):
        findings.append(unreferenced(unused))
    finite = ~used
    finite[used] = (np.abs(vertices[used]) <= LARGEST).all(axis=1)
    if not finite.all():
        bad = np.unique(np.searchsorted(np.cumsum(sizes), np.flatnonzero(~finite[corners]), "right"))
        findings.append(faces_not_finite(len(bad), _places(source, bad)))
        return None
    faces, of, bent = _in_triangles(vertices, corners, sizes, deadline)
    if bent is not None and bent.any():
        folded = np.flatnonzero(bent)
        few = counted(len(folded), "face of four or more corners", "faces of four or more corners")
        text = f"{few} not in a plane: a corner lies up to {number(bent.max())} mm off"
        findings.append(F013.finding(text, len(folded), _places(source, folded)))
    points, index = weld_points(vertices[used])  # OBJ splits vertices along texture seams
    place = np.zeros(len(vertices), np.int32)
    place[used] = index
    return Mesh(points, place[faces], indexed=False, source=replace(source, polygons=of))


def _places(source: Source, polygons: Ints) -> Iterator[Location]:
    for i in polygons.tolist():
        yield Location(face=i, line=source.line(i), object=source.object(i))


def _in_triangles(
    vertices: Floats, corners: Ints, sizes: Ints, deadline: Deadline
) -> tuple[Ints, Ints | None, Floats | None]:
    """Return triangles (t, 3) in the polygons' order, the polygon of each (t,), how far each polygon is bent (p,) mm.

    If all are triangles, the second is None, since triangle and polygon are one, and so is the third.
    """
    if (sizes == 3).all():
        return corners.reshape(-1, 3), None, None
    bent = np.zeros(len(sizes), np.float32)
    counts = np.maximum(sizes - 2, 0)
    first, offsets = np.cumsum(sizes) - sizes, np.cumsum(counts) - counts
    triangles = np.empty((int(counts.sum()), 3), corners.dtype)
    for size in np.unique(sizes[sizes >= 3]).tolist():
        alike = np.flatnonzero(sizes == size)
        step = max(1, _CHUNK // size)
        for at in range(0, len(alike), step):
            deadline.tick()
            some = alike[at : at + step]
            ring = corners[first[some, None] + np.arange(size)]
            rows = offsets[some, None] + np.arange(size - 2)
            if size == 3:
                triangles[rows[:, 0]] = ring
                continue
            cut, off = _cut(vertices[ring], deadline)
            triangles[rows] = np.take_along_axis(ring, cut.reshape(len(ring), -1), axis=1).reshape(len(ring), -1, 3)
            bent[some] = off
    return triangles, np.repeat(np.arange(len(sizes)), counts), bent


def _cut(points: Floats, deadline: Deadline) -> tuple[Ints, Floats]:
    """Return triangles (k, n - 2, 3) of polygons (k, n, 3) as places in them, and how far each is bent.

    That is in mm, 0 if it is flat.
    """
    n = points.shape[1]
    with np.errstate(all="ignore"):
        local = points - points.mean(axis=1, keepdims=True)
        normal = np.cross(local, np.roll(local, -1, axis=1)).sum(axis=1)
        length = np.linalg.norm(normal, axis=1)
        size = np.linalg.norm(np.ptp(local, axis=1), axis=1)
        off = np.abs(np.einsum("kni,ki->kn", local, normal)).max(axis=1) / length
        rounding = 2 * np.spacing(np.abs(points).max(axis=(1, 2)).astype(np.float32))
        off = np.where((length > 0) & (off > np.maximum(FLAT * size, rounding)), off, 0.0)
        least = _PROPER * size * size * length
        fans = np.stack([np.zeros(n - 2, int), np.arange(1, n - 1), np.arange(2, n)], axis=1)
        cut = np.broadcast_to(fans, (len(points), n - 2, 3)).copy()
        left = np.flatnonzero(~_proper(local, normal, fans, least))
        if n == 4 and len(left):
            turned = (fans + 1) % 4
            good = _proper(local[left], normal[left], turned, least[left])
            cut[left[good]] = turned
            return cut, off
    for i in left.tolist() if n > 4 else ():
        deadline.tick()
        cut[i] = _concave(local[i], normal[i], fans)
    return cut, off


def _proper(local: Floats, normal: Floats, fans: Ints, least: Floats) -> Bools:
    """Return which polygons all triangles of a fan turn with, none of them without an area."""
    a, b, c = (local[:, fans[:, k]] for k in range(3))
    areas = np.einsum("kti,ki->kt", np.cross(b - a, c - a), normal)
    return np.asarray((areas > least[:, None]).all(axis=1))


def _concave(local: Floats, normal: Floats, fan: Ints) -> Ints:
    """Return triangles of one polygon by manifold3d; the fan if its corners are on a line or it crosses itself.

    A hole that is joined to the outline has points twice. More often than that a polygon runs over itself; with many
    corners that takes manifold3d minutes. Raises `Unreadable` (F011) if one of many corners crosses itself: all its
    triangles meet.
    """
    drop = int(np.argmax(np.abs(normal)))
    if not abs(normal[drop]) > 0:
        return fan
    flat = local[:, [(drop + 1) % 3, (drop + 2) % 3]] * [np.sign(normal[drop]), 1]
    many, cut = len(local) > _MOST_CROSSING, fan
    if not many or len(local) <= 2 * len(np.unique(local, axis=0)):
        triangles = np.asarray(triangulate([flat]))
        cut = triangles if triangles.shape == fan.shape else fan
    if many:
        one, other = (flat[cut[:, k]] - flat[cut[:, 0]] for k in (1, 2))
        areas = one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]
        if np.abs(areas).sum() > 1.5 * abs(areas.sum()):
            raise F011.unreadable(
                f"a face of {len(local)} corners crosses itself; one of more than {_MOST_CROSSING} is not judged"
            )
    return cut
