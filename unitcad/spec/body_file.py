"""A design that is a file of bodies: `design = "body.step"`, also .stp, .stl and .3mf. Lengths in mm.

The bodies' meshes become part of the resolved spec, as text: a line a body, with its name, vertices and faces. So a
result's spec.toml is complete, the result's hash covers them, and reading it again needs no B-rep library.
"""

from __future__ import annotations

import base64
import binascii
import re
from pathlib import Path

import numpy as np

from unitcad.errors import Refusal, Unfinished, UnitcadError
from unitcad.files import LARGEST, read
from unitcad.meshcheck import readers
from unitcad.meshcheck.file_checks import check_file
from unitcad.meshcheck.readers.read_3mf import read_build
from unitcad.meshcheck.readers.read_step import step_bodies
from unitcad.meshcheck.readers.threemf_package import open_package
from unitcad.meshcheck.rules import s_scale
from unitcad.meshcheck.rules.f_file import F011, Deadline, Limits, Unreadable
from unitcad.meshcheck.rules.inspection import Options
from unitcad.shape import Polyhedron
from unitcad.shape.profile import FACETS, GRID_PER_MM

MOST_FACES = 40_000
"""Most triangles of all bodies together, for which the moulds take about a minute."""
SAID = 3
"""Findings of a body's check that its refusal has."""
_HEAD = "unitcad bodies 1"
_NAME = re.compile(r"layer[1-9][0-9]?|motor|fpcb|[a-z][a-z0-9-]{0,31}")
_HALF = 0.5 + 1e-6
"""A coordinate midway between two of the grid goes up, however its last bits were rounded."""


def body_text(design: str, path: Path) -> str:
    """Return the text of a file's bodies.

    The bodies are checked as `unitcad check` does. Raises Refusal, with the finding's code, for a body with an error,
    or with a size that suggests another unit; and for a file that can't be read or has too many triangles. Raises
    Unfinished if the check lacks time or memory.
    """
    try:
        read(path, largest=LARGEST)
    except UnitcadError as error:
        raise Refusal("design", design, str(error)) from None
    # The solids of an assembly may share volume: the inner ones are cut out of a layer.
    report = check_file(path, Options(ignore=("G002",)) if _is_step(path) else Options())
    scale = s_scale.likely_unit(report.facts, None) if _is_step(path) else ()
    for finding in (*report.findings, *scale):
        if finding.code == F011.code:
            raise Unfinished(f"{path}: its check was not finished: {finding.message}")
    wrong = [each for each in (*report.findings, *scale) if each.severity == "error" or each.code == s_scale.S001.code]
    if wrong:
        said = "; ".join(f"{each.code}: {each.message}" for each in wrong[:SAID])
        said += f"; and {len(wrong) - SAID} more findings of `unitcad check`" if len(wrong) > SAID else ""
        open_ = any(each.code.startswith("T") for each in wrong)
        copy = f"; `unitcad check {design} --repair closed.stl` tries to make a closed copy" if open_ else ""
        raise Refusal("design", design, said + copy)
    try:
        bodies = _bodies(path)
    except Unfinished:
        raise
    except (UnitcadError, Unreadable) as error:
        raise Refusal("design", design, str(error)) from None
    count = sum(len(faces) for _, _, faces in bodies)
    if count > MOST_FACES:
        raise Refusal("design", design, f"has {count} triangles, {MOST_FACES} at most; make it coarser")
    names = [name for name, _, _ in bodies]
    if not ("layer1" in names and len(set(names)) == len(names) and all(map(_NAME.fullmatch, names))):
        names = [f"layer{i + 1}" for i in range(len(bodies))]
    lines = [f"{_HEAD}: {path.name}" + (f", facets within {FACETS:g} mm" if _is_step(path) else "")]
    for name, (_, vertices, faces) in zip(names, bodies, strict=True):
        solid = on_grid(design, name, vertices, faces)
        lines.append(" ".join((name, *(base64.b64encode(held).decode() for held in (solid.vertices, solid.faces)))))
    return "\n".join(lines) + "\n"


