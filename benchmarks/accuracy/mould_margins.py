"""Mould checks over random specs: the worst value of each, beside its limit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import count

from benchmarks.accuracy.machine import machine
from benchmarks.accuracy.result import Promise, Result, Say, Summary, Table, shown
from unitcad.accuracy.measurements import timing
from unitcad.accuracy.random_specs import seeded_spec
from unitcad.cache import MemoryStore
from unitcad.checks import mould_checks
from unitcad.errors import Refusal
from unitcad.pipeline.make import make
from unitcad.pipeline.manifest import FindingRecord
from unitcad.pipeline.result import Progress
from unitcad.pipeline.unit import Unit
from unitcad.spec import Spec
from unitcad.validation import default_template, from_data, load

REPEATS = 8
"""How often the set of the default template is checked; the first time does not count."""
AIM_S = 0.3


@dataclass
class _Margin:
    """A check's findings over all specs: how many, how many broken, and the one that uses most of its limit."""

    findings: int = 0
    broken: int = 0
    share: float = -1.0
    worst: FindingRecord | None = None
    seed: int = 0


def run(quick: bool, say: Say) -> Result:
    """Check the moulds of random specs from the documented ranges that validation accepts."""
    wanted, seed = 8 if quick else 100, 0
    margins: dict[str, _Margin] = {}
    seconds = []
    for seed in count():
        say(f"{len(seconds)} of {wanted}")
        try:
            took, laws = _seconds(from_data(seeded_spec(seed)))
        except Refusal:
            continue
        seconds.append(took)
        for finding in laws:
            margin = margins.setdefault(finding["code"], _Margin())
            margin.findings += 1
            margin.broken += not finding["ok"]
            if (share := _share(finding)) > margin.share:
                margin.share, margin.worst, margin.seed = share, finding, seed
        if len(seconds) == wanted:
            break
    shipped = load(default_template())
    say(shipped.name)
    of_shipped = [_seconds(shipped)[0] for _ in range(REPEATS)][1:]
    ordered = sorted(margins.items())
    rows = tuple(
        (code, mould_checks()[code].demands, margin.findings, margin.broken, *_worst(margin.worst), margin.seed)
        for code, margin in ordered
    )
    columns = ("code", "demand", "findings", "broken", "worst", "limit", "unit", "seed")
    return Result(
        suite="moulds",
        title="Mould checks",
        text=(
            f"{wanted} random specs from the documented ranges, seeds 0 to {seed} ({seed + 1 - wanted} refused). For "
            "each check the finding that comes closest to its limit, or breaks it, and the seed of its spec."
        ),
        tables=(
            Table("Worst value of each check", columns, rows),
            Table(
                "Time to check a set, warm",
                ("sets", "time", "aim, less than"),
                ((wanted, str(timing(seconds)), None), (shipped.name, str(timing(of_shipped)), f"{1000 * AIM_S:g} ms")),
            ),
        ),
        promises=tuple(Promise(f"{code}: findings broken", margin.broken, 0) for code, margin in ordered),
        measured={**machine("manifold3d"), "specs": wanted},
        summary=Summary(worst=closest(rows)),
    )


def _seconds(spec: Spec) -> tuple[float, list[FindingRecord]]:
    """Return the seconds that the mould checks of a spec take, and what they found. Raises Refusal."""
    stages = Progress()
    manifest = make(Unit(spec), ("unit", "moulds"), True, MemoryStore(), stages).manifest
    return stages.seconds["mould checks"], manifest["mould_checks"]


def closest(rows: Sequence[tuple]) -> str:
    """Return the finding that comes closest to its limit, of the rows of the table."""
    broken = sum(row[3] for row in rows)
    limited = [row for row in rows if row[4] and row[5]]
    if broken or not limited:
        return f"{broken} findings broken"
    code, _, _, _, value, limit, unit, seed = max(limited, key=lambda row: min(row[4] / row[5], row[5] / row[4]))
    return f"{code}, spec {seed}: {shown(value)} {unit}, limit {shown(limit)}"


def _worst(finding: FindingRecord | None) -> tuple[float | None, float | None, str]:
    """Return value, limit and unit.

    A count that must be met exactly (C000's solids) has none: it is as wanted, or the check fails.
    """
    if finding is None or (finding["ok"] and finding["code"] == "C000"):
        return None, None, ""
    return finding["value"], finding["limit"], finding["unit"] or "number"


def _share(finding: FindingRecord) -> float:
    """Return how much of its limit a finding uses; a broken one counts as infinite."""
    if not finding["ok"]:
        return float("inf")
    if finding["code"] in ("C210", "C410"):  # at least the limit
        return finding["limit"] / finding["value"] if finding["value"] else 0.0
    return finding["value"] / finding["limit"] if finding["limit"] else 0.0
