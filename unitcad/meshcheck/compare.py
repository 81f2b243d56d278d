"""Two versions of a file, or of a folder of files: findings that are new or gone, and how far the surfaces are apart."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from unitcad import files
from unitcad.errors import Refusal
from unitcad.geometry.arrays import Floats
from unitcad.meshcheck import baseline
from unitcad.meshcheck.file_checks import expand, surface_of
from unitcad.meshcheck.findings import Change, FileReport
from unitcad.meshcheck.geometry.distance import largest_distance
from unitcad.meshcheck.rules.f_file import Deadline, Unreadable
from unitcad.meshcheck.rules.inspection import Options

Check = Callable[[Sequence[tuple[str, Options]]], Iterator[FileReport]]
Draw = Callable[[str, Floats, Floats], None]
"""A function that draws two surfaces (n, 3, 3), mm, of the file of that name."""


@dataclass(frozen=True)
class Pair:
    """Two versions of a file; a path is None if that version does not exist."""

    name: str
    old: str | None
    new: str | None

    def is_same(self) -> bool:
        """Return whether both versions have the same bytes; a file that can't be read has none."""
        try:
            return bool(self.old and self.new) and Path(str(self.old)).read_bytes() == Path(str(self.new)).read_bytes()
        except OSError:
            return False


def pairs(old: str, new: str, left_out: Callable[[str], bool] = lambda _: False) -> list[Pair]:
    """Return the files of two folders by their paths in them, or two files. Raises Refusal for other names."""
    for path in (old, new):
        if not Path(path).exists():
            raise Refusal("--diff", path, files.no_such_file(path))
    if Path(old).is_dir() != Path(new).is_dir():
        raise Refusal("--diff", f"{old} {new}", "must be two files or two folders; one of them is a folder")
    if not Path(old).is_dir():
        return [Pair(Path(new).name, old, new)]
    inside = []
    for top in (old, new):
        paths, unread = expand([top], left_out)
        here = [*paths, *(report.path for report in unread if report.path != top)]
        inside.append({Path(os.path.relpath(path, top)).as_posix(): path for path in here})
    names = sorted({*inside[0], *inside[1]})
    if not names:
        raise Refusal("--diff", f"{old} {new}", "no mesh file in these folders")
    return [Pair(name, inside[0].get(name), inside[1].get(name)) for name in names]


def compare(
    found: Sequence[Pair], of_path: Callable[[str], Options], check: Check, draw: Draw | None = None
) -> Iterator[FileReport]:
    """Yield a report a file, with its change: of the new version, or of a file that is gone."""
    same = {pair.name for pair in found if pair.is_same()}
    new = iter(check([(pair.new, _every(of_path(pair.new))) for pair in found if pair.new]))
    old = iter(check([(pair.old, _every(of_path(pair.old))) for pair in found if pair.old and pair.name not in same]))
    for pair in found:
        report = next(new) if pair.new else None
        before = report if pair.name in same else next(old) if pair.old else None
        if report is None:
            assert before is not None
            yield FileReport(before.path, change=Change("gone", before.facts, before.findings))
        elif before is None:
            yield replace(report, change=Change("new"))
        else:
            yield _compared(before, report, pair.name in same, of_path(report.path), draw)


def _every(options: Options) -> Options:
    return replace(options, every_place=True)


def _compared(old: FileReport, new: FileReport, same: bool, options: Options, draw: Draw | None) -> FileReport:
    if same:
        known = tuple(replace(item, known=True) for item in new.findings)
        return replace(new, findings=known, change=Change("unchanged", old.facts, (), 0.0, 0.0))
    back = baseline.mark(old, baseline.of_report(new), "the new version")
    gone = tuple(item for item in back.findings if not item.known)
    marked = baseline.mark(new, baseline.of_report(old), "the old version")
    change = Change("changed", old.facts, gone)
    try:
        clock = Deadline(options.limits.seconds)
        surfaces = [surface_of(Path(report.path), options, clock) for report in (old, new)]
        if all(len(surface) for surface in surfaces):
            farthest = largest_distance(surfaces[0], surfaces[1], clock.tick)
            change = replace(change, distance_mm=farthest.distance, error_mm=farthest.error)
            if draw is not None:
                draw(new.path, surfaces[0], surfaces[1])
    except Unreadable:  # which the reports say
        pass
    return replace(marked, change=change)
