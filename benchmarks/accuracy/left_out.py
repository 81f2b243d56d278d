"""What a build leaves out for a request: the time that it saves, and the files that it changes."""

from __future__ import annotations

import statistics
from collections.abc import Sequence

from benchmarks.accuracy.machine import machine
from benchmarks.accuracy.result import Cell, Promise, Result, Say, Summary, Table
from unitcad.accuracy.measurements import EVERYTHING, REQUESTS, Timing, saving, time_requests
from unitcad.pipeline.unit import Unit
from unitcad.validation import default_template, load, templates

_LEFT_OUT = {
    "STL only": "STEP, 3MF, GLB and drawings",
    "STL, no checks": "the same, the checks, casting and estimate",
    "unit only": "the same, and the moulds",
    "estimate only": "all but the estimate",
}


def run(quick: bool, say: Say) -> Result:
    """Build every template and request, from an empty store each time."""
    times: dict[str, dict[str, Timing]] = {}
    for name in (default_template(),) if quick else templates():
        say(name)
        times[name] = time_requests(Unit(load(name)), REQUESTS, 1 if quick else 5)
    rows = tuple(row(request, list(times.values())) for request in REQUESTS if request != EVERYTHING)
    (saved, changed) = (rows[0][2], sum(int(str(one[-1]).split(" ")[0]) for one in rows))
    return Result(
        suite="left-out",
        title="What is left out",
        text=(
            "A build makes only the files that a request needs; its manifest names what it skipped, with the reason. "
            f"Each request starts from an empty store in a warm process. Templates: {len(times)}."
        ),
        tables=(
            Table(
                "Each request against a build of everything",
                ("request", "left out", "time saved", "told apart", "files that differ"),
                rows,
                "Time saved: median over the templates, least to most, of the time for everything. Told apart: "
                "templates whose quartiles of both times do not overlap; only these count as saved. Files that differ: "
                "of those that both builds write but spec.toml, which names the formats; compared by SHA-256.",
            ),
        ),
        promises=(Promise("files that a smaller request changes", float(changed), 0.0),),
        measured=machine("manifold3d", "cadquery-ocp"),
        summary=Summary(
            (("a build without STEP, 3MF, GLB and drawings", f"{changed} files differ", f"STL only saves {saved}"),),
            f"{changed} of the files differ from those of a build of everything",
        ),
    )


def row(request: str, templates: Sequence[dict[str, Timing]]) -> tuple[Cell, ...]:
    """Return a request's row: what it leaves out, what that saves where times are told apart, files that differ."""
    saved, differ, files = [], 0, 0
    for times in templates:
        one, whole = times[request], times[EVERYTHING]
        less = saving(one, whole)
        if less is not None:
            saved.append(less / whole.median)
        own, other = one.value["files"], whole.value["files"]
        both = (own.keys() & other.keys()) - {"spec.toml"}  # it names the formats
        files += len(both)
        differ += sum(own[path] != other[path] for path in both)
    share = f"{statistics.median(saved):.0%} ({min(saved):.0%} to {max(saved):.0%})" if saved else "not told apart"
    told = f"{len(saved)} of {len(templates)}"
    return request, _LEFT_OUT[request], share, told, f"{differ} of {files}"
