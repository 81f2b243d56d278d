"""What a campaign names, checked before the first measurement: files, their endings, repeats, specs."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from unitcad.errors import Refusal
from unitcad.files import sha256
from unitcad.lab.campaign import Campaign, UnitTable
from unitcad.lab.own_recordings import check_own
from unitcad.lab.readers.formats import expect_ending
from unitcad.lab.unit_files import file_of, source_file


def check_files(campaign: Campaign, folder: Path) -> None:
    """Check every name of a campaign whose files lie in or below `folder`, and read no record for it.

    Raises Refusal for a spec that is no template, a file that is not there or has no reader, a record given twice,
    a [[recording.own]] of no record.
    """
    for field, name in blank_files(campaign):
        expect_ending(file_of(folder, name, field), field)
    units = (name for unit in campaign.unit for _, name in _records(unit, ""))
    check_own(campaign.recording, (*(name for _, name in blank_files(campaign)), *units))
    for i, unit in enumerate(campaign.unit):
        field = f"unit.{i}"
        source_file(unit, folder, field)
        _expect_different(folder, list(_records(unit, field)))


def blank_files(campaign: Campaign) -> Iterator[tuple[str, str]]:
    """Yield key and name of the motor-off records."""
    if campaign.blank is not None:
        for key in ("records", "motor_records"):
            for i, name in enumerate(getattr(campaign.blank, key)):
                yield f"blank.{key}.{i}", name


def _records(unit: UnitTable, field: str) -> Iterator[tuple[str, str]]:
    places = [(f"{field}.reference", unit.reference), (f"{field}.edge", unit.edge)]
    places += [(f"{field}.point.{k}.records", point.records) for k, point in enumerate(unit.point)]
    for where, names in places:
        for i, name in enumerate(names):
            yield f"{where}.{i}", name


def _expect_different(folder: Path, records: list[tuple[str, str]]) -> None:
    """Refuse a record that stands twice in one unit: by its path, or by its bytes where the sizes are the same."""
    paths = [(field, name, file_of(folder, name, field)) for field, name in records]
    for field, _, path in paths:
        expect_ending(path, field)
    sizes = [path.stat().st_size for _, _, path in paths]
    seen: dict[str, str] = {}
    for (field, name, path), size in zip(paths, sizes, strict=True):
        keys = [str(path.resolve())]
        if sizes.count(size) > 1:
            keys.append(sha256(path))
        for key in keys:
            if key in seen:
                raise Refusal(field, name, f"is the record of {seen[key]} again; a repeat is a recording of its own")
            seen[key] = field
