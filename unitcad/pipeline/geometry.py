"""What of a variant follows from its geometry alone: made once, whatever silicones it is cast in.

Everything here sees a spec whose materials, names and casting are blank (`geometric`), so that nothing can read
them unnoticed: what it makes serves every variant of that geometry. Each piece is kept in a store under a hash of
what it reads: a body's file by its tree, a verdict on a file by its bytes, the whole by the spec.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from unitcad.cache import Store, digest
from unitcad.moulds.mould_set import MouldSet, geometric
from unitcad.pipeline import parts
from unitcad.pipeline.stages import Stages
from unitcad.pipeline.versions import code_version, kernel_versions
from unitcad.spec import Spec, printer_of, to_json, with_formats

if TYPE_CHECKING:
    pass

GEOMETRIC = ("unit", "moulds", "casting")
"""The outputs that read the geometry; of the casting, the drawings of the assembled pours."""
NO_LAWS: dict[str, list[dict[str, Any]]] = {"laws": [], "strains": []}


def geometry_key(spec: Spec, only: Sequence[str], check: bool) -> str:
    """What `geometry` depends on; cheap, since no shape is drawn."""
    return _key(geometric(spec), tuple(name for name in only if name in GEOMETRIC), check)


def geometry(spec: Spec, only: Sequence[str], check: bool, store: Store, stages: Stages) -> dict[str, Any]:
    """Parts, steps, laws and mesh checks of a spec's geometry, and `files`: path -> SHA-256 of content in `store`."""
    only = tuple(name for name in only if name in GEOMETRIC)
    blank = geometric(spec)
    return store.data(
        _key(blank, only, check),
        lambda: _Making(MouldSet(blank), only, check, store, stages).all(),
        intact=lambda found: all(map(store.has, found["files"].values())),
    )


def pictures(spec: Spec, only: Sequence[str], store: Store) -> dict[str, str]:
    """The shaded pictures of a spec's geometry: path -> SHA-256 of content in `store`.

    Raises NoPicture where this machine can't draw; that is not remembered, so another try may succeed.
    """
    only = tuple(name for name in only if name in GEOMETRIC)
    blank = with_formats(geometric(spec), ("png",))
    key = _key(blank, "pictures", only)

    def drawn() -> dict[str, str]:
        from unitcad.export.picture import draw
        from unitcad.pipeline.scenes import pictures as scenes

        wanted = scenes(MouldSet(blank), only)
        images = draw(list(wanted.values()))
        return {
            path: store.file(digest(f"{key} {path}".encode()), lambda image=image: image)
            for path, image in zip(wanted, images, strict=True)
        }

    return store.data(key, drawn, intact=lambda found: all(map(store.has, found.values())))


