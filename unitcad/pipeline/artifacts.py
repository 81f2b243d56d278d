"""What a variant writes, file by file: its path, the output and format that ask for it, what it reads, how it is made.

`shared` are the files that follow from the geometry alone; each is kept in a store under the hash of what it reads, so
that variants share it. `own` are the files that read the silicones, the name or the lab; they belong to one variant.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Hashable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property, partial
from typing import TYPE_CHECKING, Any, Literal

from unitcad.cache import Store, digest
from unitcad.casting.plates import plates
from unitcad.json_text import json_bytes
from unitcad.moulds.mould_set import MouldSet
from unitcad.pipeline.bodies import (
    body_key,
    file_stem,
    glb_content,
    groups,
    is_printed,
    joint_key,
    step_asked,
    step_content,
    stl_content,
    threemf_content,
)
from unitcad.pipeline.versions import code_version, kernel_versions
from unitcad.shape.body import Body
from unitcad.spec import Spec, to_toml
from unitcad.spec.asked import Format

if TYPE_CHECKING:
    from unitcad.casting.bench_pictures import BenchPictures
    from unitcad.pipeline.beside import Beside

Output = Literal["unit", "moulds", "estimate", "casting"]
OUTPUTS: tuple[Output, ...] = ("unit", "moulds", "estimate", "casting")
FORMATS: tuple[Format, ...] = ("step", "stl", "3mf", "svg", "png", "glb")
GEOMETRIC: tuple[Output, ...] = ("unit", "moulds", "casting")
"""The outputs that read the geometry; of the casting, the drawings of the assembled pours."""
CASTING = ("bom.csv", "casting.json", "casting.md")
PROCEDURE = "step pictures"
STAGES = ("meshes", "drawing", PROCEDURE, "step", "pictures")
"""In what order shared files are made."""


@dataclass(frozen=True)
class Artifact:
    """One file: its path in the variant's folder, the format that asks for it, the stage that makes it, and how.

    `form` is "" where the output alone asks for it. `key` gives the hash of what a shared file reads; it hashes every
    shape in the file, so it is called only for files that are wanted. `bodies` are the names of what the file holds.
    """

    path: str
    form: str
    stage: str
    make: Callable[[], bytes]
    key: Callable[[], str] = str
    bodies: tuple[str, ...] = ()


def shared(moulds: MouldSet, only: Sequence[str], forms: Sequence[str]) -> list[Artifact]:
    """Return the files of a blank geometry that outputs `only` and formats `forms` ask for, in the order of STAGES."""
    shaded = _pictures(moulds, only) if "png" in forms else ()
    table = [*_of_bodies(moulds, only), *_drawings(moulds, only), *shaded]
    asked = (artifact for artifact in table if artifact.form in ("", *forms))
    return sorted(asked, key=lambda artifact: STAGES.index(artifact.stage))


def begun(table: Sequence[Artifact], moulds: MouldSet, only: Sequence[str], beside: Beside) -> list[Artifact]:
    """Return the table, its STEP files and pictures of the procedure asked for at once, STEP first."""
    there = {one.path for one in table}
    made = {
        path: step_asked(group.bodies, group.name, beside)
        for group in groups(moulds, only)
        if (path := f"{group.together}.step") in there
    }
    if any(one.stage == PROCEDURE for one in table):
        from unitcad.casting.bench_views import picture_path

        bench = _bench(moulds)
        drawn = cache(beside.pictures(moulds, bench.names, bench.picture))
        made |= {picture_path(name): lambda name=name: drawn()[name] for name in bench.names}
    return [replace(one, make=made.get(one.path, one.make)) for one in table]


def _bench(moulds: MouldSet) -> BenchPictures:
    from unitcad.casting.bench_pictures import BenchPictures

    return moulds.once("bench pictures", lambda: BenchPictures(moulds))


def _of_bodies(moulds: MouldSet, only: Sequence[str]) -> Iterator[Artifact]:
    bed = moulds.spec.moulds.bed_x_mm, moulds.spec.moulds.bed_y_mm
    for group in groups(moulds, only):
        every, together = group.bodies, group.together
        names = tuple(body.name for body in every)
        printed = [body for body in every if is_printed(body)]
        for body in printed:
            path, key = f"{group.name}/{file_stem(body)}.stl", partial(body_key, moulds, body, "stl")
            yield Artifact(path, "stl", "meshes", partial(stl_content, moulds, body), key, (body.name,))
        for path, plate in plates(moulds, printed, together).items():
            threemf, key = partial(threemf_content, moulds, plate), partial(joint_key, moulds, plate, "3mf", *bed)
            yield Artifact(path, "3mf", "meshes", threemf, key, tuple(body.name for body in plate))
        glb, key = partial(glb_content, moulds, every), partial(joint_key, moulds, every, "glb")
        yield Artifact(f"{together}.glb", "glb", "meshes", glb, key, names)
        step, key = partial(step_content, every, group.name), partial(_step_key, moulds, every, group.name)
        yield Artifact(f"{together}.step", "step", "step", step, key, names)


def _drawings(moulds: MouldSet, only: Sequence[str]) -> Iterator[Artifact]:
    if "unit" in only:
        from unitcad.export import svg

        def drawn() -> bytes:
            concentric = moulds.design.tooling == "concentric"
            return svg.unit_section(moulds.unit, moulds.dimensions, moulds.segments, concentric=concentric).encode()

        yield Artifact("section.svg", "", "drawing", drawn, partial(geometry_key, moulds, "section"))
    if "casting" in only:
        from unitcad.casting.bench_views import picture_path
        from unitcad.casting.written import step_section

        for step in moulds.plan.steps:
            key = partial(geometry_key, moulds, f"section of pour {step.index}")
            drawing = partial(step_section, moulds, step)
            yield Artifact(f"step{step.index}-section.svg", "", "drawing", lambda draw=drawing: draw().encode(), key)
        bench = _bench(moulds)
        for name in bench.names:
            path = picture_path(name)
            yield Artifact(path, "", PROCEDURE, partial(bench.picture, name), partial(geometry_key, moulds, path))


def _pictures(moulds: MouldSet, only: Sequence[str]) -> Iterator[Artifact]:
    """Yield the shaded pictures: drawn all at once, when the first is asked for. Making raises NoPicture."""
    from unitcad.export.picture import draw
    from unitcad.pipeline.scenes import pictures

    scenes = pictures(moulds, only)
    drawn = cache(lambda: dict(zip(scenes, draw([scene() for scene in scenes.values()]), strict=True)))
    versions = sorted(kernel_versions(("png",)).items())
    for path in scenes:
        key = partial(geometry_key, moulds, path, *versions)
        yield Artifact(path, "png", "pictures", lambda path=path: drawn()[path], key)


def geometry_key(moulds: MouldSet, *more: object) -> str:
    """Return the key of something that reads the whole geometry and `more`, but neither formats nor outputs."""
    return digest(repr((moulds.geometry, more, code_version(), sorted(kernel_versions(()).items()))).encode())


def _step_key(moulds: MouldSet, bodies: Sequence[Body], name: str) -> str:
    """Return the key of a STEP file, which reads its date and the B-rep kernels too."""
    kernels = sorted(kernel_versions(("step",)).items())
    return joint_key(moulds, bodies, "step", name, os.environ.get("SOURCE_DATE_EPOCH"), kernels)


def own(
    moulds: MouldSet, only: Sequence[str], layer_volumes_mm3: Sequence[float], printed_mm3: float, store: Store
) -> Iterator[Artifact]:
    """Yield the variant's own files but for the manifest, which lists them all.

    `layer_volumes_mm3`: of one unit; `printed_mm3`: of all printed tools.
    """
    yield Artifact("spec.toml", "", "spec", lambda: to_toml(moulds.spec).encode())
    if "estimate" in only:
        yield Artifact("estimate.json", "", "estimate", lambda: _estimate(moulds, store).content)
    if "casting" in only:
        for path in CASTING:
            yield Artifact(
                path, "", "casting", lambda path=path: _casting(moulds, layer_volumes_mm3, printed_mm3)[path]
            )


def estimated(moulds: MouldSet, store: Store) -> dict[str, Any]:
    """Return the estimate of a variant. The layered solver's part reads no silicone: the store shares it."""
    return _estimate(moulds, store).data


