"""The survey of random media and random specs: do the stated bounds hold, does each spec build or name a field."""

from __future__ import annotations

import copy
import dataclasses
import faulthandler
import math
import signal
import tempfile
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, TypeVar

from unitcad.accuracy.measurements import REFERENCE, RTOLS, compare
from unitcad.accuracy.random_media import CLASSES, trial
from unitcad.accuracy.random_specs import RANGES, seeded_spec
from unitcad.errors import Refusal, UnitcadError
from unitcad.moulds.plan import plan
from unitcad.pipeline.write import build
from unitcad.validation import from_data, put
from unitcad.workers import Pool, WorkerEnded, cores

BUILT, REFUSED = "built", "refused"
MOULD_CHECK, MESH_CHECK, ERROR, CRASH, HANG, CIRCLE = "mould check", "mesh check", "error", "crash", "hang", "circle"
NO_VALUE = "no value"
"""How a chain ends at a refusal that offers none."""
GOOD = (BUILT, REFUSED)
_MOST_STEPS = 40


@dataclass(frozen=True)
class Outcome:
    """Result of a spec.

    `kind` is `BUILT`, `REFUSED` or a fault; `worst` the largest value met by each mould check's code; `chain` the
    fields that the nearest accepted values led through after a first refusal, and `chain_end` how that chain ended.
    """

    kind: str
    message: str = ""
    field: str = ""
    worst: dict[str, float] = dataclasses.field(default_factory=dict)
    chain: tuple[str, ...] = ()
    chain_end: str = ""
    seconds: float = 0.0


def build_outcome(data: dict[str, Any]) -> Outcome:
    """Build unit and moulds of a spec's data, with all checks, into a folder that is removed afterwards."""

    start = time.perf_counter()
    try:
        spec = from_data(data)
        with tempfile.TemporaryDirectory() as folder:
            manifest = build(spec, Path(folder), only=("unit", "moulds")).manifest
    except Refusal as refusal:
        kind = REFUSED if refusal.field else ERROR  # a refusal that names no field is a fault of ours
        return Outcome(kind, str(refusal), refusal.field, seconds=time.perf_counter() - start)
    except UnitcadError as error:
        return Outcome(ERROR, str(error), seconds=time.perf_counter() - start)
    except Exception as error:
        return Outcome(CRASH, f"{type(error).__name__}: {error}", seconds=time.perf_counter() - start)
    seconds = time.perf_counter() - start
    worst: dict[str, float] = {}
    for finding in manifest["mould_checks"]:
        worst[finding["code"]] = max(worst.get(finding["code"], 0.0), abs(finding["value"]))
    if broken := [f"{f['code']} {f['where']} = {f['value']:g}" for f in manifest["mould_checks"] if not f["ok"]]:
        return Outcome(MOULD_CHECK, "; ".join(broken), worst=worst, seconds=seconds)
    if manifest["check"]["errors"]:
        errors = [f"{f['code']} {f['message']}" for f in manifest["check"]["findings"] if f["severity"] == "error"]
        return Outcome(MESH_CHECK, "; ".join(errors), worst=worst, seconds=seconds)
    return Outcome(BUILT, worst=worst, seconds=seconds)


def outcome(data: dict[str, Any]) -> Outcome:
    """Return `build_outcome`; after a refusal, follow its nearest accepted values until the spec builds.

    A fault is also a refusal whose nearest value meets the very limit again, or a chain of them that never ends
    (`CIRCLE`), and whatever goes wrong with the spec at the chain's end.
    """
    first = build_outcome(data)
    if first.kind != REFUSED:
        return first
    chain: list[str] = []
    refusal = refusal_of(data)
    while refusal is not None:
        chain.append(refusal.field)
        if refusal.nearest is None:
            return Outcome(REFUSED, first.message, first.field, {}, tuple(chain), NO_VALUE, first.seconds)
        data = put_in(data, refusal.field, refusal.nearest)
        before, refusal = refusal, refusal_of(data)
        same = refusal is not None and (refusal.field, refusal.limit) == (before.field, before.limit)
        if same or len(chain) > _MOST_STEPS:
            return Outcome(CIRCLE, f"{before} -> {refusal}", first.field, {}, tuple(chain), CIRCLE, first.seconds)
    last = build_outcome(data)
    kind = REFUSED if last.kind in GOOD else last.kind
    message = first.message if last.kind in GOOD else f"after {' > '.join(chain)}: {last.message}"
    return Outcome(kind, message, first.field, last.worst, tuple(chain), last.kind, first.seconds)


