"""A result: parts, files and findings. Results compose: an array's has those of its units, each below a folder."""

from __future__ import annotations

import os
import time
from collections import defaultdict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from unitcad import files
from unitcad.cache import Store
from unitcad.casting.procedure import Procedure
from unitcad.casting.procedure_text import files as written
from unitcad.checks.finding import FindingRecord
from unitcad.pipeline.manifest import (
    BodyFile,
    EstimateSummary,
    Manifest,
    MeshFinding,
    PartRecord,
    PourRecord,
    Skipped,
    printed_mm3,
)
from unitcad.pipeline.optional import UNMADE


@dataclass
class Progress:
    """`progress("meshes")` begins a stage, which ends the one before, and passes its name to `say`."""

    say: Callable[[str], object] = lambda stage: None
    seconds: defaultdict[str, float] = field(default_factory=lambda: defaultdict(float))
    stage: str = ""
    prefix: str = ""
    since: float = field(default_factory=time.perf_counter)

    def __call__(self, stage: str) -> None:
        now = time.perf_counter()
        if self.stage:
            self.seconds[self.stage] += now - self.since
        if stage and stage not in self.seconds:
            self.say(self.prefix + stage)
        self.stage, self.since = stage, now


@dataclass
class Result:
    """What a subject has made so far.

    `own` files are bytes by their path, `shared` ones the SHA-256 of content in a store. `label` is that of the moulds,
    `air_ring_mm` that of the unit. `compensation` and `blocks` are further keys of the manifest.
    """

    parts: list[PartRecord] = field(default_factory=list)
    steps: list[PourRecord] = field(default_factory=list)
    findings: list[FindingRecord] = field(default_factory=list)
    meshes: list[MeshFinding] = field(default_factory=list)
    own: dict[str, bytes] = field(default_factory=dict)
    shared: dict[str, str] = field(default_factory=dict)
    pictures: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    skipped: list[Skipped] = field(default_factory=list)
    label: str | None = None
    air_ring_mm: float = 0.0
    estimate: EstimateSummary | None = None
    compensation: dict[str, float] | None = None
    blocks: dict[str, Any] = field(default_factory=dict)

    def cast(self, procedure: Procedure) -> None:
        """Add the files of a casting procedure."""
        self.own |= {path: text.encode() for path, text in written(procedure).items()}

    def add(self, other: Result) -> None:
        """Take over the parts, files, findings, warnings and unmade files of another result."""
        self.parts += other.parts
        self.steps += other.steps
        self.findings += other.findings
        self.meshes += other.meshes
        self.own |= other.own
        self.shared |= other.shared
        self.pictures += other.pictures
        self.warnings += other.warnings
        self.skipped += other.skipped

    @property
    def volumes_mm3(self) -> list[float]:
        """The volume of one layer of each pour."""
        return [step["layer_volume_mm3"] for step in self.steps]

    @property
    def printed_mm3(self) -> float:
        """The volume of all printed tools."""
        return printed_mm3(self.parts)


@dataclass(frozen=True)
class Product:
    """A whole result, its files by their paths: `own` as bytes, `shared` as the SHA-256 of content in a store."""

    manifest: Manifest
    own: dict[str, bytes]
    shared: dict[str, str]

    def place(self, folder: Path, store: Store) -> None:
        """Write the result into an empty folder. Raises OSError, or MissingContent if the store lost a content."""
        inside = f"{folder}{os.sep}"  # names as text: a Path costs as much as the link
        for parent in sorted({os.path.dirname(path) for path in (*self.own, *self.shared)} - {""}):
            os.makedirs(inside + parent, exist_ok=True)
        for path, sha256 in self.shared.items():
            store.place(sha256, inside + path)
        for path, content in self.own.items():
            files.write_new(inside + path, content)

    def below(self, folder: str, said: Mapping[str, str]) -> Result:
        """Return the parts, files, findings and warnings as those of a result that has this one in a folder.

        `said`: sentences that are others there, since they name keys of its file.
        """
        manifest, parts = self.manifest, list[PartRecord]()
        for part in manifest["parts"]:
            of_body = {form: BodyFile(**{**f, "path": f"{folder}/{f['path']}"}) for form, f in part["files"].items()}
            parts.append({**part, "name": f"{folder}: {part['name']}", "files": of_body})
        return Result(
            parts=parts,
            findings=[
                FindingRecord(**{**f, "where": f"{folder}: {f['where']}", "advice": said.get(f["advice"], f["advice"])})
                for f in manifest["mould_checks"]
            ],
            meshes=[MeshFinding(**{**f, "path": f"{folder}/{f['path']}"}) for f in manifest["check"]["findings"]],
            own={f"{folder}/{path}": content for path, content in self.own.items()},
            shared={f"{folder}/{path}": sha256 for path, sha256 in self.shared.items()},
            warnings=[f"{folder}: {said.get(line, line)}" for line in manifest["warnings"]],
            skipped=[
                Skipped(output=f"{folder}/{each['output']}", reason=each["reason"])
                for each in manifest["skipped"]
                if each["reason"].startswith(UNMADE)
            ],
        )
