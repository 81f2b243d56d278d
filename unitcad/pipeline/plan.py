"""The plan of a result: every file, the outputs that include it, the key of its inputs, and the function that makes it.

Files that depend only on the geometry are shared by all variants of it, under a key. The others belong to one variant.
"""

from __future__ import annotations

import hashlib
import math
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, lru_cache, partial
from importlib.metadata import PackageNotFoundError, version
from importlib.resources import files
from pathlib import Path

import numpy as np

from unitcad import __version__
from unitcad.cache import digest
from unitcad.casting.plates import SPARE_TONGUE, plates
from unitcad.casting.preparation import print_description, slicer_settings
from unitcad.casting.procedure_text import step_section
from unitcad.casting.views import BenchPictures, picture_path
from unitcad.errors import UNIT_ALONE, Refusal, UnitcadError, WrongArgument, unknown_name
from unitcad.export import glb, printing, svg
from unitcad.export.printing import TooThin, print_ready, single_precision
from unitcad.kernels.mesh import arrays, realise
from unitcad.moulds import mould_set
from unitcad.moulds.mould_set import MouldSet
from unitcad.pipeline import step_helper
from unitcad.pipeline.scenes import GAP, pictures
from unitcad.shape import Shape, content_hash, moved
from unitcad.shape.extent import extent
from unitcad.shape.tree import Body, copies, part_names
from unitcad.spec import Spec
from unitcad.spec.custom_code import is_body_file, is_custom
from unitcad.spec.raw import OUTPUTS, Output

GEOMETRIC: tuple[Output, ...] = ("unit", "moulds", "casting")
"""The outputs that read the geometry; of the casting, the drawings of the assembled pours."""
KERNELS = {
    "": ("manifold3d", "numpy", "pillow"),
    "step": ("build123d", "cadquery", "cadquery-ocp", "cadquery-ocp-novtk"),
}


@dataclass(frozen=True)
class Planned:
    """A file of a result. `key` hashes all shapes in it, so it is called only for a file that is wanted."""

    path: str
    make: Callable[[], bytes]
    key: Callable[[], str]
    stage: str = "meshes"
    form: str = ""
    """The format that asks for it; "" if its output asks for it."""
    bodies: tuple[str, ...] = ()
    begin: Callable[[], Callable[[], bytes]] | None = None
    """Begins the work in a helper process; returns a function that waits for the content."""


@dataclass(frozen=True)
class BodyGroup:
    """Bodies that share a 3MF, a GLB and a STEP file (`together`), and the folder of their own files."""

    name: str  # unit | moulds
    bodies: tuple[Body, ...]
    together: str


def plan(moulds: MouldSet, only: Sequence[str], forms: Sequence[str]) -> list[Planned]:
    """Return the files of a geometry that outputs and formats ask for; STEP last, since a helper may make it."""
    table = [planned for planned in _files(moulds, only) if planned.form in ("", *forms)]
    return sorted(table, key=lambda planned: planned.form == "step")


def groups(moulds: MouldSet, only: Sequence[str]) -> list[BodyGroup]:
    """Return the groups of bodies that `only` asks for."""
    unit = [BodyGroup("unit", moulds.unit, "unit")] if "unit" in only else []
    return [*unit, BodyGroup("moulds", moulds.plan.pieces, "moulds/moulds")] if "moulds" in only else unit


def _files(moulds: MouldSet, only: Sequence[str]) -> Iterator[Planned]:
    bed = moulds.spec.moulds.bed_x_mm, moulds.spec.moulds.bed_y_mm
    for group in groups(moulds, only):
        every, together, names = group.bodies, group.together, tuple(body.name for body in group.bodies)
        printed = [body.in_file for body in every if is_printed(body)]
        for body in printed:
            path, key = f"{group.name}/{file_stem(body)}.stl", partial(body_key, moulds, body, "stl")
            yield Planned(path, partial(stl_content, moulds, body), key, form="stl", bodies=(body.name,))
        for path, plate in plates(moulds, printed, together).items():
            ours = group.name == "moulds"
            settings, said = (slicer_settings(moulds), print_description(moulds)) if ours else ({}, "")
            make = partial(threemf_content, moulds, plate, settings, said)
            key = partial(joint_key, moulds, plate, "3mf", *bed, settings, said)
            spared = next((body.name for body in plate if body.kind == "tongue"), "")
            names = tuple(spared if body.name == SPARE_TONGUE else body.name for body in plate)
            yield Planned(path, make, key, form="3mf", bodies=names)
        solids = [body.in_file for body in every]
        solids = side_by_side(solids) if group.name == "moulds" else solids
        make, key = partial(glb_content, moulds, solids), partial(joint_key, moulds, solids, "glb")
        yield Planned(f"{together}.glb", make, key, form="glb", bodies=names)
        yield step_file(f"{together}.step", moulds, solids, group.name)
    if "unit" in only:
        yield _plan(moulds, "section.svg", partial(unit_section, moulds), "section")
    if "casting" in only:
        for step in moulds.plan.steps:
            section = partial(step_section, moulds, step)
            yield _plan(moulds, f"step{step.index}-section.svg", section, f"section of pour {step.index}")
        bench = moulds.once("bench pictures", lambda: BenchPictures(moulds))
        for name in bench.names:
            path = picture_path(name)
            yield Planned(path, partial(bench.picture, name), partial(geometry_key, moulds, path), "step pictures")
    if "png" in moulds.spec.output.formats:
        for path, draw in pictures(moulds, only).items():
            yield Planned(path, draw, partial(geometry_key, moulds, path), "pictures", "png")


