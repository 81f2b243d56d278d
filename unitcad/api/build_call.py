"""`unitcad.build` and its result."""

# pyright: strict
from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from unitcad import text
from unitcad.api.changes import all_changes
from unitcad.api.variant import Variant
from unitcad.arguments import path, texts
from unitcad.pipeline.manifest import PAGE
from unitcad.pipeline.subjects import load_subject
from unitcad.pipeline.write import Built, hold_folder
from unitcad.pipeline.write import build as build_whole
from unitcad.report import write_report
from unitcad.report.page import view
from unitcad.spec import Spec
from unitcad.spec.raw import OUTPUTS, Format
from unitcad.validation import Changes, Source


class Buildable(Protocol):
    """An object that a room loaded, such as an array of units."""

    @property
    def name(self) -> str:
        """Its name."""
        ...

    @property
    def unit(self) -> Spec:
        """The spec of its unit, or of the first of several."""
        ...


@dataclass(frozen=True, repr=False)
class BuildResult(Built):
    """A built variant, or an array of units.

    Attributes
    ----------
    folder : Path
        Folder of the result.
    manifest : dict
        manifest.json as data: parts (mm, mm2, mm3), ``mould_checks``, mesh checks, ``skipped`` outputs and files.
    ok : bool
        Whether every check passed.
    spec : Spec
        Spec of the unit.
    lines : tuple of str
        Summary, as `unitcad build` prints it.
    volumes : dict of str to float
        Volume of each body's mesh, mm3, by name.

    Examples
    --------
    >>> import tempfile, unitcad
    >>> with tempfile.TemporaryDirectory() as out:
    ...     built = unitcad.build("single-embedded", out, formats="stl", only="unit")
    >>> [part["name"] for part in built.manifest["parts"]]
    ['layer1', 'motor', 'fpcb']
    """

    spec: Spec
    lines: tuple[str, ...] = ()

    @property
    def volumes(self) -> dict[str, float]:
        """The volume of each body's mesh by name, mm3."""
        return {part["name"]: part["volume_mm3"] for part in self.manifest["parts"]}

    def __repr__(self) -> str:
        folder = text.shorten(self.folder.name, 80)
        return f"BuildResult({folder}: {', '.join(f'{count} {noun}' for noun, count in self._counts)})"

    def _repr_html_(self) -> str:
        rows = [(part["name"], part["made"], part["material"], part["volume_mm3"]) for part in self.manifest["parts"]]
        bodies = text.table(("body", "made", "material", "volume, mm³"), rows, str(self.folder))
        broken = [
            (finding["code"], finding["where"], finding["value"], finding["limit"])
            for finding in self.manifest["mould_checks"]
            if not finding["ok"]
        ]
        checks = text.table(("mould check", "place", "value", "limit"), broken, "broken") if broken else ""
        drawn = text.drawing(Variant(self.spec).section(), f"section of {self.spec.name}") + view(self.spec)
        return drawn + bodies + checks + text.table((), self._counts)

    @property
    def _counts(self) -> list[tuple[str, int]]:
        """The numbers of bodies, files, broken mould checks and errors in meshes."""
        broken = sum(not finding["ok"] for finding in self.manifest["mould_checks"])
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
    fit: str | os.PathLike[str] | None = None,
    progress: Callable[[str], None] | None = None,
) -> BuildResult:
    """Build a unit and its moulds, or an array of units.

    Parameters
    ----------
    source : str, path, dict, Spec, Variant or Array
        Name of a template, path of a TOML file (with a path separator or ending in .toml), or a spec's data.
    set : dict or sequence of str, optional
        Changes by dotted path: ``{"layers.0.wall_mm": 1.2}`` or ``["layers.0.wall_mm=1.2"]``. Lengths in mm.
    out : path, default "out"
        Folder in which the result's folder is made.
    formats : str or sequence of str, optional
        Any of "stl", "3mf", "step", "svg", "png", "glb", "pdf". Default: those of the spec.
    only : str or sequence of str, optional
        Outputs: any of "unit", "moulds", "estimate", "casting". Default: all.
    check : bool, default True
        Run the mould checks and the mesh checks.
    report : bool, default False
        Write report.html, one offline page. An existing page is always updated.
    fit : path, optional
        A lab-fit.toml of `unitcad fit`. Default: the shipped models' constants.
    progress : callable, optional
        Called with the name of each step.

    Returns
    -------
    BuildResult
        The folder and its manifest. A failed check is no exception: see ``ok``.

    Raises
    ------
    Refusal, UnitcadError
        For an invalid spec or argument, before anything is written.

    Examples
    --------
    >>> import tempfile, unitcad
    >>> with tempfile.TemporaryDirectory() as out:
    ...     built = unitcad.build("single-embedded", out, formats="stl", only="unit")
    >>> built.ok, round(built.volumes["layer1"])
    (True, 181)
    """
    shown = nullcontext(progress or (lambda stage: None))
    (built,) = build_each(
        [source],
        out,
        set=set,
        formats=formats,
        only=only,
        check=check,
        report=report,
        fit=fit,
        shown=lambda name: shown,
    )
    return built


def build_each(
    sources: Sequence[Source | Buildable],
    out: str | os.PathLike[str] = "out",
    *,
    set: Changes = (),
    formats: Sequence[str] | str | None = None,
    only: Sequence[str] | str = OUTPUTS,
    check: bool = True,
    report: bool = False,
    fit: str | os.PathLike[str] | None = None,
    shown: Callable[[str], AbstractContextManager[Callable[[str], object]]],
    warn: Callable[[str], None] = lambda line: None,
) -> list[BuildResult]:
    """Build several specs or arrays as `build` does; every one is validated before the first one is built.

    `shown` opens the display of a build's steps by its name; `warn` takes a line for each damaged file of a page.
    """
    into, outputs = Path(path("out", out)), texts("only", only)
    changes = all_changes(set, formats=formats, fit=fit)
    wanted = [load_subject(source, changes, outputs) for source in sources]
    results: list[BuildResult] = []
    for subject in wanted:
        with shown(subject.name) as say:
            built = build_whole(subject, into, only=outputs, check=check, say=say)
            if report or (built.folder / PAGE).is_file():  # an older page would show the result before this one
                say("page")
                with hold_folder(built.folder):
                    write_report(built.folder, warn)
        lines = tuple(subject.summary(built.folder, built.manifest))
        results.append(BuildResult(built.folder, built.manifest, built.sha256, subject.unit, lines))
    return results
