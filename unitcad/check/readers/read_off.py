"""OFF as Geomview defines it, text only: vertices with or without normals, colours and texture places, polygons."""

from __future__ import annotations

import re

import numpy as np

from unitcad.check.findings import Finding, counted
from unitcad.check.geometry.triangle_mesh import Mesh
from unitcad.check.readers import rows
from unitcad.check.readers.polygons import Polygons, mesh_of
from unitcad.check.readers.rows import Rows
from unitcad.check.resource_limits import Deadline, Limits, Unreadable, keeping, over_limit
from unitcad.check.rules.f_file import F002, F003, F005, F006

_START = re.compile(rb"(?:\s|#[^\n]*\n)*([A-Z0-9]*)OFF(?![A-Z])", re.IGNORECASE)
_KINDS = re.compile(rb"(?:ST)?C?N?", re.IGNORECASE)


def read_off(data: memoryview, limits: Limits, deadline: Deadline) -> tuple[list[Mesh], list[Finding]]:
    """Read the mesh of an OFF file's bytes and what the file itself breaks. Raises `Unreadable` where no mesh
    remains.
    """
    raw, findings = rows.plain(bytes(data))
    start = _START.match(raw[:100_000])
    if start is None:
        raise Unreadable(F005.finding("named .off, but does not begin with OFF"))
    kind = start.group(1).decode("ascii").upper()
    if not _KINDS.fullmatch(start.group(1)) or raw[start.end() : start.end() + 40].split()[:1] == [b"BINARY"]:
        what = f"{kind}OFF" if kind else "binary OFF"
        raise Unreadable(F003.finding(f"{what} cannot be read; OFF, COFF, NOFF, CNOFF and STOFF in text can"))
    with keeping(findings):
        table = rows.all_rows(raw, start.end(), raw.count(b"\n", 0, start.end()) + 1, deadline, comments=True)
        polygons, more = _polygons(table, len(raw), limits)
        findings += more
        meshes, more = mesh_of(polygons, limits, deadline)
    return meshes, findings + more


def _polygons(table: Rows, size: int, limits: Limits) -> tuple[Polygons, list[Finding]]:
    sizes = table.sizes
    head = table.values[: sizes[0]] if len(table) else table.values
    if len(head) not in (2, 3) or (head != np.floor(head)).any() or (head < 0).any():
        raise Unreadable(F003.finding("the counts of vertices, faces and edges are missing"))
    n, m = int(head[0]), int(head[1])
    if max(n, m) > 3 * limits.max_faces:
        raise over_limit(f"{max(n, m)} vertices or faces promised")
    if max(n, m) > size:
        raise Unreadable(F002.finding(f"{max(n, m)} vertices or faces promised in {size} bytes"))
    lines = len(table) - 1
    if lines < n + m:
        text = f"the header promises {counted(n + m, 'line')} of vertices and faces, not {lines}"
        raise Unreadable(F002.finding(text, n + m - lines))
    findings = []
    if lines > n + m:
        extra = lines - n - m
        findings.append(F006.finding(f"{counted(extra, 'line')} after the last element", extra))
    points, faces = slice(1, n + 1), slice(n + 1, n + m + 1)
    begins, lines = table.starts[:-1][faces], table.lines[faces]
    numbers = rows.lengths(table.values[begins], sizes[faces] - 1, lines)
    corners = rows.integers(table.values[rows.spread(begins + 1, numbers)])
    return Polygons(rows.columns(table, points, 3), corners, numbers, lines), findings
