"""OBJ as Wavefront's appendix B1 defines it: the polygons, with negative indices; continued lines are refused.

Texture and normals of faces, and all other statements, are skipped; materials cost nothing.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np

from unitcad.geometry.arrays import Floats, Ints
from unitcad.meshcheck.findings import Finding, Location
from unitcad.meshcheck.geometry.mesh import Mesh, Source
from unitcad.meshcheck.readers import rows
from unitcad.meshcheck.readers.rows import BLANK, NEWLINE, SLASH, SPACE, Polygons, mesh_of
from unitcad.meshcheck.rules.f_file import F003, F005, F011, Deadline, Limits
from unitcad.meshcheck.rules.p_package import P011

_ANY = re.compile(rb"(?m)^[ \t]*(?:v|f|o|g|mtllib|usemtl|#)\s")


@dataclass
class _Read:
    """State of the reader; `objects` and `groups` are (polygons before, name in a line) of o and g statements."""

    vertices: list[Floats] = field(default_factory=list)
    corners: list[Ints] = field(default_factory=list)
    sizes: list[Ints] = field(default_factory=list)
    lines: list[Ints] = field(default_factory=list)
    objects: list[tuple[Ints, bytes]] = field(default_factory=list)
    groups: list[tuple[Ints, bytes]] = field(default_factory=list)
    n_vertices: int = 0
    n_polygons: int = 0
    n_corners: int = 0


def read_obj(data: memoryview, limits: Limits, deadline: Deadline, findings: list[Finding]) -> Mesh | None:
    """Read an OBJ file, as `readers.Reader` says."""
    raw = rows.plain(bytes(data), findings)
    if not _ANY.search(raw):
        raise F005.unreadable("named .obj, but has no line of one")
    if (continued := raw.find(b"\\\n")) >= 0:
        place = [Location(line=raw.count(b"\n", 0, continued) + 1)]
        raise F003.unreadable("a line goes on in the next one, which cannot be read; export unwrapped lines", 1, place)
    state = _Read()
    for block, line in rows.blocks(raw, 0, deadline):
        _take(block, line, state)
        if max(state.n_vertices, state.n_corners) > 3 * limits.max_faces + 2:
            raise F011.unreadable(f"more faces or vertices than --max-faces {limits.max_faces} allows")
    return mesh_of(_polygons(state), limits, deadline, findings, counts_from=1)


def _polygons(state: _Read) -> Polygons:
    named = state.objects or state.groups
    empty = np.empty(0, np.int64)
    source = Source(
        lines=np.concatenate([empty, *state.lines]).astype(np.int32),
        starts=np.concatenate([empty, *(starts for starts, _ in named)]),
        names=b"".join(names for _, names in named),
    )
    vertices = np.concatenate([np.empty((0, 3)), *state.vertices])
    return vertices, np.concatenate([empty, *state.corners]), np.concatenate([empty, *state.sizes]), source


def _take(block: Ints, line: int, state: _Read) -> None:
    """Add a block's vertices, faces and names."""
    text = rows.without_comments(block)
    starts, ends = rows.words(text)
    counts = np.diff(ends, prepend=0)
    lines = np.flatnonzero(counts)
    keys = starts[ends[lines] - counts[lines]]
    letters = np.where(BLANK[text[keys + 1]], text[keys], 0)  # of statements that have one letter
    widths = np.diff(np.flatnonzero(block == NEWLINE), prepend=-1)

    def statements(letter: bytes) -> tuple[Ints, Ints]:
        """Return the lines of a statement, and the text with nothing but their arguments and the ends of lines."""
        ours = letters == ord(letter)
        chosen = np.zeros(len(counts), bool)
        chosen[lines[ours]] = True
        kept = np.repeat(chosen, widths)
        kept |= text == NEWLINE
        kept[keys[ours]] = False
        return lines[ours], np.where(kept, text, np.uint8(SPACE))

    points, arguments = statements(b"v")
    if len(points):
        numbers = rows.rows_of(arguments, line, which=points)
        state.vertices.append(rows.columns(numbers, slice(None), 3))
    faces, arguments = statements(b"f")
    for letter, names in ((b"o", state.objects), (b"g", state.groups)):
        ours = letters == ord(letter)
        if ours.any():
            named, begins = lines[ours], keys[ours] + 1
            places = rows.spread(begins, np.flatnonzero(block == NEWLINE)[named] + 1 - begins)
            names.append((state.n_polygons + np.searchsorted(faces, named), block[places].tobytes()))
    if len(faces):
        above = state.n_vertices + np.searchsorted(points, faces)
        _take_faces(arguments, line, faces, above, state)
    state.n_vertices += len(points)


def _take_faces(text: Ints, line: int, faces: Ints, above: Ints, state: _Read) -> None:
    """Add the faces on the lines `faces`; `above` is how many vertices stand before each."""
    behind = rows.between(text, SLASH, BLANK[text])
    behind[1:] &= ~BLANK[text[:-1]]  # a word that begins with a slash is no index
    refs = rows.rows_of(np.where(behind, np.uint8(SPACE), text), line, integers=True, which=faces)
    ids, sizes = refs.values, refs.sizes
    before = np.repeat(above, sizes)
    wrong = np.flatnonzero((ids == 0) | (ids < -before))
    if len(wrong):
        at = int(refs.lines[np.searchsorted(refs.starts, wrong[0], "right") - 1])
        index = ids[wrong[0]]
        why = f"vertex {index}, of {before[wrong[0]]} above it" if index else "vertex 0; OBJ counts from 1"
        raise P011.unreadable(f"a face names {why}", places=[Location(line=at)])
    state.corners.append(np.where(ids > 0, ids - 1, before + ids))
    state.sizes.append(sizes)
    state.lines.append(refs.lines)
    state.n_polygons += len(sizes)
    state.n_corners += len(ids)