def refusal_of(data: dict[str, Any]) -> Refusal | None:
    """Return the refusal that a spec's data meets in validation or in its moulds' plan; None if it passes both."""

    try:
        plan(from_data(data))
    except Refusal as refusal:
        return refusal
    return None


def put_in(data: dict[str, Any], where: str, value: object) -> dict[str, Any]:
    """Return `data` with `value` at the dotted path of a refusal."""

    changed = copy.deepcopy(data)
    put(changed, where, value)
    return changed


J = TypeVar("J")
T = TypeVar("T")

_AHEAD = 16  # jobs handed to each worker, so that none waits for a slow one
_WAITING = 20  # times its processor time that a job may take by the clock


def in_order(
    call: Callable[[J], T], jobs: Sequence[J], patience: float, late: Callable[[J], T], serial: int = 0
) -> Iterator[T]:
    """Yield call(job) of every job, in order, from worker processes; up to `serial` jobs run in this one.

    A worker that dies, or takes more than `patience` seconds of processor time, gives late(job), and the others go on.
    """
    if len(jobs) <= serial:
        yield from map(call, jobs)
        return
    waiting = deque(jobs)
    running: deque[tuple[J, Future[T]]] = deque()
    with Pool(cores(), load=("unitcad.pipeline.write",)) as pool:
        while waiting or running:
            while waiting and len(running) < _AHEAD * cores():
                job = waiting.popleft()
                running.append((job, pool.submit(_within, patience, call, job)))
            job, answer = running.popleft()
            try:
                yield answer.result()
            except WorkerEnded:
                yield late(job)


def _within(patience: float, call: Callable[[J], T], job: J) -> T:
    """Return call(job), in a worker; the system ends this process after `patience` seconds of its processor time.

    A loaded machine changes nothing of that. A call that waits, without processor time, ends later by the clock.
    """
    counted = hasattr(signal, "setitimer")  # not on Windows: there the clock has to do
    faulthandler.dump_traceback_later(patience * (_WAITING if counted else 1), exit=True)
    if counted:
        signal.signal(signal.SIGPROF, signal.SIG_DFL)
        signal.setitimer(signal.ITIMER_PROF, patience)
    try:
        return call(job)
    finally:
        if counted:
            signal.setitimer(signal.ITIMER_PROF, 0.0)
        faulthandler.cancel_dump_traceback_later()


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
    one, rows = trial(*job), _lost(job)
    reference = one.medium.response(one.load, one.omega, one.r, rtol=REFERENCE)
    for row in rows:
        start = time.process_time()
        response = one.medium.response(one.load, one.omega, one.r, rtol=row["rtol"])
        row |= {"s": time.process_time() - start, **asdict(compare(response, reference))}
    return rows


def _lost(job: Job) -> list[dict[str, Any]]:
    lost = dict.fromkeys(("error", "bound", "over_bound", "s"), math.inf)
    return [{"class": job[0], "seed": job[1], "rtol": rtol, **lost} for rtol in RTOLS]


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
    hung = Outcome(HANG, f"no answer within {SPEC_S:g} s of processor time")
    outcomes: list[Outcome] = []
    for i, found in enumerate(in_order(_spec, jobs, SPEC_S, lambda job: hung, _SERIAL)):
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
