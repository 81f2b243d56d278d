"""Building a variant: what the asked-for outputs need, once, into one folder; what was left out is listed with why.

A build has two halves. `make` works out a `Product`: the files that are this variant's own as bytes, those that it
shares with others by their SHA-256 in a store. `build` puts a product in its place.
"""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from unitcad import __version__, files
from unitcad.cache import MemoryStore, MissingContent, Store, digest
from unitcad.designs import design_named
from unitcad.designs.design import Reason
from unitcad.errors import Refusal, UnitcadError, unknown_name
from unitcad.moulds.mould_set import MouldSet
from unitcad.pipeline import folder as folders
from unitcad.pipeline.geometry import findings_count, geometry, pictures
from unitcad.pipeline.stages import Say, Stages
from unitcad.pipeline.versions import code_version, kernel_versions
from unitcad.spec import Spec, to_toml, with_formats
from unitcad.spec.custom_code import is_custom
from unitcad.validation import warnings

OUTPUTS = ("unit", "moulds", "estimate", "casting")
OWN_DESIGN = "a design of one's own: tooling and estimate are known for the shipped designs only"
NO_MOULDS = "no moulds were asked for: of the mould checks only C200 looked at the unit"
TRIES = 5
"""How often a result is made when what it shares vanishes from the cache meanwhile."""
FORMATS = ("step", "stl", "3mf", "svg", "png", "glb")


@dataclass(frozen=True)
class Built:
    """Where a variant went, its manifest, and whether every law and check held."""

    folder: Path
    manifest: dict[str, Any]

    @property
    def ok(self) -> bool:
        """No law broken, no error found in a file."""
        return all(law["ok"] for law in self.manifest["laws"]) and self.manifest["check"]["errors"] == 0


@dataclass(frozen=True)
class Product:
    """A variant's files by their paths: `own` as bytes, `shared` as the SHA-256 of content in a store."""

    manifest: dict[str, Any]
    own: dict[str, bytes]
    shared: dict[str, str]

    def place(self, folder: Path, store: Store) -> None:
        """Write it into an empty folder. Raises OSError, or MissingContent where the store has lost something."""
        for parent in sorted({os.path.dirname(path) for path in (*self.own, *self.shared)}):
            (folder / parent).mkdir(parents=True, exist_ok=True)
        for path, sha256 in self.shared.items():
            store.place(sha256, folder / path)
        for path, content in self.own.items():
            files.write_new(folder / path, content)


def build(
    spec: Spec,
    out: Path = Path("out"),
    *,
    only: Sequence[str] = OUTPUTS,
    check: bool = True,
    say: Say = lambda message: None,
    store: Store | None = None,
) -> Built:
    """Build a spec's variant into `out`/<slug>-<hash12>.

    `only` is a choice of OUTPUTS; without `check` laws and mesh checks are left out. Formats and outputs that the
    folder has from before are made again beside the new ones. What others have made already comes out of `store`.
    Raises Refusal or UnitcadError before anything is written; a broken law or a bad file is no exception, see
    `Built.ok`.
    """
    only = checked_outputs(only)
    if out.exists() and not out.is_dir():
        raise UnitcadError(f"{out}: is a file, not a folder; choose another with -o")
    folder = out / folders.folder_name(spec)
    store = store or MemoryStore()
    folders.clear_leftovers(out)
    while True:
        earlier = folders.earlier(folder, spec)
        wanted = _with_formats(spec, (*earlier.formats, *spec.output.formats))
        outputs = checked_outputs((*only, *earlier.outputs))
        try:
            return build_into(
                folder, wanted, only=outputs, check=check or earlier.checked, store=store, say=say, earlier=earlier
            )
        except _Changed:  # another build has put a result there meanwhile: what it has is made too
            continue


class _Changed(Exception):
    """A folder that holds something else than it did when the work began."""


def build_into(
    folder: Path,
    spec: Spec,
    *,
    only: Sequence[str],
    check: bool,
    store: Store,
    say: Say = lambda message: None,
    earlier: folders.Earlier | None = None,
) -> Built:
    """Build into a folder, in place of what it holds; files of the old result that the new one lacks stay.

    Raises _Changed where the folder does not hold `earlier` any more.
    """
    for left in reversed(range(TRIES)):
        stages, before = Stages(say), Counter(store.counts)
        try:
            product = make(spec, only, check, store, stages)
            timings = {
                "code": code_version(),
                "seconds": {stage: round(seconds, 4) for stage, seconds in stages.seconds.items()},
                "store": dict(sorted((store.counts - before).items())),
            }
            with folders.replacing(folder) as fresh:
                if earlier is not None and folders.earlier(folder, spec) != earlier:
                    raise _Changed
                product.place(fresh, store)
                files.write_new(fresh / "timings.json", json_bytes(timings))
            return Built(folder, product.manifest)
        except MissingContent:  # somebody clears the cache away while we work
            if not left:
                raise
    raise AssertionError