class _Making:
    """One geometry, made into a store."""

    def __init__(self, moulds: MouldSet, only: Sequence[str], check: bool, store: Store, stages: Stages) -> None:
        self.moulds, self.only, self.check, self.store, self.stages = moulds, only, check, store, stages
        self.formats = moulds.spec.output.formats
        self.files: dict[str, str] = {}

    def all(self) -> dict[str, Any]:
        moulds, stages = self.moulds, self.stages
        with stages("plan"):
            groups = parts.groups(moulds, self.only)
        with stages("meshes"):
            records = [record for group in groups for record in self._meshes(group)]
        with stages("drawing"):
            self._section()
        if "step" in self.formats:
            with stages("step"):
                for group in groups:
                    self._step(group, records)
        tooling, pours = "moulds" in self.only, {"moulds", "casting"} & set(self.only)
        with stages("laws"):
            laws = self._laws(tooling) if self.check and (tooling or "unit" in self.only) else NO_LAWS
        with stages("check"):
            check = self._check(records) if self.check else []
        return {
            "label": moulds.plan.label if pours else None,
            "air_ring_mm": round(moulds.dimensions.air_ring, 9),
            "parts": records,
            "steps": self._steps() if pours else [],
            **laws,
            "check": check,
            "files": self.files,
        }

    def _meshes(self, group: parts.Group) -> list[dict[str, Any]]:
        records = []
        for body in group.bodies:
            key = parts.key(self.moulds, body, "record")
            record = self.store.data(key, lambda body=body: parts.record(self.moulds, body))
            records.append({**record, "files": {}})
            if "stl" in self.formats and parts.printed(body):
                path = f"{group.folder}/{parts.file_stem(body)}.stl"
                key = parts.key(self.moulds, body, "stl")
                entry = self._file(path, key, lambda body=body: parts.stl_content(self.moulds, body))
                records[-1]["files"]["stl"] = entry
        if "3mf" in self.formats:
            content = parts.threemf_key(self.moulds, group.bodies)
            entry = self._file(
                f"{group.together}.3mf", content, lambda: parts.threemf_content(self.moulds, group.bodies)
            )
            for record, body in zip(records, group.bodies, strict=True):
                if parts.printed(body):
                    record["files"]["3mf"] = entry
        if "glb" in self.formats:
            key = parts.glb_key(self.moulds, group.bodies)
            entry = self._file(f"{group.together}.glb", key, lambda: parts.glb_content(self.moulds, group.bodies))
            for record in records:
                record["files"]["glb"] = entry
        return records

    def _step(self, group: parts.Group, records: list[dict[str, Any]]) -> None:
        key = parts.step_key(self.moulds, group.bodies, group.name)
        entry = self._file(f"{group.together}.step", key, lambda: parts.step_content(group.bodies, group.name))
        names = {body.name for body in group.bodies}
        for record in records:
            if record["name"] in names:
                record["files"]["step"] = entry

    def _section(self) -> None:
        try:
            from unitcad.export import svg
        except ImportError:
            return
        if "unit" in self.only:
            v = self.moulds
            self._file(
                "section.svg",
                self._own_key("section"),
                lambda: svg.unit_section(v.unit, v.dimensions, v.segments).encode(),
            )
        if "casting" in self.only:
            from unitcad.casting.written import step_section

            for step in self.moulds.plan.steps:
                self._file(
                    f"step{step.index}-section.svg",
                    self._own_key(f"section of pour {step.index}"),
                    lambda step=step: step_section(self.moulds, step).encode(),
                )

    def _laws(self, tooling: bool) -> dict[str, list[dict[str, Any]]]:
        """Return the findings that read no silicone, and the strains that are still to be compared with a silicone's.

        Without `tooling` only the unit's own overlaps are looked for.
        """
        from unitcad.mould_checks import check_geometry, check_unit, strains

        def judged() -> dict[str, list[dict[str, Any]]]:
            if not tooling:
                return {**NO_LAWS, "laws": [finding.as_dict() for finding in check_unit(self.moulds)]}
            return {
                "laws": [finding.as_dict() for finding in check_geometry(self.moulds)],
                "strains": [asdict(strain) for strain in strains(self.moulds)],
            }

        return self.store.data(self._own_key("laws" if tooling else "unit's laws"), judged)

    def _check(self, records: list[dict[str, Any]]) -> list[dict[str, Any]]:
        """What the mesh rules find in every file: tools against the printer."""
        roles = {e["path"]: r["role"] for r in records for form, e in r["files"].items() if form in parts.MESH_FORMATS}
        return [{"path": path, **finding} for path, role in roles.items() for finding in self._check_file(path, role)]

    def _check_file(self, path: str, role: str) -> list[dict[str, Any]]:
        from unitcad.check import Options, check_bytes

        # A tool's STL is judged against the printer; its 3MF holds the same meshes.
        printer = printer_of(self.moulds.spec) if role == "tool" and path.endswith(".stl") else None

        def judged() -> list[dict[str, Any]]:
            content = self.store.content(self.files[path])
            found = check_bytes(content, Path(path).name, Options(printer=printer)).findings
            return [finding.as_dict() for finding in found if finding.severity != "info"]

        return self.store.data(digest(f"{self.files[path]} {printer!r} {code_version()}".encode()), judged)

    def _steps(self) -> list[dict[str, Any]]:
        """The pours: volume of the cavities as the tools leave them, and of one layer as the unit has it."""

        def measured() -> list[dict[str, Any]]:
            return [
                {
                    "index": step.index,
                    "layer": step.name,
                    "tools": list(step.tools),
                    "cavity_volume_mm3": float(f"{sum(cavity.volume() for _, cavity in cells):.9g}"),
                    "layer_volume_mm3": float(f"{self.moulds.solids[step.name].volume():.9g}"),
                }
                for step, cells in zip(self.moulds.plan.steps, self.moulds.cavities, strict=True)
            ]

        return self.store.data(self._own_key("steps"), measured)

    def _own_key(self, what: str) -> str:
        """The key of something that reads the whole geometry, but neither formats nor outputs."""
        return _key(with_formats(self.moulds.spec), what)

    def _file(self, path: str, key: str, make: Any) -> dict[str, str]:
        """One shared file: its content by `key` in the store, its place in the variant's folder by `path`."""
        sha256 = self.store.file(key, make)
        self.files[path] = sha256
        return {"path": path, "sha256": sha256}


def _key(spec: Spec, *more: object) -> str:
    epoch = os.environ.get("SOURCE_DATE_EPOCH") if "step" in spec.output.formats else None
    versions = sorted(kernel_versions(spec.output.formats).items())
    return digest(repr((to_json(spec), more, code_version(), versions, epoch)).encode())


def findings_count(findings: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Mesh findings with their number by severity."""
    count = Counter(finding["severity"] for finding in findings)
    return {"errors": count["error"], "warnings": count["warning"], "findings": list(findings)}