def bodies_in(design: str, text: str) -> dict[str, Polyhedron]:
    """Return the bodies in such a text by name. Raises UnitcadError for one that is damaged."""
    head, *lines = text.splitlines() or [""]
    try:
        if not head.startswith(_HEAD) or not lines:
            raise ValueError("it has no bodies")
        bodies = {}
        for line in lines:
            name, *held = line.split(" ")
            vertices, faces = (base64.b64decode(part, validate=True) for part in held)
            _check_closed(np.frombuffer(vertices, "<i4").reshape(-1, 3), np.frombuffer(faces, "<i4").reshape(-1, 3))
            bodies[name] = Polyhedron(vertices, faces)
    except (ValueError, binascii.Error) as error:
        raise UnitcadError(f"design {design}: design_source is damaged: {error}") from None
    return bodies


def _is_step(path: Path) -> bool:
    return readers.kind_of(path.name) == "step"


def _bodies(path: Path) -> list[tuple[str, np.ndarray, np.ndarray]]:
    """Return name, vertices (n, 3) in mm and faces (m, 3) of each body."""
    limits = Limits()
    deadline, data = Deadline(limits.seconds), memoryview(path.read_bytes())
    if _is_step(path):
        return step_bodies(path, FACETS, limits.seconds)
    if readers.kind_of(path.name) == "3mf":
        build = read_build(open_package(data, limits, deadline, strict=False), limits)
        instances = build.instances if build else []
        placed = [(one.object.attributes.get("name", ""), one.mesh(placed=True)) for one in instances]
        return [(name, mesh.vertices, mesh.faces) for name, mesh in placed]
    mesh = readers.reader_of("stl")(data, limits, deadline, [])
    return [("", mesh.vertices, mesh.faces)] if mesh else []


def on_grid(design: str, name: str, vertices: np.ndarray, faces: np.ndarray) -> Polyhedron:
    """Return a body with its corners on the grid, on which faces of moulds meet them; flattened faces are dropped."""
    cells = np.floor(vertices * GRID_PER_MM + _HALF).astype("<i4")
    cells, index = np.unique(cells, axis=0, return_inverse=True)
    faces = index.reshape(-1)[faces]
    faces = faces[(faces[:, 0] != faces[:, 1]) & (faces[:, 1] != faces[:, 2]) & (faces[:, 2] != faces[:, 0])]
    # The least corner first, then in order: the same body has the same text in whatever order a file has it.
    first = faces.argmin(axis=1)
    faces = np.take_along_axis(faces, (first[:, None] + np.arange(3)) % 3, axis=1)
    back = {tuple(face) for face in faces[:, [0, 2, 1]].tolist()}
    kept = sorted(tuple(face) for face in faces.tolist() if tuple(face) not in back)
    solid = np.array(kept, dtype="<i4").reshape(-1, 3)
    used, solid = np.unique(solid, return_inverse=True)
    solid = solid.reshape(-1, 3).astype("<i4")
    try:
        _check_closed(cells[used], solid)
    except ValueError as error:
        grid = f"with its corners on the grid of 1/{GRID_PER_MM} mm"
        raise Refusal("design", design, f"T001: {grid}, {name} {error}") from None
    return Polyhedron(np.ascontiguousarray(cells[used]).tobytes(), np.ascontiguousarray(solid).tobytes())


def _check_closed(vertices: np.ndarray, faces: np.ndarray) -> None:
    """Raise ValueError unless every edge has one face on either side, and the volume is positive."""
    if not len(faces) or faces.min() < 0 or faces.max() >= len(vertices):
        raise ValueError("has no faces, or faces without corners")
    edges = faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2).astype(np.int64)
    there, back = edges @ (len(vertices), 1), edges @ (1, len(vertices))
    if len(np.unique(there)) < len(there) or not np.array_equal(np.sort(there), np.sort(back)):
        raise ValueError("is not closed")
    a, b, c = (vertices[faces[:, k]].astype(float) for k in range(3))
    if float(np.einsum("ij,ij->", a, np.cross(b, c))) <= 0:
        raise ValueError("has its faces turned inwards")
