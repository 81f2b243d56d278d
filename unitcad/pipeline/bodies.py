"""The bodies of a variant as files hold them: in groups, as printable meshes, with their record and key."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial
from pathlib import Path
from typing import TYPE_CHECKING

from unitcad.cache import digest
from unitcad.errors import UnitcadError
from unitcad.export import stl
from unitcad.export.printing import print_ready
from unitcad.kernels.mesh import arrays, bounds, realise
from unitcad.moulds import mould_set
from unitcad.moulds.mould_set import MouldSet
from unitcad.pipeline.manifest_records import PartRecord
from unitcad.pipeline.versions import code_version, kernel_versions
from unitcad.shape import Shape, content_hash
from unitcad.shape.body import Body, copies, part_names

if TYPE_CHECKING:
    import numpy as np

    from unitcad.arrays.patch import PatchPart
    from unitcad.export.glb import GlbPart
    from unitcad.pipeline.beside import Beside


@dataclass(frozen=True)
class BodyGroup:
    """Bodies that share a 3MF, a GLB and a STEP file (`together`), and the folder of their own files."""

    name: str  # unit | moulds
    bodies: tuple[Body, ...]
    together: str


def groups(moulds: MouldSet, only: Sequence[str]) -> list[BodyGroup]:
    """Return the groups of bodies that `only` asks for."""
    unit = [BodyGroup("unit", moulds.unit, "unit")] if "unit" in only else []
    return [*unit, BodyGroup("moulds", moulds.plan.pieces, "moulds/moulds")] if "moulds" in only else unit


def is_printed(body: Body) -> bool:
    """Tell whether a body has mesh files: what is cut from film or filament has none."""
    return body.role == "unit" or body.made == "printed"


def file_stem(body: Body) -> str:
    """Return a body's file name without suffix: cups begin with their step, so that a folder lists them in order."""
    return body.name.replace(f"cup{body.step}", f"step{body.step}-cup") if body.kind == "cup" else body.name


def body_key(moulds: MouldSet, body: Body, form: str) -> str:
    """Return what a body's file depends on: tree, name, colour, attitude, resolution, format, code and kernels."""
    return content_hash(
        body.shape, body.name, body.role, body.step, body.made, body.colour, body.upside_down, moulds.segments, form,
        code_version(), sorted(kernel_versions(()).items()),
    )  # fmt: skip


def joint_key(moulds: MouldSet, bodies: Sequence[Body], *more: object) -> str:
    """Return what a file of several bodies depends on."""
    return digest(repr(([body_key(moulds, body, "") for body in bodies], more)).encode())


def stl_content(moulds: MouldSet, body: Body) -> bytes:
    """Return a body's STL."""
    return stl.content(*_ready(moulds, body), body.name)


def threemf_content(moulds: MouldSet, bodies: Sequence[Body]) -> bytes:
    """Return the 3MF of several bodies, side by side on the spec's bed; copies share one mesh."""
    from unitcad.export import threemf

    bed = moulds.spec.moulds.bed_x_mm, moulds.spec.moulds.bed_y_mm
    alike = copies(bodies)
    parts = []
    for name, places in zip(part_names(bodies, alike), alike, strict=True):
        first, several = bodies[places[0]], tuple(bodies[i].name for i in places) if len(places) > 1 else ()
        parts.append(threemf.MeshPart(name, first.colour, *_ready(moulds, first), copies=several))
    return threemf.content(parts, bed)


def glb_content(moulds: MouldSet, bodies: Sequence[Body]) -> bytes:
    """Return the GLB of several bodies as assembled; what is cut or bought is in it too."""
    from unitcad.export import glb

    return glb.content([_glb_part(moulds, body) for body in bodies])


def patch_glb(moulds: MouldSet, parts: Sequence[PatchPart]) -> bytes:
    """Return the GLB of an array's whole patch: the mesh of each distinct body once, a node at each of its places."""
    from unitcad.export import glb

    return glb.content(
        [
            replace(
                _glb_part(moulds, part.body),
                name=part.name,
                places=[glb.Standing(f"{p.name}-{part.body.name}", p.x, p.y, p.angle_deg) for p in part.places],
            )
            for part in parts
        ]
    )


def _glb_part(moulds: MouldSet, body: Body) -> GlbPart:
    from unitcad.export import glb

    extras = {"role": body.role, "made": body.made, "step": body.step}
    return glb.GlbPart(body.name, body.colour, *arrays(moulds.mesh(body)), extras)


def step_content(bodies: Sequence[Body], name: str) -> bytes:
    """Return the STEP of an assembly. Raises UnitcadError without a B-rep extra."""
    try:
        from unitcad.export import step
    except ImportError as error:
        raise UnitcadError(f"STEP needs a B-rep kernel: {error}") from None
    with tempfile.TemporaryDirectory(prefix="unitcad-") as scratch:
        path = Path(scratch) / f"{name}.step"
        step.write(path, bodies, name)
        return path.read_bytes()


def step_asked(bodies: Sequence[Body], name: str, beside: Beside | None) -> Callable[[], bytes]:
    """Ask for the STEP of an assembly at once; return what gives it, made here where no process makes it."""
    here = partial(step_content, bodies, name)
    return beside.step(bodies, name, here) if beside else here


def record(moulds: MouldSet, body: Body) -> PartRecord:
    """Return a body's entry in the manifest, material and files left open."""
    solid = moulds.mesh(body)
    return PartRecord(
        name=body.name,
        role=body.role,
        step=body.step,
        made=body.made,
        material=None,
        volume_mm3=_round(solid.volume()),
        bbox_mm=[_round(v) for v in bounds(solid)],
        triangles=len(_ready(moulds, body)[1]) if is_printed(body) else int(solid.num_tri()),
        files={},
    )


def forget() -> None:
    """Drop plans, meshes and their roundings that are kept for the next call: what a measurement of times needs."""
    _rounded.cache_clear()
    mould_set.forget()


def _ready(moulds: MouldSet, body: Body) -> tuple[np.ndarray, np.ndarray]:
    """Return the mesh as it is written: its count of faces and both mesh formats come from one rounding."""
    return _rounded(body.shape, moulds.segments, body.upside_down)


@lru_cache(maxsize=64)
def _rounded(shape: Shape, segments: int, upside_down: bool) -> tuple[np.ndarray, np.ndarray]:
    return print_ready(*arrays(realise(shape, segments)), upside_down)


def _round(value: float) -> float:
    """Round to twelve significant digits: what a summation's order leaves does not reach the file."""
    return float(f"{value:.12g}") + 0.0