def _plan(moulds: MouldSet, path: str, draw: Callable[[], str], reads: str) -> Planned:
    return Planned(path, lambda: draw().encode(), partial(geometry_key, moulds, reads), "drawing")


def check_outputs(only: Sequence[str]) -> tuple[str, ...]:
    """Return `only` in the order of OUTPUTS. Raises Refusal for an unknown one, or none."""
    for name in only:
        if name not in OUTPUTS:
            raise unknown_name("only", name, OUTPUTS, WrongArgument)
    if not only:
        raise WrongArgument("only", "", f"needs at least one of {', '.join(OUTPUTS)}", OUTPUTS[0])
    return tuple(name for name in OUTPUTS if name in only)


# Inputs of a file:


def build_key(moulds: MouldSet, only: Sequence[str], check: bool) -> str:
    """Return the key of a geometry with its files and findings; cheap, since no shape is drawn."""
    formats, only = moulds.spec.output.formats, tuple(name for name in only if name in GEOMETRIC)
    epoch = os.environ.get("SOURCE_DATE_EPOCH") if "step" in formats else None
    versions = sorted(kernel_versions(formats).items())
    return digest(repr((moulds.geometry, formats, (only, check), code_version(), versions, epoch)).encode())


def geometry_key(moulds: MouldSet, *more: object) -> str:
    """Return the key of something that reads the whole geometry and `more`, but neither formats nor outputs."""
    return digest(repr((moulds.geometry, more, code_version(), sorted(kernel_versions(()).items()))).encode())


def body_key(moulds: MouldSet, body: Body, form: str) -> str:
    """Return the key of a body's file: tree, name, colour, attitude, resolution, format, code and kernels."""
    return content_hash(
        body.shape, body.file, body.name, body.role, body.step, body.made, body.colour, body.upside_down,
        moulds.segments, form, code_version(), sorted(kernel_versions(()).items()),
    )  # fmt: skip


def joint_key(moulds: MouldSet, bodies: Sequence[Body], *more: object) -> str:
    """Return the key of a file of several bodies."""
    return digest(repr(([body_key(moulds, body, "") for body in bodies], more)).encode())


@cache
def code_version() -> str:
    """Return the version and twelve digits over the package's own files, so that a changed line reuses nothing."""
    sha, root = hashlib.sha256(), str(files("unitcad"))
    # os.walk, which takes a third of the time of Path.rglob: every command that builds waits for it.
    named = {
        os.path.relpath(path, root).replace(os.sep, "/"): path
        for folder, _, names in os.walk(root)
        for name in names
        if name.endswith((".py", ".toml")) and (path := os.path.join(folder, name))
    }
    for name, path in sorted(named.items()):
        sha.update(f"{name}\n".encode() + Path(path).read_bytes())
    return f"{__version__}+{sha.hexdigest()[:12]}"


def kernel_versions(formats: Sequence[str]) -> dict[str, str]:
    """Return the versions of the installed kernels that make `formats`."""
    names = [name for form, kernels in KERNELS.items() if form in ("", *formats) for name in kernels]
    return {name: installed for name in names if (installed := _version(name))}


@cache
def _version(name: str) -> str | None:
    try:
        return version(name)
    except PackageNotFoundError:
        return None


# Contents of a file:


def is_printed(body: Body) -> bool:
    """Tell whether a body has mesh files: pieces cut from film or filament have none."""
    return body.role == "unit" or body.made == "printed"


def file_stem(body: Body) -> str:
    """Return a body's file name without suffix: cups begin with their step, so that a folder lists them in order."""
    return body.name.replace(f"cup{body.step}", f"step{body.step}-cup") if body.kind == "cup" else body.name


def ready(moulds: MouldSet, body: Body) -> tuple[np.ndarray, np.ndarray]:
    """Return the mesh as it is written: its count of faces and both mesh formats come from one rounding.

    A tool has its print attitude. A body of the unit has its place in the unit, so that files imported together fit.

    Raises Refusal, with the body's name, for a mesh that single precision can't represent.
    """
    try:
        return _ready(body.shape, moulds.segments, body.upside_down, body.role == "unit")
    except TooThin as error:
        raise _refusal(moulds.spec, f"{body.name}: {error}", tool=body.role == "tool") from None


