"""Findings that are known and do not fail: a file that lists them by file, code and place.

A finding is known if the baseline lists its code for the file with at least this count and severity, and each of its
places near a listed one. Places are middles of boxes, so the order of vertices and faces does not matter. An error that
ended the check of a file is never known, nor is one about a manifest.
"""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np

from unitcad import files
from unitcad.errors import UnitcadError, misfit
from unitcad.geometry.arrays import Bools, Floats
from unitcad.meshcheck.findings import SEVERITIES, Facts, FileReport, Finding, Location, Point, rounded
from unitcad.meshcheck.rules.f_file import F011
from unitcad.meshcheck.rules.registry import rules

NEAR = 1e-4
"""Known places lie within this part of the file's size."""
NEAR_PRINTING = 2e-2
"""The same for printability, whose places are sampled."""
_LARGEST = 256_000_000  # bytes


class Entry(msgspec.Struct, frozen=True, omit_defaults=True, forbid_unknown_fields=True):
    """A known finding: its places in mm, and the names of parts and objects of those that have no point."""

    code: str
    severity: str
    count: int
    places: list[Point] = []
    names: list[str] = []


class Baseline(msgspec.Struct, frozen=True, forbid_unknown_fields=True, rename="kebab"):
    """Known findings by file, each named by its path from the baseline's folder."""

    unitcad_baseline: int
    files: dict[str, list[Entry]]


EMPTY = Baseline(1, {})
_AGAIN = "remove it, and make it again with --write-baseline"


def read(path: Path) -> Baseline:
    """Read a baseline. Raises UnitcadError if there is none."""
    content = files.read(path, largest=_LARGEST)
    try:
        baseline = msgspec.json.decode(content, type=Baseline)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise UnitcadError(f"{path}: not a baseline of `unitcad check`: {misfit(error)}; {_AGAIN}") from None
    if baseline.unitcad_baseline != 1:
        raise UnitcadError(f"{path}: a baseline of form {baseline.unitcad_baseline}; this version reads form 1")
    return baseline


def write(path: Path, old: Baseline, reports: Sequence[FileReport]) -> Baseline:
    """Write the findings of the reports as known, and return them.

    Entries of `old` for files that were not checked, or not to the end, stay as long as the file exists.
    """
    checked = {
        _key(path, report.path): [_entry(item) for item in report.findings if _may_be(item)]
        for report in reports
        if not report.has(F011.code)
    }
    stay = {key: known for key, known in old.files.items() if os.path.exists(os.path.join(path.parent, key))}
    entries = {key: known for key, known in sorted((stay | checked).items()) if known}
    baseline = Baseline(1, entries)
    files.write(path, msgspec.json.format(msgspec.json.encode(baseline), indent=1) + b"\n")
    return baseline


def apply(baseline: Baseline, path: Path, report: FileReport) -> FileReport:
    """Return the report with the findings of the baseline at `path` marked as known."""
    return _mark_known(report, baseline.files.get(_key(path, report.path), []))


def compare(new: FileReport, old: FileReport) -> FileReport:
    """Return the new report with the findings that the old one has, too, marked as known."""
    return _mark_known(new, [_entry(item) for item in old.findings if _may_be(item)])


def _mark_known(report: FileReport, entries: Sequence[Entry]) -> FileReport:
    known = {entry.code: entry for entry in entries}
    findings = tuple(_compare(item, known.get(item.code), report.facts) for item in report.findings)
    return replace(report, findings=findings)


def _key(path: Path, file: str) -> str:
    """Return a file's name in the baseline at `path`."""
    return (
        files.path_seen_from(file, path.parent).encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")
    )


def _may_be(finding: Finding) -> bool:
    return not finding.ends and not finding.code.startswith("M")


def _entry(finding: Finding) -> Entry:
    places = sorted({rounded(place.centre) for place in finding.locations if place.centre is not None})
    names = sorted({_name(place) for place in finding.locations if place.centre is None})
    return Entry(finding.code, finding.severity, finding.count, places, names)


def _name(place: Location) -> str:
    name = " ".join(filter(None, (place.part, place.object)))
    return name.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")


def _compare(finding: Finding, entry: Entry | None, facts: Facts) -> Finding:
    """Return the finding as known, or with the places that are new in front."""
    if entry is None or not _may_be(finding):
        return finding
    new = _new(finding, entry, facts)
    known = SEVERITIES.index(entry.severity) if entry.severity in SEVERITIES else 0
    worse = SEVERITIES.index(finding.severity) > known
    if not worse and not new.any() and (finding.count <= entry.count or rules()[finding.code].count_is_size):
        return replace(finding, known=True)
    order = np.argsort(~new, kind="stable")
    message = finding.message if worse else f"{finding.message} ({entry.count} in the baseline)"
    return replace(finding, message=message, locations=tuple(finding.locations[i] for i in order))


def _new(finding: Finding, entry: Entry, facts: Facts) -> Bools:
    """Return which of the finding's locations the entry does not have."""
    places = finding.locations
    points = np.array([place.centre or (math.nan,) * 3 for place in places], float).reshape(-1, 3)
    named = np.isnan(points[:, 0])
    names = set(entry.names)
    new = np.array([named[i] and _name(place) not in names for i, place in enumerate(places)], bool)
    if not named.all():
        new[~named] = ~_near(points[~named], np.array(entry.places, float).reshape(-1, 3), finding.code, facts)
    return new


def _near(points: Floats, known: Floats, code: str, facts: Facts) -> Bools:
    """Return whether each point is near a known one."""
    if not len(known):
        return np.zeros(len(points), bool)
    from scipy.spatial import KDTree

    box = np.array(facts.bbox_mm if facts.bbox_mm is not None else [known.min(axis=0), known.max(axis=0)])
    size = float(np.linalg.norm(box[1] - box[0]))
    reach = (NEAR_PRINTING if code.startswith("D") else NEAR) * size + 1e-6 * float(np.abs(box).max())
    distance, _ = KDTree(known).query(points, distance_upper_bound=max(reach, 1e-9))
    return np.isfinite(distance)
