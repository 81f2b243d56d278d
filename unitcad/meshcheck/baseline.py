"""Findings that are known and do not fail: a file that lists them by file, code and rounded place.

A finding is known if the baseline lists its code for the file with at least this count and severity, and each of its
places next to a listed one. Places are middles, so the order of vertices and faces does not matter. An error that ended
the check of a file is never known, nor is one about a manifest.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from unitcad import files
from unitcad.documents import parse_json
from unitcad.errors import UnitcadError
from unitcad.meshcheck.findings import MOST_COUNTED, SEVERITIES, Facts, FileReport, Finding, Location, Point
from unitcad.meshcheck.rules.f_file import F011

_LARGEST = 256_000_000  # bytes
_FORM = "unitcad-baseline"
_SIZE = 1e-3  # of the file's diagonal: places are rounded to the power of ten below
_SAMPLED = 10  # steps: places of printability are sampled, so those of two exports differ by more
_WORDS = {"info": "information", "warning": "a warning", "error": "an error"}
_NEIGHBOURS = tuple(product((-1, 0, 1), repeat=3))
Step = tuple[int, ...]


@dataclass(frozen=True)
class Known:
    """A known finding: its places in steps of `step` mm, and the names of those that have no point."""

    code: str
    severity: str
    count: int
    step: float = 1.0
    places: tuple[Step, ...] = ()
    names: tuple[str, ...] = ()


Baseline = Mapping[str, Sequence[Known]]
"""Known findings by file, each named by its path from the baseline's folder."""


def read(path: Path) -> Baseline:
    """Read a baseline. Raises UnitcadError if there is none."""
    content = files.read(path, largest=_LARGEST)
    try:
        data = parse_json(content, str(path), largest=_LARGEST)
        if data[_FORM] != 1:
            raise UnitcadError(f"{path}: a baseline of form {data[_FORM]!r}; this version reads form 1")
        return {str(name): [_known(entry) for entry in entries] for name, entries in data["files"].items()}
    except (ValueError, TypeError, KeyError, AttributeError):
        why = "not a baseline of `unitcad check`; remove it, and make it again with --write-baseline"
        raise UnitcadError(f"{path}: {why}") from None


def _known(entry: dict[str, Any]) -> Known:
    """Return an entry of a file. Raises ValueError, TypeError or KeyError for another form."""
    places = np.array(entry.get("places", []), float).reshape(-1, 3)
    step, names = float(entry.get("step", 1.0)), entry.get("names", [])
    if entry["severity"] not in SEVERITIES or not step > 0 or not all(isinstance(name, str) for name in names):
        raise ValueError
    return Known(str(entry["code"]), entry["severity"], int(entry["count"]), step, _steps(places, step), tuple(names))


def write(path: Path, reports: Sequence[FileReport]) -> Baseline:
    """Write the findings of the reports as known, and return them.

    Entries of a baseline at `path` for files that were not checked, or not to the end, stay as long as the file exists.
    Raises OSError, and UnitcadError if another file is at `path`.
    """
    before = read(path) if path.exists() else {}
    checked = {_key(path, one.path): of_report(one) for one in reports if not one.has(F011.code)}
    stay = {key: known for key, known in before.items() if os.path.exists(os.path.join(path.parent, key))}
    entries = {key: known for key, known in sorted({**stay, **checked}.items()) if known}
    lines = [
        f"  {json.dumps(key)}: [\n" + ",\n".join(f"   {json.dumps(_entry(one))}" for one in known) + "\n  ]"
        for key, known in entries.items()
    ]
    text = f'{{\n "{_FORM}": 1,\n "files": {{\n' + ",\n".join(lines) + "\n }\n}\n"
    files.write(path, text.encode())
    return entries


def _entry(known: Known) -> dict[str, Any]:
    """Return an entry as it is written: places in mm, empty lists left out."""
    digits = max(0, -math.floor(math.log10(known.step)))
    entry = asdict(known) | {"places": [[round(k * known.step, digits) for k in place] for place in known.places]}
    if not known.places:
        del entry["places"], entry["step"]
    if not known.names:
        del entry["names"]
    return entry


def of_report(report: FileReport) -> list[Known]:
    """Return the findings of a report as known ones."""
    known = []
    for item in report.findings:
        if _may_be(item):
            step = _step(report.facts, item)
            names = sorted({_name(place) for place in item.locations if place.centre is None})
            points = [place.centre for place in item.locations if place.centre is not None]
            places = tuple(sorted(set(_steps(points, step))))
            known.append(Known(item.code, item.severity, item.count, step, places, tuple(names)))
    return sorted(known, key=lambda one: one.code)


def apply(baseline: Baseline, path: Path, report: FileReport) -> FileReport:
    """Return the report with the findings of the baseline at `path` marked as known."""
    return mark(report, baseline.get(_key(path, report.path), []), "the baseline")


def mark(report: FileReport, known: Iterable[Known], whose: str) -> FileReport:
    """Return the report with its findings that are among the known ones marked; `whose` for the others' messages."""
    by_code = {one.code: one for one in known}
    return replace(report, findings=tuple(_marked(item, by_code.get(item.code), whose) for item in report.findings))


def _key(path: Path, file: str) -> str:
    """Return a file's name in the baseline at `path`."""
    return _printable(files.path_seen_from(file, path.parent))


def _printable(name: str) -> str:
    return name.encode("utf-8", "surrogateescape").decode("utf-8", "backslashreplace")


def _may_be(finding: Finding) -> bool:
    return not finding.ends and not finding.code.startswith("M")


def _name(place: Location) -> str:
    return _printable(" ".join(filter(None, (place.part, place.object))))


def _step(facts: Facts, finding: Finding) -> float:
    """Return the power of ten, mm, that places of a file are rounded to."""
    size = math.dist(*facts.bbox_mm) if facts.bbox_mm is not None else 0.0
    if not 0 < size < math.inf:
        return 1.0
    return 10.0 ** (math.floor(math.log10(size * _SIZE)) + (finding.code.startswith("D") and int(math.log10(_SAMPLED))))


def _steps(points: Sequence[Point] | np.ndarray, step: float) -> tuple[Step, ...]:
    rounded = np.rint(np.array(points, float).reshape(-1, 3) / step)
    if not np.isfinite(rounded).all():
        raise ValueError
    return tuple(tuple(int(k) for k in place) for place in rounded.tolist())


def _marked(finding: Finding, known: Known | None, whose: str) -> Finding:
    """Return the finding as known, or with its new places in front."""
    if known is None or not _may_be(finding):
        return finding
    fresh = list(_fresh(finding.locations, known))
    worse = SEVERITIES.index(finding.severity) > SEVERITIES.index(known.severity)
    more = bool(finding.locations) and finding.count > known.count
    if not worse and not more and not any(fresh):
        return replace(finding, known=True)
    order = sorted(range(len(fresh)), key=lambda k: not fresh[k])
    count = str(known.count) if known.count < MOST_COUNTED else f"{MOST_COUNTED:,} or more"
    message = f"{finding.message} ({_WORDS[known.severity] if worse else count} in {whose})"
    return replace(finding, message=message, locations=tuple(finding.locations[k] for k in order))


def _fresh(places: Sequence[Location], known: Known) -> Iterator[bool]:
    """Yield for each place whether the known finding has none next to it."""
    listed, names = set(known.places), set(known.names)
    for place in places:
        if place.centre is None:
            yield _name(place) not in names
        else:
            ((x, y, z),) = _steps([place.centre], known.step)
            yield not any((x + a, y + b, z + c) in listed for a, b, c in _NEIGHBOURS)