def _refusal(spec: Spec, why: str, *, tool: bool = False) -> Refusal:
    """Return the refusal of a spec for a mesh that no file can hold; `tool`: unitcad made it round the body."""
    if is_custom(spec.design) and tool:
        do = "the mould has no thickness there; move or round the body's edge there by 0.05 mm or more"
        return Refusal("design", spec.design, f"{why}: {do}{UNIT_ALONE}")
    if is_custom(spec.design):
        do = "export the file again" if is_body_file(spec.design) else "draw them"
        return Refusal("design", spec.design, f"{why}; {do} so that parts overlap, or are 0.01 mm apart")
    tolerance = spec.output.tolerance_mm
    return Refusal("output.tolerance_mm", tolerance, f"{why}; other facets may do, of a larger or a smaller tolerance")


@lru_cache(maxsize=64)
def _ready(shape: Shape, segments: int, upside_down: bool, in_place: bool) -> tuple[np.ndarray, np.ndarray]:
    mesh = arrays(realise(shape, segments))
    return single_precision(*mesh) if in_place else print_ready(*mesh, upside_down)


def forget() -> None:
    """Drop plans, meshes and their roundings that are cached, for a measurement of times."""
    _ready.cache_clear()
    mould_set.forget()


def stl_content(moulds: MouldSet, body: Body) -> bytes:
    """Return a body's STL."""
    return printing.stl(*ready(moulds, body), body.name)


def threemf_content(
    moulds: MouldSet, bodies: Sequence[Body], settings: Mapping[str, str], description: str = ""
) -> bytes:
    """Return the 3MF of several bodies, side by side on the bed, with settings for the slicer; copies share a mesh.

    `description`: what a person reads of them in any program.
    """
    bed = moulds.spec.moulds.bed_x_mm, moulds.spec.moulds.bed_y_mm
    alike = copies(bodies)
    parts = []
    for name, places in zip(part_names(bodies, alike), alike, strict=True):
        first, several = bodies[places[0]], tuple(bodies[i].name for i in places) if len(places) > 1 else ()
        parts.append(printing.MeshPart(name, first.colour, *ready(moulds, first), copies=several))
    return printing.content(parts, bed, settings, description)


def glb_content(moulds: MouldSet, bodies: Sequence[Body]) -> bytes:
    """Return the GLB of several bodies as assembled; cut and bought pieces are in it too."""
    return joint_glb(moulds, [glb_part(moulds, body) for body in bodies])


def joint_glb(moulds: MouldSet, parts: Sequence[glb.GlbPart]) -> bytes:
    """Return the GLB of several parts. Raises Refusal for a part that is too thin to write."""
    try:
        return glb.content(parts)
    except TooThin as error:
        raise _refusal(moulds.spec, str(error)) from None


def glb_part(moulds: MouldSet, body: Body) -> glb.GlbPart:
    """Return a body as a part of a GLB file."""
    extras = {"role": body.role, "made": body.made, "step": body.step}
    return glb.GlbPart(body.name, body.colour, *arrays(moulds.mesh(body)), extras)


def unit_section(moulds: MouldSet) -> str:
    """Return the drawing of the unit cut along its tail, with dimensions in mm, as SVG."""
    concentric = moulds.design.tooling == "concentric"
    return svg.unit_section(moulds.unit, moulds.dimensions, moulds.segments, concentric=concentric)


def side_by_side(bodies: Sequence[Body]) -> list[Body]:
    """Return pieces of tooling in a row along x, in their order.

    The pieces of a cut tool are together, as are a pour's tongues and its filaments.

    As assembled, the cups of two pours would be in one place, and ribs press into the base.
    """
    groups: dict[str, list[Body]] = {}
    for body in bodies:
        several = body.kind in ("tongue", "filament")
        groups.setdefault(f"{body.kind}{body.step}" if several else body.name.partition("-")[0], []).append(body)
    placed, end = dict[str, Body](), -math.inf
    for group in groups.values():
        boxes = [extent(body.shape) for body in group]
        x = max(0.0, end + GAP - min(box[0] for box in boxes))
        end = x + max(box[3] for box in boxes)
        placed |= {body.name: replace(body, shape=moved(body.shape, x=x)) for body in group}
    return [placed[body.name] for body in bodies]


def step_file(path: str, moulds: MouldSet, bodies: Sequence[Body], name: str) -> Planned:
    """Plan the STEP of an assembly, which reads its date and the B-rep kernels too."""
    reads = "step", name, os.environ.get("SOURCE_DATE_EPOCH"), sorted(kernel_versions(("step",)).items())
    key, names = partial(joint_key, moulds, bodies, *reads), tuple(body.name for body in bodies)
    here = partial(step_content, tuple(bodies), name)
    return Planned(path, here, key, "step", "step", names, partial(step_helper.begin, tuple(bodies), name, here))


def begun(planned: Planned) -> Planned:
    """Return the same file; if a helper process can make it, that begins now."""
    return replace(planned, make=planned.begin()) if planned.begin else planned


def step_content(bodies: Sequence[Body], name: str) -> bytes:
    """Return the STEP of an assembly. Raises UnitcadError without a B-rep extra."""
    try:
        from unitcad.export import step
    except ImportError as error:
        raise UnitcadError(f"STEP needs a B-rep kernel: {error}") from None
    return step.content(bodies, name)
