"""The survey of random media and random specs: do the stated bounds hold, does each spec build or name a field."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict
from typing import Any

from unitcad.accuracy.outcomes import BUILT, GOOD, HANG, REFUSED, Outcome, outcome
from unitcad.accuracy.random_media import CLASSES, trial
from unitcad.accuracy.random_specs import RANGES, seeded_spec
from unitcad.accuracy.responses import REFERENCE, RTOLS, compare
from unitcad.accuracy.worker_jobs import in_order

MEDIUM_S, SPEC_S = 1200.0, 1800.0
"""Processor seconds after which a medium, and a spec, counts as hung."""
EXTREME_SHARE = 0.03
"""Share of the random specs that is drawn from the extreme ranges, one at least."""
_SERIAL = 20
"""Jobs up to which no worker processes are started."""
Say = Callable[[str], object]
Job = tuple[str, int]
"""A class of media or a range of specs, and the seed."""


def survey_media(count: int, seed: int, say: Say) -> dict[str, Any]:
    """Compare the responses of `count` random media at five rtols with those at a hundredth of the least.

    Returns {media, seed, by_rtol, by_class, worst}: the worst response is that which is closest to its bound.
    """
    jobs = [(CLASSES[i % len(CLASSES)], 10_000 * seed + i // len(CLASSES)) for i in range(count)]
    rows: list[dict[str, Any]] = []
    for i, found in enumerate(in_order(_medium, jobs, MEDIUM_S, _lost, _SERIAL)):
        say(f"random media: {i + 1} of {count}")
        rows += found
    groups = {name: [row for row in rows if row["class"] == name] for name in CLASSES}
    return {
        "media": count,
        "seed": seed,
        "by_rtol": [{"rtol": rtol, **_summary([r for r in rows if r["rtol"] == rtol])} for rtol in RTOLS],
        "by_class": [{"class": name, **_summary(group)} for name, group in groups.items() if group],
        "worst": max(rows, key=lambda row: row["over_bound"]),
    }


def _medium(job: Job) -> list[dict[str, Any]]:
    """Return a row for each rtol; a response without a value is infinitely far off. Runs in a worker process."""
    one = trial(*job)
    rows = []
    reference = one.medium.response(one.load, one.omega, one.r, z=one.z, rtol=REFERENCE)
    for rtol in RTOLS:
        start = time.process_time()
        response = one.medium.response(one.load, one.omega, one.r, z=one.z, rtol=rtol)
        seconds = time.process_time() - start
        rows.append({**_row(job, rtol), **asdict(compare(response, reference)), "s": seconds})
    return rows


def _row(job: Job, rtol: float) -> dict[str, Any]:
    return {"class": job[0], "seed": job[1], "rtol": rtol}


def _lost(job: Job) -> list[dict[str, Any]]:
    return [{**_row(job, rtol), **dict.fromkeys(("error", "bound", "over_bound", "s"), math.inf)} for rtol in RTOLS]


def _summary(rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    return {
        "responses": len(rows),
        "within_rtol": sum(row["bound"] <= row["rtol"] for row in rows),
        "bounds_broken": sum(not row["over_bound"] <= 1 for row in rows),
        **{name: max(row[name] for row in rows) for name in ("error", "bound", "over_bound")},
        "longest_s": max(row["s"] for row in rows),
    }


def survey_specs(count: int, seed: int, say: Say) -> dict[str, Any]:
    """Build `count` random specs with all checks; each builds, or is refused with a field.

    Returns {specs, seed, by_ranges, faults}. After a refusal its nearest accepted values are followed.
    """
    extreme = max(1, round(EXTREME_SHARE * count))
    number = {"documented": count - extreme, "extreme": extreme}
    jobs = [(ranges, 100_000 * seed + i) for ranges in RANGES for i in range(number[ranges])]
    outcomes: list[Outcome] = []
    for i, found in enumerate(in_order(_spec, jobs, SPEC_S, _hung, _SERIAL)):
        say(f"random specs: {i + 1} of {count}")
        outcomes.append(found)
    pairs = list(zip(jobs, outcomes, strict=True))
    return {
        "specs": count,
        "seed": seed,
        "by_ranges": [
            {
                "ranges": ranges,
                "specs": number[ranges],
                **{kind: sum(o.kind == kind for j, o in pairs if j[0] == ranges) for kind in (BUILT, REFUSED)},
                "faults": sum(o.kind not in GOOD for j, o in pairs if j[0] == ranges),
                "longest_s": max((o.seconds for j, o in pairs if j[0] == ranges), default=0.0),
            }
            for ranges in RANGES
        ],
        "faults": [
            {"ranges": ranges, "seed": at, "kind": o.kind, "message": o.message}
            for (ranges, at), o in pairs
            if o.kind not in GOOD
        ],
    }


def _spec(job: Job) -> Outcome:
    """Return the outcome of a spec. Runs in a worker process."""
    return outcome(seeded_spec(job[1], job[0]))


def _hung(job: Job) -> Outcome:
    return Outcome(HANG, f"no answer within {SPEC_S:g} s of processor time")
