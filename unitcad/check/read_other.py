"""OBJ, PLY and OFF through trimesh, without its repairs; only geometry rules follow. trimesh is loaded by the first."""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from typing import Any

import numpy as np

from unitcad.check import polygons, read_ply, text_mesh
from unitcad.check.findings import Finding, counted
from unitcad.check.limits import Deadline, Limits, Unreadable, over_limit
from unitcad.check.mesh import LARGEST, Mesh, weld_exact
from unitcad.check.rulebook import finding

_PLY_COUNT = re.compile(rb"element\s+(?:face|vertex)\s+(\d+)")
_OFF_COUNT = re.compile(rb"^\s*(?:[A-Z0-9]*OFF)?\s*(?:#[^\n]*\n|\s)*(\d+)\s+(\d+)", re.IGNORECASE)
Read = Callable[[memoryview, Limits, Deadline], tuple[list[Mesh], list[Finding]]]


def reader_for(kind: str) -> Read:
    """The reader of `obj`, `ply` or `off`."""

    def read(data: memoryview, limits: Limits, deadline: Deadline) -> tuple[list[Mesh], list[Finding]]:
        return _read(kind, bytes(data), limits, deadline)

    return read


def _read(kind: str, raw: bytes, limits: Limits, deadline: Deadline) -> tuple[list[Mesh], list[Finding]]:
    raw, findings = text_mesh.plain(kind, raw)
    findings += _looked_at(kind, raw, limits)
    deadline.tick()
    findings += text_mesh.look(kind, raw)
    deadline.tick()
    if kind == "ply":
        raw, trailing = read_ply.trimmed(raw, deadline)
        findings += trailing
    try:
        vertices, faces = _loaded(kind, polygons.in_triangles(kind, raw))
    except Unreadable as stop:
        raise Unreadable(*findings, *stop.findings) from stop
    deadline.tick()
    if vertices.ndim != 2 or vertices.shape[1] < 3 or faces.ndim != 2 or faces.shape[1] != 3:
        raise Unreadable(*findings, finding("F003", "vertices without three coordinates"))
    vertices = vertices[:, :3]
    if len(faces) > limits.max_faces:
        raise over_limit(f"{counted(len(faces), 'face')}, more than --max-faces {limits.max_faces}")
    if not len(faces):
        raise Unreadable(*findings, finding("F001", "the file has no face"))
    if faces.min() < 0 or faces.max() >= len(vertices):
        raise Unreadable(*findings, finding("P011", "a face names a vertex that is not there"))
    corners = vertices[faces]
    finite = (np.abs(corners) <= LARGEST).all(axis=(1, 2))
    if not finite.all():
        n = len(corners) - int(finite.sum())
        return [], [*findings, finding("V001", f"{counted(n, 'face')} with a vertex that is not finite", n)]
    points, triangles = weld_exact(corners)  # OBJ splits vertices along texture seams
    return [Mesh(points, triangles, indexed=False)], findings


def _looked_at(kind: str, raw: bytes, limits: Limits) -> list[Finding]:
    """What can be said before anything is parsed: counts that are too large, and the format's first word."""
    counts: list[int] = []
    if kind == "ply":
        if not raw.startswith(b"ply"):
            raise Unreadable(finding("F005", "named .ply, but does not begin with ply"))
        if b"end_header" not in raw[:100_000]:
            raise Unreadable(finding("F003", "the header has no end"))
        counts = [int(text[:18]) for text in _PLY_COUNT.findall(raw[:100_000])]
    elif kind == "off":
        if b"OFF" not in raw[:40].upper():
            raise Unreadable(finding("F005", "named .off, but does not begin with OFF"))
        match = _OFF_COUNT.match(raw)
        counts = [int(text[:18]) for text in match.groups()] if match else []
    elif not re.search(rb"(?m)^\s*(v|f|o|g|mtllib|usemtl|#)\s", raw):
        raise Unreadable(finding("F005", "named .obj, but has no line of one"))
    if any(count > 3 * limits.max_faces for count in counts):
        raise over_limit(f"{max(counts)} vertices or faces promised")
    if counts and max(counts) > len(raw):
        raise Unreadable(finding("F002", f"{max(counts)} vertices or faces promised in {len(raw)} bytes"))
    return []


def _loaded(kind: str, raw: bytes) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces by trimesh; whatever it raises on a malformed file is a finding."""
    import trimesh

    raw = text_mesh.without_comments(raw) if kind == "off" else raw
    try:
        options: dict[str, Any] = {"maintain_order": True, "skip_materials": True} if kind == "obj" else {}
        with np.errstate(all="ignore"):
            loaded = trimesh.load(io.BytesIO(raw), file_type=kind, process=False, **options)
        meshes = list(loaded.geometry.values()) if isinstance(loaded, trimesh.Scene) else [loaded]
        meshes = [mesh for mesh in meshes if getattr(mesh, "faces", None) is not None and len(mesh.faces)]
        if not meshes:
            return np.empty((0, 3)), np.empty((0, 3), np.int64)
        starts = np.cumsum([0] + [len(mesh.vertices) for mesh in meshes])
        vertices = np.concatenate([np.asarray(mesh.vertices, np.float64) for mesh in meshes])
        faces = np.concatenate([np.asarray(mesh.faces) + start for mesh, start in zip(meshes, starts, strict=False)])
        return vertices, faces
    except MemoryError:
        raise
    except Exception as error:
        raise Unreadable(text_mesh.explained(kind, raw)) from error
