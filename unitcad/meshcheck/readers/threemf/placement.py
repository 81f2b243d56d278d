"""Instances of a 3MF build: which object stands where, counted before anything is expanded."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from unitcad.geometry.arrays import Floats
from unitcad.meshcheck.findings import Finding
from unitcad.meshcheck.geometry.mesh import Mesh, Source
from unitcad.meshcheck.readers.threemf.model_data import LINE, Model, Object, Triangles, Use
from unitcad.meshcheck.rules.f_file import F011, Limits
from unitcad.meshcheck.rules.p_package import P009, P012, P014
from unitcad.meshcheck.rules.s_scale import UNITS_MM

Key = tuple[str, int]
"""A part of the package and the id of an object in it."""


@dataclass(frozen=True)
class Instance:
    """An object of the build with its mesh, its whole transform (4, 3) in the model's unit, and that unit in mm."""

    key: Key
    object: Object
    triangles: Triangles
    matrix: Floats
    unit_mm: float

    @property
    def linear(self) -> tuple[Key, bytes]:
        """What instances have in common that differ by a shift."""
        return self.key, self.matrix[:3].tobytes()

    @property
    def shift(self) -> Floats:
        """Where the object's origin lies, mm."""
        return self.matrix[3] * self.unit_mm

    def mesh(self, *, placed: bool) -> Mesh:
        """Return the object's mesh, mm: `placed` where the instance is, else where the object has it."""
        points, faces = self.triangles.vertices, self.triangles.rows[:, :3].astype(np.int32)
        if placed:
            with np.errstate(all="ignore"):  # what comes out too large is found where it is used
                points = points @ self.matrix[:3] + self.matrix[3]
            if np.linalg.det(self.matrix[:3]) < 0:
                faces = faces[:, ::-1]
        source = Source(lines=self.triangles.rows[:, LINE], part=self.key[0])
        return Mesh(points * self.unit_mm, np.ascontiguousarray(faces), name=str(self.object.id), source=source)


def expand(models: dict[str, Model], root: Model, limits: Limits, findings: list[Finding]) -> list[Instance]:
    """Return the meshes of the build with their transforms; faces are counted before anything is expanded."""
    sizes: dict[Key, tuple[int, int, int]] = {}
    objects = {
        (part, id_): model_object for part, model in models.items() for id_, model_object in model.objects().items()
    }

    def key_of(part: str, use: Use) -> Key:
        return (use.path.lower().lstrip("/") if use.path else part, use.object)

    def size(key: Key, trail: tuple[Key, ...]) -> tuple[int, int, int]:
        """Return faces, nodes and levels of an object and what is below it, within the limit of depth."""
        if key not in objects:
            return 0, 0, 0
        if key in trail:
            raise P012.unreadable(f"object {key[1]} contains itself")
        if key not in sizes and len(trail) < limits.max_depth:
            mesh, components = objects[key].mesh, objects[key].components
            below = [(0 if mesh is None else len(mesh.rows), 1, 0)]
            below += [size(key_of(key[0], use), (*trail, key)) for use in components]
            faces, nodes, levels = zip(*below, strict=True)
            sizes[key] = sum(faces), sum(nodes), 1 + max(levels)
        if key not in sizes or len(trail) + sizes[key][2] > limits.max_depth:
            raise P009.unreadable(f"components nest deeper than {limits.max_depth}")
        return sizes[key]

    total = nodes = 0
    for item in root.items:
        faces, below, _ = size(key_of(root.part, item), ())
        total, nodes = total + faces, nodes + below
    if total > limits.max_faces:
        text = f"{_large(total)} faces in {_large(nodes)} instances, more than --max-faces {limits.max_faces}"
        raise P009.unreadable(text)
    if nodes > limits.max_instances:
        raise F011.unreadable(f"{_large(nodes)} instances, more than the limit of {limits.max_instances}")
    instances: list[Instance] = []
    made: set[str] = set()

    def place(key: Key, matrix: Floats, severity: str | None = None) -> None:
        model_object = objects.get(key)
        if model_object is None:
            return
        if not model_object.components:
            made.add(model_object.type)
        if model_object.type == "other" and not model_object.components:
            findings.append(P012.finding(f"the build uses object {key[1]} of type other", severity=severity))
        elif model_object.mesh is not None:
            unit_mm = UNITS_MM.get(models[key[0]].unit, 1.0)
            instances.append(Instance(key, model_object, model_object.mesh, matrix, unit_mm))
        for use in model_object.components:
            place(key_of(key[0], use), _times(use.matrix, matrix), None if root.strict else "warning")

    for item in root.items:
        key = key_of(root.part, item)
        if item.path and key not in objects and key[0] in models:
            findings.append(P012.finding(f"a build item names object {key[1]} of {item.path}, which is not there"))
        place(key, item.matrix)
    if made and "model" not in made:
        types = ", ".join(sorted(made))
        findings.append(P014.finding(f"the build has no object of type model, only of type {types}"))
    return instances


def _large(n: int) -> str:
    """Return a count in digits that can be read: whole up to 1e15, else its power of ten."""
    return str(n) if n < 10**15 else f"more than 1e{math.floor(math.log10(n))}"


def _times(first: Floats, then: Floats) -> Floats:
    """Return the transform `first` followed by `then`, rows as 3MF writes them."""
    with np.errstate(all="ignore"):  # what comes out too large is found where it is used
        return np.vstack([first[:3] @ then[:3], first[3] @ then[:3] + then[3]])
