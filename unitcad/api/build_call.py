"""`unitcad.build` and what it returns."""

# pyright: strict
from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from unitcad import notebook
from unitcad.arguments import path, texts
from unitcad.pipeline.subjects import load_subject
from unitcad.pipeline.variant import Variant
from unitcad.pipeline.write import PAGE, Built, held
from unitcad.pipeline.write import build as build_whole
from unitcad.report import write_report
from unitcad.spec import Spec
from unitcad.spec.asked import OUTPUTS, Format
from unitcad.validation import Changes, Source


class Buildable(Protocol):
    """An object that a room loaded, such as an array of units."""

    @property
    def subject(self) -> str:
        """The class by which the pipeline builds it, as "module:name"."""
        ...


@dataclass(frozen=True, repr=False)
class BuildResult(Built):
    """A built variant, or several units together: its folder, its manifest and the unit's spec.

    `manifest` is manifest.json as data: parts, mould checks, mesh checks, what was left out; mm, mm2 and mm3.
    """

    spec: Spec

    @property
    def volumes(self) -> dict[str, float]:
        """The volume of each body's mesh by name, mm3."""
        return {part["name"]: part["volume_mm3"] for part in self.manifest["parts"]}

    def __repr__(self) -> str:
        folder = notebook.shortened(self.folder.name, 80)
        return f"BuildResult({folder}: {', '.join(f'{count} {what}' for what, count in self._counts)})"

    def _repr_html_(self) -> str:
        rows = [(part["name"], part["made"], part["material"], part["volume_mm3"]) for part in self.manifest["parts"]]
        bodies = notebook.table(("body", "made", "material", "volume, mm³"), rows, str(self.folder))
        broken = [
            (finding["code"], finding["where"], finding["value"], finding["limit"])
            for finding in self.manifest["laws"]
            if not finding["ok"]
        ]
        checks = notebook.table(("mould check", "place", "value", "limit"), broken, "broken") if broken else ""
        drawn = notebook.drawing(Variant(self.spec).section(), f"section of {self.spec.name}")
        return drawn + bodies + checks + notebook.table((), self._counts)

    @property
    def _counts(self) -> list[tuple[str, int]]:
        """The numbers of bodies, files, broken mould checks and errors in meshes."""
        broken = sum(not finding["ok"] for finding in self.manifest["laws"])
        return [
            ("bodies", len(self.manifest["parts"])),
            ("files", len(self.manifest["files"])),
            ("broken mould checks", broken),
            ("errors in meshes", self.manifest["check"]["errors"]),
        ]


def build(
    source: Source | Buildable,
    out: str | os.PathLike[str] = "out",
    *,
    set: Changes = (),
    formats: Sequence[Format] | Format | None = None,
    only: Sequence[str] | str = OUTPUTS,
    check: bool = True,
    report: bool = False,
    progress: Callable[[str], None] | None = None,
) -> BuildResult:
    """Build a unit and its moulds, or an array of units, into a folder below `out`, and return what was built.

    `source` and `set` are as for `unitcad.load`; `source` may also be the name, file or data of an array, or an array
    that `unitcad.arrays.load_array` returned. `formats` ("stl", "3mf", "step", "svg", "png",
    "glb") and `only` ("unit", "moulds", "estimate", "casting") choose what is made. Without `check` mould checks and
    mesh checks are left out. `report` writes report.html, one offline page. `progress` is called with the name of each
    step.
    `BuildResult.ok` tells whether every check passed; volumes and sizes of the result are in mm3 and mm.
    Raises Refusal or UnitcadError before anything is written.
    """
    into, say, outputs = Path(path("out", out)), progress or _silent, texts("only", only)
    wanted = load_subject(source, set, outputs)
    if formats is not None:
        wanted = load_subject(wanted.of, {"output.formats": texts("formats", formats)})
    built = build_whole(wanted.of, into, only=outputs, check=check, say=say)
    if report or (built.folder / PAGE).is_file():  # a page that is there would show the result before this one
        with held(built.folder):
            write_report(built.folder)
    return BuildResult(built.folder, built.manifest, built.sha256, wanted.unit)


def _silent(step: str) -> None:
    """Say nothing."""