def make(spec: Spec, only: Sequence[str], check: bool, store: Store, stages: Stages) -> Product:
    """Everything asked for of a spec, nothing written yet. Raises Refusal where the moulds can't be."""
    return _Making(MouldSet(spec), only, check, store, stages).all()


def checked_outputs(only: Sequence[str]) -> tuple[str, ...]:
    """`only` in the order of OUTPUTS. Raises Refusal for an unknown one, or none."""
    for name in only:
        if name not in OUTPUTS:
            raise unknown_name("--only", name, OUTPUTS)
    if not only:
        raise Refusal("--only", "", f"needs at least one of {', '.join(OUTPUTS)}", OUTPUTS[0])
    return tuple(name for name in OUTPUTS if name in only)


def possible_outputs(spec: Spec, only: Sequence[str]) -> tuple[str, ...]:
    """What of `only` there can be: a design of one's own is drawn, but nobody knows its tooling or its estimate.

    Raises Refusal where nothing is left.
    """
    found = tuple(name for name in only if name == "unit" or not is_custom(spec.design))
    if not found:
        raise Refusal(
            "--only", ",".join(only), f"{spec.design} is a custom design, of which only the unit is made", "unit"
        )
    return found


class _Making:
    """One variant, made into a product."""

    def __init__(self, moulds: MouldSet, only: Sequence[str], check: bool, store: Store, stages: Stages) -> None:
        self.moulds, self.check, self.store, self.stages = moulds, check, store, stages
        self.spec = moulds.spec
        self.asked, self.only = only, possible_outputs(moulds.spec, only)
        self.own: dict[str, bytes] = {}
        self.left_out: list[dict[str, str]] = []

    def all(self) -> Product:
        spec = self.spec
        shape = geometry(spec, self.only, self.check, self.store, self.stages)
        shared = {**shape["files"], **self._pictures()}
        self.own["spec.toml"] = to_toml(spec).encode()
        manifest: dict[str, Any] = {
            "name": spec.name,
            "design": spec.design,
            "printer": spec.moulds.printer,
            "hash": folders.folder_name(spec)[-12:],
            "outputs": list(self.only),
            "label": shape["label"],
            "warnings": warnings(spec),
            "air_ring_mm": shape["air_ring_mm"],
            "mesh": {
                "kernel": "manifold3d",
                "tolerance_mm": spec.output.tolerance_mm,
                "segments": self.moulds.segments,
                "note": "volume_mm3 and bbox_mm are the mesh's: its corners may stand out by the tolerance",
            },
            "parts": [self._part(part) for part in shape["parts"]],
            "steps": [self._step(step) for step in shape["steps"]],
            "laws": self._laws(shape),
            "estimate": self._estimate(),
            "check": findings_count(shape["check"]),
            "pictures": [path for path in shared if path.endswith(".png")],
            "casting": self._casting(shape),
            "left_out": self._left_out(),
            "versions": {"unitcad": __version__, **kernel_versions(spec.output.formats)},
        }
        manifest["files"] = self._files(shared)
        self.own["manifest.json"] = json_bytes(manifest)
        return Product(manifest, self.own, shared)

    def _files(self, shared: dict[str, str]) -> dict[str, dict[str, Any]]:
        """Bytes and SHA-256 of every file but the manifest itself, by path."""
        found = {path: {"bytes": len(content), "sha256": digest(content)} for path, content in self.own.items()}
        found |= {path: {"bytes": self.store.size(sha256), "sha256": sha256} for path, sha256 in shared.items()}
        return dict(sorted(found.items()))

    def _laws(self, shape: dict[str, Any]) -> list[dict[str, Any]]:
        """The geometry's laws and its strains against this variant's silicones, by code."""
        if not shape["strains"]:
            return shape["laws"]
        from unitcad.mould_checks import Strain, strain_findings

        strained = strain_findings(self.spec, [Strain(**strain) for strain in shape["strains"]])
        return sorted(shape["laws"] + [finding.as_dict() for finding in strained], key=lambda law: law["code"])

    def _estimate(self) -> dict[str, Any] | None:
        """estimate.json and its summary. The layered solver's part reads no silicone: the store shares it."""
        if "estimate" not in self.only:
            return None
        from unitcad.attenuation.curve import layered_block
        from unitcad.attenuation.edge.estimates import rounded, summary
        from unitcad.attenuation.inputs import Variant as Asked
        from unitcad.estimating import estimate_spec

        def shared(asked: Asked) -> dict[str, Any]:
            reads = (asked.tissue_name, asked.tissue, asked.frequency, asked.diameter, asked.motor_diameter)
            key = digest(repr((reads, code_version())).encode())
            return self.store.data(key, lambda: rounded(layered_block(asked)))

        with self.stages("estimate"):
            estimated = estimate_spec(self.spec, layered=shared)
        self.own["estimate.json"] = json_bytes(estimated)
        return summary(estimated)

    def _casting(self, shape: dict[str, Any]) -> list[str] | None:
        """The procedure's files; returns their names."""
        if "casting" not in self.only:
            return None
        from unitcad.casting.procedure import procedure
        from unitcad.casting.written import files

        with self.stages("casting"):
            volumes = [step["layer_volume_mm3"] for step in shape["steps"]]
            written = files(procedure(self.moulds, volumes))
        self.own.update({name: text.encode() for name, text in written.items()})
        return sorted(written)

    def _pictures(self) -> dict[str, str]:
        """The shaded pictures; where this machine can't draw, what it lacks is told and the drawing stays."""
        if "png" not in self.spec.output.formats:
            return {}
        from unitcad.export.picture import NoPicture

        try:
            with self.stages("pictures"):
                return pictures(self.spec, self.only, self.store)
        except NoPicture as error:
            self.left_out.append(_left("pictures", str(error)))
            return {}

    def _part(self, part: dict[str, Any]) -> dict[str, Any]:
        """A part of the geometry with this variant's material, after what it is made by."""
        step = part["step"] if part["made"] == "cast" else None
        material = self.spec.layers[step - 1].material if step else None
        found: dict[str, Any] = {}
        for key, value in part.items():
            found[key] = value
            if key == "made":
                found["material"] = material
        return found

    def _step(self, step: dict[str, Any]) -> dict[str, Any]:
        material = self.spec.layers[step["index"] - 1].material
        return {"index": step["index"], "layer": step["layer"], "material": material, **step}

    def _left_out(self) -> list[dict[str, str]]:
        spec, found = self.spec, list(self.left_out)
        if not self.check or "moulds" not in self.only:
            found.append(_left("laws", folders.UNCHECKED if not self.check else NO_MOULDS))
        if not self.check:
            found.append(_left("mesh checks", folders.UNCHECKED))
        found += [_left(what, why) for what, why in _not_needed(spec)]
        for name in OUTPUTS:
            if name not in self.only:
                found.append(_left(name, OWN_DESIGN if name in self.asked else "not asked for (--only)"))
        if "step" not in spec.output.formats:
            found.append(_left("boundary representation", "no STEP asked for"))
        return found


