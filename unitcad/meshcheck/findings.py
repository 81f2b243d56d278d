"""The results of a check as frozen data: a finding for each rule that is broken, facts of the file, its report."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Iterator
from contextvars import ContextVar
from dataclasses import dataclass, field, replace
from itertools import chain, islice
from typing import Any, SupportsFloat

from unitcad.geometry.boxes import Interrupted
from unitcad.meshcheck.geometry.mesh import Mesh
from unitcad.text import number

SHOWN = 5
"""Locations of a finding unless all are needed; its count says how many there are."""
MOST_COUNTED = 10_000
"""Places of a finding that are counted one by one, and kept for pictures and baselines."""
_KEPT: ContextVar[tuple[int, list[Mesh] | None]] = ContextVar("kept", default=(SHOWN, None))


def drawn_meshes() -> list[Mesh] | None:
    """Return the list that collects the meshes with a finding, None if findings are not drawn."""
    return _KEPT.get()[1]


def most_locations() -> int:
    """Return how many locations of a finding are kept."""
    return _KEPT.get()[0]


@contextlib.contextmanager
def keeping_places(most: int, meshes: list[Mesh] | None = None) -> Iterator[None]:
    """Keep so many locations of a finding, and collect meshes if there is a list, until the block ends."""
    before = _KEPT.set((most, meshes))
    try:
        yield
    finally:
        _KEPT.reset(before)


SEVERITIES = ("info", "warning", "error")
_MOST_CODES = 5
"""Codes that a report's repr lists."""


Point = tuple[float, float, float]


def rounded(xyz: Point) -> Point:
    """Return coordinates to nine digits, never -0."""
    return point(float(f"{value:.9g}") + 0.0 for value in xyz)


def point(values: Iterable[SupportsFloat]) -> Point:
    """Return three coordinates as plain numbers."""
    x, y, z = (float(value) for value in values)
    return x, y, z


@dataclass(frozen=True)
class Location:
    """Place: faces' indices (from 0, file order), a point in mm, a line (from 1), a part of the package, an object.

    A polygon is one face, however it is cut into triangles. `object` is an id of a 3MF, or a name of an OBJ.
    `faces` are all that are concerned, both of a crossing; `face` is the first of them. Either may be given alone.
    `line` is that of the first face if the format has lines, otherwise that of the fault. For pictures: `region`, its
    triangles in the mesh of number `mesh`, and `layer`, the layer that the finding spoils most.
    `centre`: the middle of the place, the same in whatever order the faces are, mm.
    """

    face: int | None = None
    xyz: Point | None = None
    line: int | None = None
    part: str | None = None
    object: str | None = None
    faces: tuple[int, ...] = ()
    region: Any = field(default=None, compare=False, repr=False)
    mesh: int | None = field(default=None, compare=False, repr=False)
    layer: Any = field(default=None, compare=False, repr=False)
    centre: Point | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        if self.faces and self.face is None:
            object.__setattr__(self, "face", self.faces[0])
        elif self.face is not None and not self.faces:
            object.__setattr__(self, "faces", (self.face,))

    def as_dict(self) -> dict[str, Any]:
        """Return it JSON-ready, without unknown values."""
        known: dict[str, Any] = {}
        if self.part is not None:
            known["part"] = self.part
        if self.object is not None:
            known["object"] = self.object
        if self.face is not None:
            known |= {"face": self.face, "faces": list(self.faces)}
        if self.xyz is not None:
            known["xyz"] = list(rounded(self.xyz))
        if self.line is not None:
            known["line"] = self.line
        return known

    def __str__(self) -> str:
        words = [self.part] if self.part else []
        if self.object and self.object != self.part:
            words.append(f"object {self.object!r}")
        if self.line is not None:
            words.append(f"line {self.line}")
        if len(self.faces) > 1:
            words.append(f"faces {', '.join(map(str, self.faces[:-1]))} and {self.faces[-1]}")
        elif self.face is not None:
            words.append(f"face {self.face}")
        if self.xyz is not None:
            words.append(f"({', '.join(number(v) for v in self.xyz)})")
        return " ".join(words)


@dataclass(frozen=True)
class Finding:
    """One rule that a file breaks: how often, up to MOST_COUNTED, and its first places.

    `ends`: it ended the check of the file, so that other rules were not run; no filter drops it. `known`: a baseline, or
    the old version, has it, and it does not fail.
    """

    code: str
    severity: str
    message: str
    count: int = 1
    locations: tuple[Location, ...] = ()
    ends: bool = False
    known: bool = False

    def as_dict(self) -> dict[str, Any]:
        """Return it JSON-ready."""
        return {
            "code": self.code,
            "severity": self.severity,
            "message": self.message,
            "count": self.count,
            "locations": [place.as_dict() for place in self.locations],
            "known": self.known,
        }


@dataclass(frozen=True)
class Facts:
    """Content of the file, in mm; None if it could not be read or has no meaning."""

    triangles: int | None = None
    vertices: int | None = None
    shells: int | None = None
    volume_mm3: float | None = None
    area_mm2: float | None = None
    bbox_mm: tuple[Point, Point] | None = None
    watertight: bool | None = None

    def as_dict(self) -> dict[str, Any]:
        """Return it JSON-ready; bbox_mm is [[x, y, z] low, [x, y, z] high]."""
        return vars(self) | {"bbox_mm": self.bbox_mm and [list(corner) for corner in self.bbox_mm]}


