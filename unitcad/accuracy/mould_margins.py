"""The laws of a mould over random specs: the worst value of each, beside its limit."""

from __future__ import annotations

from typing import Any

from unitcad.accuracy.random_specs import seeded_spec
from unitcad.accuracy.result import Promise, Result, Say, Table
from unitcad.accuracy.timing import machine, timing
from unitcad.cache import MemoryStore
from unitcad.errors import Refusal
from unitcad.mould_checks import mould_checks
from unitcad.pipeline.product import make
from unitcad.pipeline.stages import Stages
from unitcad.validation import from_data


def run(quick: bool, say: Say) -> Result:
    """Check the moulds of random specs from the documented ranges that validation accepts."""
    wanted, seed, refused = (8 if quick else 100), 0, 0
    margins: dict[str, tuple[float, dict[str, Any], int]] = {}
    counts: dict[str, int] = {}
    broken: dict[str, int] = {}
    seconds = []
    while len(seconds) < wanted:
        say(f"{len(seconds)} of {wanted}")
        stages = Stages(lambda stage: None)
        try:
            manifest = make(from_data(seeded_spec(seed)), ("unit", "moulds"), True, MemoryStore(), stages).manifest
        except Refusal:
            refused += 1
            seed += 1
            continue
        seconds.append(stages.seconds["laws"])
        for law in manifest["laws"]:
            code = law["code"]
            counts[code] = counts.get(code, 0) + 1
            broken[code] = broken.get(code, 0) + (not law["ok"])
            share = _share(law)
            if code not in margins or share > margins[code][0]:
                margins[code] = (share, law, seed)
        seed += 1
    rows = tuple(
        (code, mould_checks()[code].demands, counts[code], broken[code], *_worst(law), worst_seed)
        for code, (_, law, worst_seed) in sorted(margins.items())
    )
    return Result(
        suite="moulds",
        title="The laws of a mould",
        text=(
            f"{wanted} random specs from the documented ranges, seeds 0 to {seed - 1} ({refused} refused at the "
            "door). For "
            "each law the finding that comes closest to its limit, or breaks it, and the seed of its spec."
        ),
        tables=(
            Table(
                "Worst value of each law", ("code", "law", "findings", "broken", "worst", "limit", "unit", "seed"), rows
            ),
            Table("Time to judge a set, warm", ("sets", "time"), ((wanted, str(timing(seconds))),)),
        ),
        promises=tuple(Promise(f"{code}: findings broken", broken[code], 0) for code in sorted(broken)),
        measured={**machine("manifold3d"), "specs": wanted},
    )


def _worst(law: dict[str, Any]) -> tuple[float | None, float | None, str]:
    """Return value, limit and unit.

    A count that must be met exactly (C000's solids) has none: it is as wanted, or the check fails.
    """
    if law["ok"] and law["code"] == "C000":
        return None, None, ""
    return law["value"], law["limit"], law["unit"] or "number"


def _share(law: dict[str, Any]) -> float:
    """Return how much of its limit a finding uses; a broken one counts as infinite."""
    if not law["ok"]:
        return float("inf")
    if law["code"] == "C210":
        return law["limit"] / law["value"] if law["value"] else 0.0
    return law["value"] / law["limit"] if law["limit"] else 0.0
