"""What a variant writes, file by file: its path, the output and format that ask for it, what it reads, how it is made.

`shared` are the files that follow from the geometry alone; each is kept in a store under the hash of what it reads, so
that variants share it. `own` are the files that read the silicones, the name or the lab; they belong to one variant.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal

from unitcad.cache import Store, digest
from unitcad.moulds.mould_set import MouldSet
from unitcad.pipeline import bodies as body_files
from unitcad.pipeline.bodies import body_key, file_stem, groups, joint_key
from unitcad.pipeline.json_text import json_bytes
from unitcad.pipeline.versions import code_version, kernel_versions
from unitcad.spec import to_toml

Output = Literal["unit", "moulds", "estimate", "casting"]
OUTPUTS: tuple[Output, ...] = ("unit", "moulds", "estimate", "casting")
FORMATS = ("step", "stl", "3mf", "svg", "png", "glb")
GEOMETRIC: tuple[Output, ...] = ("unit", "moulds", "casting")
"""The outputs that read the geometry; of the casting, the drawings of the assembled pours."""
CASTING = ("bom.csv", "casting.json", "casting.md")
STAGES = ("meshes", "drawing", "step", "pictures")
"""In what order shared files are made."""


@dataclass(frozen=True)
class Artifact:
    """One file: its path in the variant's folder, the stage that makes it, the hash of what it reads, and how.

    `form` is the format that asks for it, "" where its output alone does. `bodies` are the names of what it holds. A
    variant's own file has no key. The key is worked out when it is called for: it hashes every shape in the file.
    """

    path: str
    form: str
    stage: str
    key: Callable[[], str]
    make: Callable[[], bytes]
    bodies: tuple[str, ...] = ()


def shared(moulds: MouldSet, only: Sequence[str], forms: Sequence[str]) -> list[Artifact]:
    """Return the files of a blank geometry that outputs `only` and formats `forms` ask for, in the order of STAGES."""
    table = [*_of_bodies(moulds, only), *_drawings(moulds, only), *(_pictures(moulds, only) if "png" in forms else ())]
    asked = (artifact for artifact in table if artifact.form in ("", *forms))
    return sorted(asked, key=lambda artifact: STAGES.index(artifact.stage))


def _of_bodies(moulds: MouldSet, only: Sequence[str]) -> Iterator[Artifact]:
    bed = moulds.spec.moulds.bed_x_mm, moulds.spec.moulds.bed_y_mm
    for group in groups(moulds, only):
        every, printed = group.bodies, group.printed
        for body in printed:
            yield Artifact(
                path=f"{group.name}/{file_stem(body)}.stl",
                form="stl",
                stage="meshes",
                key=lambda body=body: body_key(moulds, body, "stl"),
                make=lambda body=body: body_files.stl_content(moulds, body),
                bodies=(body.name,),
            )
        yield Artifact(
            path=f"{group.together}.3mf",
            form="3mf",
            stage="meshes",
            key=lambda every=every: joint_key(moulds, every, "3mf", *bed),
            make=lambda printed=printed: body_files.threemf_content(moulds, printed),
            bodies=tuple(body.name for body in printed),
        )
        yield Artifact(
            path=f"{group.together}.glb",
            form="glb",
            stage="meshes",
            key=lambda every=every: joint_key(moulds, every, "glb"),
            make=lambda every=every: body_files.glb_content(moulds, every),
            bodies=tuple(body.name for body in every),
        )
        yield Artifact(
            path=f"{group.together}.step",
            form="step",
            stage="step",
            key=lambda group=group: joint_key(moulds, group.bodies, "step", group.name, *_brep()),
            make=lambda group=group: body_files.step_content(group.bodies, group.name),
            bodies=tuple(body.name for body in every),
        )


def _drawings(moulds: MouldSet, only: Sequence[str]) -> Iterator[Artifact]:
    if "unit" in only:
        from unitcad.export import svg

        yield Artifact(
            path="section.svg",
            form="",
            stage="drawing",
            key=lambda: geometry_key(moulds, "section"),
            make=lambda: svg.unit_section(moulds.unit, moulds.dimensions, moulds.segments).encode(),
        )
    if "casting" in only:
        from unitcad.casting.written import step_section

        for step in moulds.plan.steps:
            yield Artifact(
                path=f"step{step.index}-section.svg",
                form="",
                stage="drawing",
                key=lambda step=step: geometry_key(moulds, f"section of pour {step.index}"),
                make=lambda step=step: step_section(moulds, step).encode(),
            )


def _pictures(moulds: MouldSet, only: Sequence[str]) -> Iterator[Artifact]:
    """Yield the shaded pictures: drawn all at once, when the first is asked for. Making raises NoPicture."""
    from unitcad.export.picture import draw
    from unitcad.pipeline.scenes import pictures

    scenes = pictures(moulds, only)
    drawn = cache(lambda: dict(zip(scenes, draw([scene() for scene in scenes.values()]), strict=True)))
    versions = sorted(kernel_versions(("png",)).items())
    for path in scenes:
        yield Artifact(
            path=path,
            form="png",
            stage="pictures",
            key=lambda path=path: geometry_key(moulds, path, *versions),
            make=lambda path=path: drawn()[path],
        )


def geometry_key(moulds: MouldSet, *more: object) -> str:
    """Return the key of something that reads the whole geometry and `more`, but neither formats nor outputs."""
    return digest(repr((moulds.geometry, more, code_version(), sorted(kernel_versions(()).items()))).encode())


def _brep() -> tuple[object, ...]:
    """What a STEP file depends on besides its bodies: its date and the kernels."""
    return os.environ.get("SOURCE_DATE_EPOCH"), sorted(kernel_versions(("step",)).items())


def own(moulds: MouldSet, only: Sequence[str], layer_volumes_mm3: Sequence[float], store: Store) -> Iterator[Artifact]:
    """Yield the variant's own files but for the manifest, which lists them all. `layer_volumes_mm3`: of one unit."""
    yield Artifact("spec.toml", "", "spec", _no_key, lambda: to_toml(moulds.spec).encode())
    if "estimate" in only:
        yield Artifact("estimate.json", "", "estimate", _no_key, lambda: json_bytes(estimated(moulds, store)))
    if "casting" in only:
        for path in CASTING:
            yield Artifact(path, "", "casting", _no_key, lambda path=path: _casting(moulds, layer_volumes_mm3)[path])


def _no_key() -> str:
    return ""


def estimated(moulds: MouldSet, store: Store) -> dict[str, Any]:
    """Return the estimate of a variant. The layered solver's part reads no silicone: the store shares it."""
    from unitcad.attenuation.curve import layered_block
    from unitcad.attenuation.edge.estimates import rounded
    from unitcad.attenuation.inputs import EstimateInput
    from unitcad.estimating import estimate_spec

    def layered(asked: EstimateInput) -> dict[str, Any]:
        reads = (asked.tissue_name, asked.tissue, asked.frequency, asked.diameter, asked.motor_diameter)
        key = digest(repr((reads, code_version())).encode())
        return store.data(key, lambda: rounded(layered_block(asked)))

    return moulds.once("estimate", lambda: estimate_spec(moulds.spec, layered=layered))


def _casting(moulds: MouldSet, layer_volumes_mm3: Sequence[float]) -> dict[str, bytes]:
    """Return the files of the casting procedure."""
    from unitcad.casting.procedure import procedure
    from unitcad.casting.written import files

    def written() -> dict[str, bytes]:
        return {path: text.encode() for path, text in files(procedure(moulds, layer_volumes_mm3)).items()}

    return moulds.once("casting", written)