CHANGES = ("unchanged", "changed", "new", "gone")


@dataclass(frozen=True)
class Change:
    """Difference of a file from its old version: one of CHANGES; `unchanged` files have the same bytes.

    `old` are the facts of the old version, `gone` the findings that only it has. No point of one surface is farther than
    `distance_mm` from the other one, but for `error_mm`; None if one of them could not be read.
    """

    kind: str
    old: Facts = field(default_factory=Facts)
    gone: tuple[Finding, ...] = ()
    distance_mm: float | None = None
    error_mm: float | None = None

    def as_dict(self) -> dict[str, Any]:
        """Return it JSON-ready."""
        parts = {"old": self.old.as_dict(), "gone": [item.as_dict() for item in self.gone]}
        return {"change": self.kind, **parts, "distance_mm": self.distance_mm, "error_mm": self.error_mm}


@dataclass(frozen=True, repr=False)
class FileReport:
    """A file's findings, sorted by severity and code, and its facts.

    `meshes`: those that the locations number, if `Options.draw` is set. `seconds`: wall time of the check, if known.
    `change`: its difference from an old version, if there is one.
    """

    path: str
    findings: tuple[Finding, ...] = ()
    facts: Facts = field(default_factory=Facts)
    meshes: tuple[Mesh, ...] = field(default=(), compare=False, repr=False)
    seconds: float | None = field(default=None, compare=False)
    change: Change | None = None

    @property
    def verdict(self) -> str:
        """`error`, `warning` or `pass`: the worst finding, infos and known ones aside."""
        severities = {finding.severity for finding in self.findings if not finding.known}
        return "error" if "error" in severities else "warning" if "warning" in severities else "pass"

    def __repr__(self) -> str:
        codes = [f"{finding.code} x {finding.count}" for finding in self.findings]
        more = [f"{len(codes) - _MOST_CODES} more codes"] if len(codes) > _MOST_CODES else []
        return f"FileReport({self.path[-80:]!r}: {', '.join([self.verdict, *codes[:_MOST_CODES], *more])})"

    def has(self, code: str) -> bool:
        """Return whether a finding of that code is there."""
        return any(finding.code == code for finding in self.findings)

    def as_dict(self) -> dict[str, Any]:
        """Return it JSON-ready."""
        return {
            "path": self.path,
            "verdict": self.verdict,
            "findings": [finding.as_dict() for finding in self.findings],
            "facts": self.facts.as_dict(),
        } | ({} if self.change is None else self.change.as_dict())

    def shortened(self) -> FileReport:
        """Return the report with SHOWN locations a finding and without meshes."""
        findings = tuple(replace(item, locations=item.locations[:SHOWN]) for item in self.findings)
        change = self.change and replace(
            self.change, gone=tuple(replace(item, locations=item.locations[:SHOWN]) for item in self.change.gone)
        )
        return replace(self, findings=findings, meshes=(), change=change)


class Unreadable(Interrupted):
    """An end of the check before its last rule; no filter drops the errors among its findings.

    Earlier findings, and the facts known by then, are added on the way up (`f_limits.keeping`).
    """

    def __init__(self, *findings: Finding) -> None:
        self.findings = ending(findings)
        self.facts = Facts()
        super().__init__("; ".join(finding.message for finding in findings))


def ending(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Return the findings, the errors among them marked as the end of the check."""
    return tuple(replace(item, ends=True) if item.severity == "error" else item for item in findings)


def first_line(finding: Finding) -> int | None:
    """Return the first line of the file among a finding's places; those of a package's parts are not the file's."""
    return next((place.line for place in finding.locations if place.line is not None and place.part is None), None)


def with_places(finding: Finding, places: int) -> str:
    """Return the message, and in brackets its first `places` locations."""
    shown = ", ".join(text for place in finding.locations[:places] if (text := str(place)))
    return f"{finding.message}{f' (at {shown})' if shown else ''}"


def counted(n: int, one: str, many: str = "") -> str:
    """Write `1 shell`, `2 shells`; `many` if the plural takes more than an s."""
    return f"{n} {one if n == 1 else many or one + 's'}"


def tally(n: int, one: str, many: str = "") -> str:
    """Write `2 edges` as `counted` does, and `more than 10,000 edges` from there on."""
    return counted(n, one, many) if n <= MOST_COUNTED else f"more than {MOST_COUNTED:,} {many or one + 's'}"


def merge(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Merge to one finding a rule, the worst first.

    Counts are added, the first two messages and the first places are kept, the worst severity counts.
    """
    by_code: dict[str, list[Finding]] = {}
    for finding in findings:
        by_code.setdefault(finding.code, []).append(finding)
    merged = [_together(alike) for alike in by_code.values()]
    return tuple(sorted(merged, key=lambda finding: (-SEVERITIES.index(finding.severity), finding.code)))


def _together(alike: list[Finding]) -> Finding:
    count = sum(finding.count for finding in alike)
    message = "; and ".join(list(dict.fromkeys(finding.message for finding in alike))[:2])
    whole = count if count < MOST_COUNTED else f"{MOST_COUNTED:,} or more"
    return Finding(
        alike[0].code,
        max((finding.severity for finding in alike), key=SEVERITIES.index),
        f"{message} ({whole} in all)" if len(alike) > 1 else message,
        min(count, MOST_COUNTED),
        tuple(islice(chain.from_iterable(finding.locations for finding in alike), most_locations())),
        any(finding.ends for finding in alike),
    )
