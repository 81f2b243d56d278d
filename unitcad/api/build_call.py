"""`unitcad.build` and what it returns."""

# pyright: strict
from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from unitcad import notebook
from unitcad.arguments import path, texts
from unitcad.arrays.array import Array
from unitcad.arrays.array_file import load_array, with_formats
from unitcad.arrays.array_names import is_array
from unitcad.pipeline import Variant
from unitcad.pipeline.plan import OUTPUTS
from unitcad.pipeline.write import PAGE, Built, held
from unitcad.pipeline.write import build as build_whole
from unitcad.spec import Spec
from unitcad.spec.asked import Format
from unitcad.validation import Changes, Source, load


@dataclass(frozen=True, repr=False)
class BuildResult(Built):
    """A built variant or array: its folder, its manifest and its spec.

    `manifest` is manifest.json as data: parts, mould checks, mesh checks, what was left out; mm, mm2 and mm3. Of an
    array `spec` is its unit's, and `array` the whole; of a single unit `array` is None.
    """

    spec: Spec
    array: Array | None = None

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
        of = f"the unit of {self.array.name}" if self.array else self.spec.name
        drawn = notebook.drawing(Variant(self.spec).section(), f"section of {of}")
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
    source: Source | Array,
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

    `source` and `set` are as for `unitcad.load`, or as for `unitcad.load_array` where `source` is an array: its
    template's name, its file, data with the key `array`, or an `Array`. `formats` ("stl", "3mf", "step", "svg", "png",
    "glb") and `only` ("unit", "moulds", "estimate", "casting") choose what is made. Without `check` mould checks and
    mesh checks are left out. `report` writes report.html, one offline page. `progress` is called with the name of each
    step.
    `BuildResult.ok` tells whether every check passed; volumes and sizes of the result are in mm3 and mm.
    Raises Refusal or UnitcadError before anything is written.
    """
    into, say = Path(path("out", out)), progress or _silent
    named = isinstance(source, str | os.PathLike | Mapping | Array)
    array = load_array(source, set) if named and is_array(source) else None
    if array:
        if formats is not None:
            array = with_formats(array, texts("formats", formats))
        spec = array.unit
        built = build_whole(array, into, only=texts("only", only), check=check, say=say)
    else:
        assert not isinstance(source, Array)
        spec = load(source, set)
        if formats is not None:
            spec = load(spec, {"output.formats": texts("formats", formats)})
        built = build_whole(spec, into, only=texts("only", only), check=check, say=say)
    if report or (built.folder / PAGE).is_file():  # a page that is there would show the result before this one
        from unitcad.report import write_report

        with held(built.folder):
            write_report(built.folder)
    return BuildResult(built.folder, built.manifest, built.sha256, spec, array)


def _silent(step: str) -> None:
    """Say nothing."""
