"""OFF as Geomview defines it, text only: vertices with or without normals, colours and texture places, polygons."""

from __future__ import annotations

import re

import numpy as np

from unitcad.meshcheck.findings import Finding, counted
from unitcad.meshcheck.geometry.mesh import Mesh, Source
from unitcad.meshcheck.readers import rows
from unitcad.meshcheck.readers.rows import Polygons, Rows, check_promise, mesh_of
from unitcad.meshcheck.rules.f_file import F002, F003, F005, F006, Deadline, Limits

_START = re.compile(rb"(?:\s|#[^\n]*\n)*([A-Z0-9]*)OFF(?![A-Z])", re.IGNORECASE)
_KINDS = re.compile(rb"(?:ST)?C?N?", re.IGNORECASE)


def read_off(data: memoryview, limits: Limits, deadline: Deadline, findings: list[Finding]) -> Mesh | None:
    """Read an OFF file, as `readers.Reader` says."""
    raw = rows.plain(bytes(data), findings)
    start = _START.match(raw[:100_000])
    if start is None:
        raise F005.unreadable("named .off, but does not begin with OFF")
    kind = start.group(1).decode("ascii").upper()
    if not _KINDS.fullmatch(start.group(1)) or raw[start.end() : start.end() + 40].split()[:1] == [b"BINARY"]:
        what = f"{kind}OFF" if kind else "binary OFF"
        raise F003.unreadable(f"{what} cannot be read; OFF, COFF, NOFF, CNOFF and STOFF in text can")
    table = rows.all_rows(raw, start.end(), raw.count(b"\n", 0, start.end()) + 1, deadline, comments=True)
    return mesh_of(_polygons(table, len(raw), limits, findings), limits, deadline, findings)


def _polygons(table: Rows, size: int, limits: Limits, findings: list[Finding]) -> Polygons:
    sizes = table.sizes
    head = table.values[: sizes[0]] if len(table) else table.values
    if len(head) not in (2, 3) or (head != np.floor(head)).any() or not ((head >= 0) & (head < 2**53)).all():
        raise F003.unreadable("the counts of vertices, faces and edges are missing")
    n, m = int(head[0]), int(head[1])
    check_promise(max(n, m), size, limits)
    extra = len(table) - 1 - n - m
    if extra < 0:
        text = f"the header promises {counted(n + m, 'line')} of vertices and faces, not {len(table) - 1}"
        raise F002.unreadable(text, -extra)
    if extra:
        findings.append(F006.finding(f"{counted(extra, 'line')} after the last element", extra))
    points, faces = slice(1, n + 1), slice(n + 1, n + m + 1)
    begins, lines = table.starts[:-1][faces], table.lines[faces]
    numbers = rows.lengths(table.values[begins], sizes[faces] - 1, lines)
    corners = rows.integers(table.values[rows.spread(begins + 1, numbers)])
    return rows.columns(table, points, 3), corners, numbers, Source(lines=lines)
