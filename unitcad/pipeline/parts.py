"""The files of bodies: one content per body and format, keyed by what it depends on and nothing else."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from unitcad.cache import digest
from unitcad.errors import UnitcadError
from unitcad.export import stl
from unitcad.export.printing import print_ready
from unitcad.kernels.mesh import arrays, bounds, realise
from unitcad.moulds import mould_set
from unitcad.pipeline.versions import code_version, kernel_versions
from unitcad.shape import Shape, content_hash
from unitcad.shape.body import Body

if TYPE_CHECKING:
    import numpy as np

    from unitcad.moulds.mould_set import MouldSet

MESH_FORMATS = ("stl", "3mf")


@dataclass(frozen=True)
class Group:
    """Bodies that share a 3MF and a STEP file, and the folder of their own files."""

    name: str  # unit | moulds
    bodies: tuple[Body, ...]
    folder: str
    together: str


def groups(moulds: MouldSet, only: Sequence[str]) -> list[Group]:
    """The groups of bodies that `only` asks for."""
    found = []
    if "unit" in only:
        found.append(Group("unit", moulds.unit, "unit", "unit"))
    if "moulds" in only:
        found.append(Group("moulds", moulds.plan.tools, "moulds", "moulds/moulds"))
    return found


def file_stem(body: Body) -> str:
    """A body's file name without suffix: cups begin with their step, so that a folder lists them in order."""
    return f"step{body.step}-cup" if body.kind == "cup" else body.name


def printed(body: Body) -> bool:
    """Whether a body has mesh files: what is cut from film or filament has none."""
    return body.role == "unit" or body.made == "printed"


def key(moulds: MouldSet, body: Body, form: str) -> str:
    """What a body's file depends on: tree, name, colour, attitude, resolution, format, version of code and kernels."""
    return content_hash(
        body.shape, body.name, body.role, body.step, body.made, body.colour, body.upside_down, moulds.segments, form,
        code_version(), sorted(kernel_versions(()).items()),
    )  # fmt: skip


def threemf_key(moulds: MouldSet, bodies: Sequence[Body]) -> str:
    """What the 3MF of several bodies depends on."""
    return _joint_key(moulds, bodies, "3mf", moulds.spec.moulds.bed_x_mm, moulds.spec.moulds.bed_y_mm)


def glb_key(moulds: MouldSet, bodies: Sequence[Body]) -> str:
    """What the GLB of several bodies depends on."""
    return _joint_key(moulds, bodies, "glb")


def step_key(moulds: MouldSet, bodies: Sequence[Body], name: str) -> str:
    """What the STEP of several bodies depends on, its date among it."""
    return _joint_key(
        moulds, bodies, "step", name, os.environ.get("SOURCE_DATE_EPOCH"), sorted(kernel_versions(("step",)).items())
    )


def _joint_key(moulds: MouldSet, bodies: Sequence[Body], *more: object) -> str:
    return digest(repr(([key(moulds, body, "") for body in bodies], more)).encode())


def stl_content(moulds: MouldSet, body: Body) -> bytes:
    """A body's STL."""
    return stl.content(*_ready(moulds, body), body.name)


def threemf_content(moulds: MouldSet, bodies: Sequence[Body]) -> bytes:
    """The 3MF of several bodies, side by side on the spec's bed."""
    from unitcad.export import threemf

    bed = moulds.spec.moulds.bed_x_mm, moulds.spec.moulds.bed_y_mm
    parts = [threemf.MeshPart(b.name, b.colour, *_ready(moulds, b)) for b in bodies if printed(b)]
    return threemf.content(parts, bed)


def glb_content(moulds: MouldSet, bodies: Sequence[Body]) -> bytes:
    """The GLB of several bodies as assembled; what is cut or bought is in it too."""
    from unitcad.export import glb

    return glb.content(
        [
            glb.GlbPart(b.name, b.colour, *arrays(moulds.mesh(b)), {"role": b.role, "made": b.made, "step": b.step})
            for b in bodies
        ]
    )


def step_content(bodies: Sequence[Body], name: str) -> bytes:
    """The STEP of an assembly. Raises UnitcadError without a B-rep extra."""
    try:
        from unitcad.export import step
    except ImportError as error:
        raise UnitcadError(f"STEP needs a B-rep kernel: pip install 'unitcad[build123d]' ({error})") from None
    with tempfile.TemporaryDirectory(prefix="unitcad-") as scratch:
        path = Path(scratch) / f"{name}.step"
        step.write(path, bodies, name)
        return path.read_bytes()


def record(moulds: MouldSet, body: Body) -> dict[str, Any]:
    """A body's entry in the manifest, without material and files."""
    solid = moulds.mesh(body)
    return {
        "name": body.name,
        "role": body.role,
        "step": body.step,
        "made": body.made,
        "volume_mm3": _round(solid.volume()),
        "bbox_mm": [_round(v) for v in bounds(solid)],
        "triangles": len(_ready(moulds, body)[1]) if printed(body) else int(solid.num_tri()),
    }


def _ready(moulds: MouldSet, body: Body) -> tuple[np.ndarray, np.ndarray]:
    """The mesh as it is written: its count of faces and both mesh formats come from one rounding."""
    return _rounded(body.shape, moulds.segments, body.upside_down)


@lru_cache(maxsize=64)
def _rounded(shape: Shape, segments: int, upside_down: bool) -> tuple[np.ndarray, np.ndarray]:
    return print_ready(*arrays(realise(shape, segments)), upside_down)


def forget() -> None:
    """Drop plans, meshes and their roundings that are kept for the next call: what a measurement of times needs."""
    _rounded.cache_clear()
    mould_set.forget()


def _round(value: float) -> float:
    """Twelve significant digits: what a summation's order leaves does not reach the file."""
    return float(f"{value:.12g}") + 0.0