def _not_needed(spec: Spec) -> list[Reason]:
    """Name the tooling that this variant does without."""
    design = design_named(spec.design)
    if not design.tooling:
        return []
    reasons = [("second pour", "one layer: one pour")] if len(spec.layers) == 1 else []
    if not spec.fpcb and not spec.wires:
        reasons.append(("tongue and slot", "no FPCB"))
    return reasons + design.left_out(spec)


def _with_formats(spec: Spec, wanted: Sequence[str]) -> Spec:
    return with_formats(spec, tuple(form for form in FORMATS if form in wanted))


def _left(what: str, why: str) -> dict[str, str]:
    return {"what": what, "why": why}


_ENCODER = json.JSONEncoder(allow_nan=False, ensure_ascii=False)


def json_bytes(data: dict[str, Any]) -> bytes:
    """JSON with a line a key, and a line an entry of a list or table: legible, and ten times as fast as indented."""

    short = _ENCODER.encode
    lines = []
    for key, value in data.items():
        if isinstance(value, list) and value:
            text = "[\n  " + ",\n  ".join(map(short, value)) + "\n ]"
        elif isinstance(value, dict) and value:
            text = "{\n  " + ",\n  ".join(f"{short(k)}: {short(v)}" for k, v in value.items()) + "\n }"
        else:
            text = short(value)
        lines.append(f" {short(key)}: {text}")
    return ("{\n" + ",\n".join(lines) + "\n}\n").encode()
