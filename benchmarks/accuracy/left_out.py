"""What a build leaves out per template and request, and the time that it saves."""

from __future__ import annotations

from benchmarks.accuracy.machine import machine
from benchmarks.accuracy.result import Cell, Result, Say, Table
from unitcad.accuracy.skipped import EVERYTHING, REQUESTS, Request, time_requests
from unitcad.pipeline.make import Subject
from unitcad.pipeline.plan import OUTPUTS
from unitcad.validation import default_template, load, templates

_REQUESTS: dict[str, Request] = {
    EVERYTHING: REQUESTS[EVERYTHING],
    "default formats": (OUTPUTS, ("step", "stl", "3mf"), True),
    **REQUESTS,
}


def run(quick: bool, say: Say) -> Result:
    """Build every template and request, from an empty store each time."""
    chosen = (default_template(),) if quick else tuple(templates())
    rows: list[tuple[Cell, ...]] = []
    for name in chosen:
        say(name)
        times = time_requests(Subject(load(name)), _REQUESTS, 1 if quick else 3)
        whole = times[EVERYTHING].median
        for request, time in times.items():
            left = "; ".join(f"{entry['output']} ({entry['reason']})" for entry in time.value["skipped"])
            rows.append((name, request, str(time), time.median / whole, left or "nothing"))
    return Result(
        suite="left-out",
        title="What is left out",
        text=(
            "A build computes what the outputs that were asked for need, and its manifest says what it left out and "
            "why. Here every request starts from an empty store in a warm process; the share is of the time for "
            "everything."
        ),
        tables=(Table("By template and request", ("template", "asked for", "time", "share", "left out"), tuple(rows)),),
        measured=machine("manifold3d", "cadquery-ocp"),
    )
