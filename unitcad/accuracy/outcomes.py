"""What becomes of a spec: built with every law kept, refused with a field named, or a fault of ours."""

from __future__ import annotations

import copy
import dataclasses
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from unitcad.errors import Refusal, UnitcadError

BUILT, REFUSED = "built", "refused"
LAW, CHECK, ERROR, CRASH, HANG, CIRCLE = "law", "check", "error", "crash", "hang", "circle"
NO_VALUE = "no value"
"""How a chain ends at a refusal that offers none."""
GOOD = (BUILT, REFUSED)
_MOST_STEPS = 40


@dataclass(frozen=True)
class Outcome:
    """`kind` is `BUILT`, `REFUSED` or a fault; `worst` the largest value met by law code; `chain` the fields that the
    nearest accepted values led through after a first refusal, and how that chain ended.
    """

    kind: str
    message: str = ""
    field: str = ""
    worst: dict[str, float] = dataclasses.field(default_factory=dict)
    chain: tuple[str, ...] = ()
    chain_end: str = ""
    seconds: float = 0.0


def build_outcome(data: dict[str, Any]) -> Outcome:
    """Build unit and moulds of a spec's data into a folder that is thrown away: laws, mesh files and their checks."""
    from unitcad.pipeline.build import build
    from unitcad.validation import from_data

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
    for law in manifest["laws"]:
        worst[law["code"]] = max(worst.get(law["code"], 0.0), abs(law["value"]))
    broken = [f"{law['code']} {law['where']} = {law['value']:g}" for law in manifest["laws"] if not law["ok"]]
    if broken:
        return Outcome(LAW, "; ".join(broken), worst=worst, seconds=seconds)
    if manifest["check"]["errors"]:
        found = [f"{f['code']} {f['message']}" for f in manifest["check"]["findings"] if f["severity"] == "error"]
        return Outcome(CHECK, "; ".join(found), worst=worst, seconds=seconds)
    return Outcome(BUILT, worst=worst, seconds=seconds)


def outcome(data: dict[str, Any], follow: bool = True) -> Outcome:
    """Return `build_outcome`; after a refusal, follow its nearest accepted values until the spec builds.

    A fault is also a refusal whose nearest value meets the very limit again, or a chain of them that never ends
    (`CIRCLE`), and whatever goes wrong with the spec at the chain's end.
    """
    first = build_outcome(data)
    if first.kind != REFUSED or not follow:
        return first
    chain: list[str] = []
    data = copy.deepcopy(data)
    while True:
        refusal = door(data)
        if refusal is None:
            last = build_outcome(data)
            kind = REFUSED if last.kind in GOOD else last.kind
            message = first.message if last.kind in GOOD else f"after {' > '.join(chain)}: {last.message}"
            return Outcome(kind, message, first.field, last.worst, tuple(chain), last.kind, first.seconds)
        chain.append(refusal.field)
        if refusal.nearest is None:
            return Outcome(REFUSED, first.message, first.field, {}, tuple(chain), NO_VALUE, first.seconds)
        before, data = refusal, put_in(data, refusal.field, refusal.nearest)
        after = door(data)
        same = after is not None and (after.field, after.limit) == (before.field, before.limit)
        if same or len(chain) > _MOST_STEPS:
            return Outcome(CIRCLE, f"{before} -> {after}", first.field, {}, tuple(chain), CIRCLE, first.seconds)


def door(data: dict[str, Any]) -> Refusal | None:
    """Return the refusal that a spec's data meets in validation or in its moulds' plan; None if it passes both."""
    from unitcad.moulds.plan import plan
    from unitcad.validation import from_data

    try:
        plan(from_data(data))
    except Refusal as refusal:
        return refusal
    return None


def put_in(data: dict[str, Any], where: str, value: object) -> dict[str, Any]:
    """Return `data` with `value` at the dotted path of a refusal."""
    from unitcad.validation import put

    changed = copy.deepcopy(data)
    put(changed, where, value)
    return changed