def given(moulds: MouldSet, estimate: Callable[[], dict[str, Any]]) -> None:
    """Take the estimate of a variant from `estimate`."""
    moulds.once("estimate", lambda: MadeEstimate(estimate()))


@dataclass(frozen=True, eq=False)
class MadeEstimate:
    """An estimate, and its file."""

    data: dict[str, Any]

    @cached_property
    def content(self) -> bytes:
        return json_bytes(self.data)


_ESTIMATES: dict[Hashable, MadeEstimate] = {}
"""Estimates that this process made last, by what they read: variants that differ in casting alone share one."""
_KEPT = 64


def _estimate(moulds: MouldSet, store: Store) -> MadeEstimate:
    return moulds.once("estimate", lambda: _made_last(moulds.spec, store))


def _made_last(spec: Spec, store: Store) -> MadeEstimate:
    from unitcad.estimating import estimate_input

    reads = estimate_input(spec), spec.estimate
    if reads not in _ESTIMATES:
        while len(_ESTIMATES) >= _KEPT:
            del _ESTIMATES[next(iter(_ESTIMATES))]
        _ESTIMATES[reads] = MadeEstimate(_estimated(spec, store))
    return _ESTIMATES[reads]


def _estimated(spec: Spec, store: Store) -> dict[str, Any]:
    from unitcad.attenuation.edge.estimates import rounded_layered
    from unitcad.attenuation.inputs import EstimateInput
    from unitcad.estimating import estimate_spec

    def layered(asked: EstimateInput) -> dict[str, Any]:
        reads = (asked.tissue_name, asked.tissue, asked.frequency, asked.diameter, asked.motor_diameter, asked.drive)
        key = digest(repr((reads, code_version())).encode())
        return store.data(key, lambda: rounded_layered(asked))

    return estimate_spec(spec, layered=layered)


def _casting(moulds: MouldSet, layer_volumes_mm3: Sequence[float], printed_mm3: float) -> dict[str, bytes]:
    """Return the files of the casting procedure."""
    from unitcad.casting.procedure import procedure
    from unitcad.casting.written import files

    def written() -> dict[str, bytes]:
        return {path: text.encode() for path, text in files(procedure(moulds, layer_volumes_mm3, printed_mm3)).items()}

    return moulds.once("casting", written)
