"""The outputs that a build skips for each request, and the time that this saves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

from unitcad.accuracy.timing import Timing, interleaved
from unitcad.cache import MemoryStore
from unitcad.pipeline.make import Progress, Subject, forget
from unitcad.pipeline.manifest import Manifest
from unitcad.spec.raw import OUTPUTS

Request = tuple[Sequence[str], Sequence[str], bool]
"""Outputs, formats, checks."""
EVERYTHING = "everything"
REQUESTS: dict[str, Request] = {
    EVERYTHING: (OUTPUTS, ("step", "stl", "3mf", "svg", "glb"), True),
    "STL only": (OUTPUTS, ("stl",), True),
    "STL, no checks": (("unit", "moulds"), ("stl",), False),
    "unit only": (("unit",), ("stl",), True),
    "estimate only": (("estimate",), ("stl",), True),
}
"""Without shaded pictures."""


def time_requests(subject: Subject, requests: Mapping[str, Request], repeats: int) -> dict[str, Timing]:
    """Return the time of each request, made from an empty store in this process; the value is its manifest."""
    return interleaved({name: partial(_manifest, subject, request) for name, request in requests.items()}, repeats)


def skipped_rows(subject: Subject) -> list[dict[str, Any]]:
    """Return a row for each request: its time, the saving against all outputs, and the skipped outputs."""
    requests = {EVERYTHING: REQUESTS[EVERYTHING], "as the spec asks": (OUTPUTS, subject.formats, True), **REQUESTS}
    times = time_requests(subject, requests, 1)
    whole = times[EVERYTHING].median
    return [
        {"request": name, "s": time.median, "saved_s": whole - time.median, "skipped": time.value["skipped"]}
        for name, time in times.items()
    ]


def _manifest(subject: Subject, request: Request) -> Manifest:
    only, formats, check = request
    forget()
    return subject.with_formats(formats).make(only, check, MemoryStore(), Progress()).manifest  # type: ignore[arg-type]
