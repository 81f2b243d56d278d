"""What `[recording]` is for one record: a campaign's own values for some of its files."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from fnmatch import fnmatchcase

import msgspec

from unitcad.errors import Refusal
from unitcad.lab.campaign import OwnRecordingTable, RecordingTable

_TIME_KEYS = ("rate_hz", "time_column", "time_unit")
"""Keys that say the same of a record: one of them in `[[recording.own]]` sets aside those of `[recording]`."""


def recording_of(table: RecordingTable, name: str) -> RecordingTable:
    """Return how the record of that name is read: `table` with the values of the [[recording.own]] that names it."""
    own = next((one for one in table.own if _names(one, name)), None)
    if own is None:
        return table
    given = _given(own)
    times = _TIME_KEYS[:2]
    if any(key in given for key in times):
        given = {**dict.fromkeys(key for key in _TIME_KEYS if key not in given), **given}
    return msgspec.structs.replace(table, own=(), **given)


@contextmanager
def own_keys(table: RecordingTable, name: str) -> Iterator[None]:
    """Let a refusal of a key of `[recording]` name the [[recording.own]] that set it for the record, or that could."""
    try:
        yield
    except Refusal as refusal:
        key = refusal.field.removeprefix("recording.")
        if refusal.field == key:
            raise
        field, limit = refusal.field, f"{refusal.limit}; [[recording.own]] sets it for some records alone"
        for i, own in enumerate(table.own):
            if _names(own, name) and key in _given(own):
                field, limit = f"recording.own.{i}.{key}", refusal.limit
        raise type(refusal)(field, refusal.value, limit, refusal.nearest) from None


def check_own(table: RecordingTable, names: Iterable[str]) -> None:
    """Refuse a [[recording.own]] that sets nothing, that names no record of the campaign, or one of another's."""
    names = list(dict.fromkeys(names))
    taken: dict[str, int] = {}
    for i, own in enumerate(table.own):
        field = f"recording.own.{i}"
        if not own.records:
            raise Refusal(f"{field}.records", [], "names no record")
        given = _given(own)
        if not given:
            keys = ", ".join(key for key in msgspec.structs.asdict(own) if key != "records")
            raise Refusal(field, None, f"sets nothing beside records: {keys}")
        if "motor_channel" in given and table.motor_channel is None:
            raise Refusal(f"{field}.motor_channel", given["motor_channel"], "stands without recording.motor_channel")
        for k, pattern in enumerate(own.records):
            found = [name for name in names if _matches(pattern, name)]
            if not found:
                close = difflib.get_close_matches(pattern, names, n=1)
                limit = "names no record of the campaign"
                raise Refusal(f"{field}.records.{k}", pattern, limit, close[0] if close else None)
            for name in found:
                if taken.setdefault(name, i) != i:
                    limit = f"names {name}, which recording.own.{taken[name]} does too"
                    raise Refusal(f"{field}.records.{k}", pattern, limit)


def _given(own: OwnRecordingTable) -> dict[str, object]:
    """Return the keys that a table sets, beside the records."""
    return {key: value for key, value in msgspec.structs.asdict(own).items() if key != "records" and value is not None}


def _names(own: OwnRecordingTable, name: str) -> bool:
    return any(_matches(pattern, name) for pattern in own.records)


def _matches(pattern: str, name: str) -> bool:
    return pattern == name or fnmatchcase(name, pattern)
