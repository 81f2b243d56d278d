"""Building a variant: what the asked-for outputs need, once, into one folder; what was left out is listed with why."""

from __future__ import annotations

import hashlib
import json
import time
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from unitcad import __version__
from unitcad.errors import Refusal, UnitcadError, unknown_name
from unitcad.pipeline import parts
from unitcad.pipeline.folder import earlier_formats, folder_name, replacing, restore
from unitcad.pipeline.variant import Variant
from unitcad.spec import Spec, printer_of, to_toml, warnings

OUTPUTS = ("unit", "moulds", "estimate", "casting")
FORMATS = ("step", "stl", "3mf", "svg", "png", "glb")

Say = Callable[[str], None]


@dataclass(frozen=True)
class Built:
    """Where a variant went, its manifest, and whether every law and check held."""

    folder: Path
    manifest: dict[str, Any]

    @property
    def ok(self) -> bool:
        """No law broken, no error found in a file."""
        return all(law["ok"] for law in self.manifest["laws"]) and self.manifest["check"]["errors"] == 0


def build(
    spec: Spec,
    out: Path = Path("out"),
    *,
    only: Sequence[str] = OUTPUTS,
    check: bool = True,
    say: Say = lambda message: None,
) -> Built:
    """Build a spec's variant into `out`/<slug>-<hash12>.

    `only` is a choice of OUTPUTS; without `check` laws and mesh checks are left out. Formats and outputs that the
    folder has from before are made again beside the new ones. Raises Refusal or UnitcadError before anything is
    written; a broken law or a bad file is no exception, see `Built.ok`.
    """
    for name in only:
        if name not in OUTPUTS:
            raise unknown_name("--only", name, OUTPUTS)
    if not only:
        raise Refusal("--only", "", f"needs at least one of {', '.join(OUTPUTS)}", OUTPUTS[0])
    folder = out / folder_name(spec)
    if out.exists() and not out.is_dir():
        raise UnitcadError(f"{out}: is a file, not a folder; choose another with -o")
    restore(folder)
    before = earlier_formats(folder, spec)
    wanted = (*before, *spec.output.formats)
    spec = spec.model_copy(
        update={"output": spec.output.model_copy(update={"formats": tuple(f for f in FORMATS if f in wanted)})}
    )
    only = [name for name in OUTPUTS if name in (*only, *_earlier_outputs(folder))]
    with replacing(folder) as fresh:
        manifest = _Run(Variant(spec), fresh, only, check, say).all()
    return Built(folder, manifest)


class _Run:
    """One build into one folder."""

    def __init__(self, variant: Variant, folder: Path, only: Sequence[str], check: bool, say: Say) -> None:
        self.variant, self.folder, self.only, self.check, self.say = variant, folder, only, check, say
        self.formats = variant.spec.output.formats
        self.left_out: list[dict[str, str]] = []
        self.seconds: dict[str, float] = {}

    def all(self) -> dict[str, Any]:
        """Every file in its place; returns the manifest."""
        variant = self.variant
        self._timed("plan", lambda: self._groups())
        groups = self._groups()
        _write(self.folder / "spec.toml", to_toml(variant.spec))
        records = self._timed("meshes", lambda: [r for g in groups for r in self._meshes(g)])
        self._timed("drawing", self._section)
        if "step" in self.formats:
            self._timed("step", lambda: [self._step(g, records) for g in groups])
        laws = self._timed("laws", self._laws)
        manifest: dict[str, Any] = {
            "name": variant.spec.name,
            "design": variant.spec.design,
            "hash": self.folder_hash(),
            "outputs": list(self.only),
            "label": variant.plan.label if "moulds" in self.only else None,
            "warnings": warnings(variant.spec),
            "air_ring_mm": round(variant.dimensions.air_ring, 9),
            "parts": records,
            "steps": self._steps() if "moulds" in self.only else [],
            "laws": laws,
            "check": self._timed("check", lambda: self._check(records)),
            "left_out": self._left_out(),
            "versions": self._versions(),
        }
        _write(self.folder / "manifest.json", _json(manifest))
        _write(self.folder / "timings.json", _json({"seconds": {k: round(v, 4) for k, v in self.seconds.items()}}))
        return manifest

    def folder_hash(self) -> str:
        """The twelve digits of the folder's name."""
        return folder_name(self.variant.spec)[-12:]

    def _groups(self) -> list[parts.Group]:
        return parts.groups(self.variant, self.only)

    def _timed(self, what: str, work: Callable[[], Any]) -> Any:
        self.say(what)
        start = time.perf_counter()
        result = work()
        self.seconds[what] = self.seconds.get(what, 0.0) + time.perf_counter() - start
        return result

    def _meshes(self, group: parts.Group) -> list[dict[str, Any]]:
        materials = [layer.material for layer in self.variant.spec.layers]
        records = []
        for body in group.bodies:
            cast = body.made == "cast" and body.step is not None
            record = parts.record(self.variant, body, materials[body.step - 1] if cast and body.step else None)
            if "stl" in self.formats and parts.printed(body):
                path = f"{group.folder}/{parts.file_stem(body)}.stl"
                record["files"]["stl"] = self._file(path, parts.stl_content(self.variant, body))
            records.append(record)
        if "3mf" in self.formats:
            path = f"{group.together}.3mf"
            entry = self._file(path, parts.threemf_content(self.variant, group.bodies))
            for record, body in zip(records, group.bodies, strict=True):
                if parts.printed(body):
                    record["files"]["3mf"] = entry
        return records

    def _step(self, group: parts.Group, records: list[dict[str, Any]]) -> None:
        path = f"{group.together}.step"
        (self.folder / path).parent.mkdir(parents=True, exist_ok=True)
        parts.step_file(self.folder / path, group.bodies, group.name)
        entry = {"path": path, "sha256": hashlib.sha256((self.folder / path).read_bytes()).hexdigest()}
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
            _write(self.folder / "section.svg", svg.unit_section(self.variant))

    def _laws(self) -> list[dict[str, Any]]:
        if not self.check or "moulds" not in self.only:
            self.left_out.append(_left("laws", "--no-check" if not self.check else "no moulds were asked for"))
            return []
        from unitcad.moulds import laws

        variant = self.variant
        solids = {body.name: variant.mesh(body) for body in (*variant.unit, *variant.plan.tools)}
        found = laws.judge(variant.spec, variant.unit, variant.plan, solids, variant.segments)
        return [{**asdict(finding), "value": float(f"{finding.value:.6g}")} for finding in found]

    def _check(self, records: list[dict[str, Any]]) -> dict[str, Any]:
        """The mesh rules over every file written, tools against the printer; what is found, errors counted."""
        from importlib.util import find_spec

        ready = find_spec("unitcad.check.printing") and find_spec("unitcad.check.threemf")  # TODO remove
        if not self.check or not ready:
            self.left_out.append(_left("mesh checks", "--no-check"))
            return {"errors": 0, "warnings": 0, "findings": []}
        from unitcad.check import Options, check_file

        printer = printer_of(self.variant.spec)
        roles = {e["path"]: r["role"] for r in records for form, e in r["files"].items() if form in parts.MESH_FORMATS}
        found = [
            {"path": path, **finding.as_dict()}
            for path, role in roles.items()
            # A tool's STL is judged against the printer; its 3MF holds the same meshes.
            for finding in check_file(
                self.folder / path, Options(printer=printer if role == "tool" and path.endswith(".stl") else None)
            ).findings
            if finding.severity != "info"
        ]
        count = Counter(finding["severity"] for finding in found)
        return {"errors": count["error"], "warnings": count["warning"], "findings": found}

    def _steps(self) -> list[dict[str, Any]]:
        variant = self.variant
        solids = {body.name: variant.mesh(body) for body in variant.unit}
        cells = len(variant.plan.layout.cells)
        return [
            {
                "index": step.index,
                "layer": step.name,
                "material": step.material,
                "tools": list(step.tools),
                "cavity_volume_mm3": float(f"{cells * solids[step.name].volume():.9g}"),
                "layer_volume_mm3": float(f"{solids[step.name].volume():.9g}"),
            }
            for step in variant.plan.steps
        ]

    def _left_out(self) -> list[dict[str, str]]:
        spec, found = self.variant.spec, list(self.left_out)
        if len(spec.layers) == 1:
            found.append(_left("second pour", "one layer: one pour"))
        if not spec.fpcb:
            found.append(_left("tongue and slot", "no FPCB"))
        elif spec.design == "embedded":
            found.append(_left("tongue and slot", "embedded: the circuit lies on the rings"))
        if spec.design == "embedded":
            found.append(_left("filament stub and hole", "embedded: open rings hold no suction"))
        for name in OUTPUTS:
            if name not in self.only:
                found.append(_left(name, "not asked for (--only)"))
        if "step" not in self.formats:
            found.append(_left("boundary representation", "no STEP asked for"))
        return found

    def _versions(self) -> dict[str, str]:
        from importlib.metadata import PackageNotFoundError, version

        names = ["manifold3d", "numpy"] + (["build123d", "cadquery-ocp-novtk"] if "step" in self.formats else [])
        found = {"unitcad": __version__}
        for name in names:
            try:
                found[name] = version(name)
            except PackageNotFoundError:
                continue
        return found

    def _file(self, path: str, content: bytes) -> dict[str, str]:
        target = self.folder / path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(content)
        return {"path": path, "sha256": hashlib.sha256(content).hexdigest()}


def _earlier_outputs(folder: Path) -> list[str]:
    try:
        return list(json.loads((folder / "manifest.json").read_text("utf-8"))["outputs"])
    except (OSError, ValueError, KeyError, TypeError):
        return []


def _left(what: str, why: str) -> dict[str, str]:
    return {"what": what, "why": why}


def _json(data: Any) -> str:
    return json.dumps(data, indent=1, allow_nan=False, ensure_ascii=False) + "\n"


def _write(path: Path, text: str) -> None:
    path.write_bytes(text.encode("utf-8"))
