"""Extreme geometry and random specs: each builds and passes every check, or is refused with a field."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from benchmarks.accuracy.journal import journalled
from benchmarks.accuracy.machine import machine
from benchmarks.accuracy.result import Promise, Result, Say, Summary, Table
from unitcad.accuracy.measurements import timing
from unitcad.accuracy.random_specs import DOCUMENTED, EXTREME, seeded_spec
from unitcad.accuracy.survey import BUILT, CIRCLE, GOOD, HANG, NO_VALUE, REFUSED, Outcome, in_order, outcome
from unitcad.designs import estimated_designs
from unitcad.validation import default_template, override, read

PATIENCE = 1800.0
"""Processor seconds after which a spec counts as hung."""
LEAST_BUILT = 0.6
"""Share of the documented ranges that builds, at least."""
_DOCUMENTED = 0.97
"""Share of the random specs that is drawn from the documented ranges; an extreme one takes several times as long."""
_SERIAL = 60

Job = tuple[str, dict[str, Any]]


def run(quick: bool, say: Say) -> Result:
    """Run the sweeps and a sample of random specs; `study` takes any number."""
    return study(8 if quick else 100, say, sweeps=1 if quick else None)


def study(count: int, say: Say, sweeps: int | None = None, journal: Path | None = None) -> Result:
    """Run all sweeps (`sweeps`: that many values of each) and `count` random specs, 3 % of them extreme.

    Outcomes that this code wrote into `journal` before are taken from there, new ones are appended.
    """
    documented = round(_DOCUMENTED * count)
    number = {"documented": documented, "extreme": count - documented}
    jobs: list[Job] = [(f"sweep {name}", data) for name, data in _sweeps(sweeps)]
    jobs += [(ranges, seeded_spec(seed, ranges)) for ranges in number for seed in range(number[ranges])]
    groups: dict[str, list[Outcome]] = {}
    for i, (group, result) in enumerate(_journalled(jobs, journal) if journal else _outcomes(jobs)):
        say(f"{i + 1} of {len(jobs)}: {group} {result.kind}")
        groups.setdefault(group, []).append(result)
    everything = [result for outcomes in groups.values() for result in outcomes]
    faults = [
        (group, index, o.kind, o.message.replace("|", "/").replace("\n", " ")[:200])
        for group, outcomes in groups.items()
        for index, o in enumerate(outcomes)
        if o.kind not in GOOD
    ]
    tried = groups.get("documented", [])
    built = sum(o.kind == BUILT for o in tried) / max(1, len(tried))
    refused = [o for o in everything if o.kind == REFUSED]
    longest = max((o.seconds for o in everything if o.kind == BUILT), default=0.0)
    return Result(
        suite="extremes",
        title="Extreme geometry and random specs",
        text=(
            f"{len(jobs)} specs: sweeps of the {' and '.join(estimated_designs())} templates to each limit and past "
            f"it. In addition, random specs from the documented ranges below ({documented}) and from the extreme ones "
            f"({count - documented}, half of them with one cavity), every field drawn independently. Each is built "
            "with all checks, or refused with a field. After a refusal, the nearest accepted value is put in until "
            "it builds or no value is offered. Anything else is a fault."
        ),
        tables=(
            _outcome_table(groups),
            Table(
                "Ranges of the random specs (mm; diameters and tolerances uniform in the logarithm)",
                ("field", "documented, least", "largest", "extreme, least", "largest"),
                tuple(_range_rows()),
            ),
            Table(
                "Refusals by field",
                ("field", "refusals", "builds with the nearest values", "ends at another limit", "no value offered"),
                tuple(_refusal_rows(refused)),
                "Nearest values are followed from limit to limit, until it builds or a limit offers none: at once, or "
                "at another limit than the first.",
            ),
            Table("Faults", ("where", "number", "kind", "what"), tuple(faults[:50]) or (("none", None, None, None),)),
        ),
        promises=(
            Promise("specs that end in anything but a build or a refusal", len(faults), 0),
            Promise("refusals whose nearest value meets the same limit", sum(o.kind == CIRCLE for o in everything), 0),
            Promise("documented ranges: share that does not build", 1 - built, 1 - LEAST_BUILT),
        ),
        measured={**machine("manifold3d"), "random specs": count},
        summary=Summary(worst=f"{len(faults) or 'no'} faults in {len(jobs)} specs; the longest build {longest:.3g} s"),
    )


def run_job(job: Job) -> tuple[str, Outcome]:
    """Return what becomes of one spec; runs in a process of its own."""
    return job[0], outcome(job[1])


def _journalled(jobs: Sequence[Job], journal: Path) -> Iterator[tuple[str, Outcome]]:
    """Yield the same, with a line of JSON for each finished spec in `journal`, from which a study resumes."""

    def compute(left: Sequence[Job]) -> Iterator[Any]:
        return ((group, asdict(result)) for group, result in _outcomes(left))

    for group, data in journalled(jobs, compute, journal):
        yield group, Outcome(**{**data, "chain": tuple(data["chain"])})


def _outcomes(jobs: Sequence[Job]) -> Iterator[tuple[str, Outcome]]:
    """Yield the outcomes in order. Many jobs go to worker processes: one that hangs is a fault of its spec."""

    def hung(job: Job) -> tuple[str, Outcome]:
        return job[0], Outcome(HANG, f"no answer within {PATIENCE:g} s of processor time")

    return in_order(run_job, jobs, PATIENCE, hung, _SERIAL)


def _sweeps(values: int | None) -> Iterator[Job]:
    """Yield each extreme on a template, to the limit and past it."""

    def each(name: str, base: str, change: Callable[[Any], list[str]], *of: Any) -> Iterator[Job]:
        count = len(of) if values is None else values
        for i in range(count):
            yield name, override(read(base), change(of[round(len(of) * (i + 1) / count) - 1]))

    def layers(count: int, wall: float, cap: bool) -> str:
        one = f'{{ material = "ecoflex-00-30", wall_mm = {wall}' + (f", cap_mm = {max(wall, 1.2)} }}" if cap else " }")
        return f"layers=[{', '.join([one] * count)}]"

    def room(*walls: float) -> str:
        return f"diameter_mm={2 * (4.5 + sum(walls)):.3f}"

    # fmt: off
    for base, design in estimated_designs().items():
        cap = design.caps
        yield from each(f"{base}: walls 0.4 to 12 mm", base,
                        lambda w, cap=cap: [layers(2, w, cap), room(w, w)], 0.4, 0.5, 0.7, 1, 3, 6, 10, 12)
        yield from each(f"{base}: diameter 8 to 250 mm", base,
                        lambda d: [f"diameter_mm={d}"], 8, 10, 12.2, 14, 30, 80, 150, 200, 250)
        yield from each(f"{base}: 1 to 16 layers", base,
                        lambda n, cap=cap: [layers(n, 1.0, cap), room(*[1.0] * n)], 1, 2, 5, 9, 12, 15, 16)
        yield from each(f"{base}: tolerance 0.0004 to 0.25 mm", base,
                        lambda t: [f"output.tolerance_mm={t}"], 0.25, 0.2, 0.1, 0.03, 0.003, 0.001, 0.0005, 0.0004)
        yield from each(f"{base}: plinth clearance 0.001 to 3 mm", base,
                        lambda c: [f"moulds.plinth_clearance_mm={c}"], 0.001, 0.01, 0.05, 0.5, 1.0, 3.0)
    base = default_template()
    yield from each("tail 0.3 to 7 mm, one side and both", base,
                    lambda t: [f"fpcb.tail_width_mm={t[0]}", f"fpcb.tail={t[1]}"],
                    *((w, s) for w in (0.3, 0.5, 2.0, 5.0, 6.0, 6.29, 6.3, 7.0) for s in ("one", "both")))
    yield from each("window clearance 0.001 to 0.6 mm", base,
                    lambda c: [f"moulds.window_clearance_mm={c}"], 0.001, 0.01, 0.05, 0.2, 0.24, 0.3, 0.6)
    yield from each("caps at the floor and below", base,
                    lambda c: [f"layers.0.cap_mm={c}", f"layers.1.cap_mm={c}"],
                    0.49, 0.5, 0.8, 0.98, 0.989, 0.99, 1.1, 1.25)
    yield from each("second cap at the floor and below", base,
                    lambda c: [f"layers.1.cap_mm={c}"], 0.4, 0.5, 0.51, 0.6, 0.8)
    # fmt: on


def _outcome_table(groups: dict[str, list[Outcome]]) -> Table:
    rows = []
    for group, outcomes in groups.items():
        kinds = Counter(o.kind for o in outcomes)
        built = [o.seconds for o in outcomes if o.kind == BUILT]
        faults = len(outcomes) - kinds[BUILT] - kinds[REFUSED]
        time = str(timing(built)) if built else None
        rows.append((group, len(outcomes), kinds[BUILT], kinds[REFUSED], faults, time, max(built, default=None)))
    columns = ("specs", "number", "built", "refused", "faults", "time of a build", "longest, s")
    return Table("Outcomes", columns, tuple(rows))


def _refusal_rows(refused: Sequence[Outcome]) -> Iterator[tuple]:
    for name, count in Counter(o.field for o in refused).most_common():
        mine = [o for o in refused if o.field == name]
        built = sum(o.chain_end == BUILT for o in mine)
        at_once = sum(o.chain_end == NO_VALUE and len(o.chain) == 1 for o in mine)
        yield name, count, built, count - built - at_once, at_once


def _range_rows() -> Iterator[tuple]:
    extreme = {name: ends for name, *ends in EXTREME.rows()}
    for name, *ends in DOCUMENTED.rows():
        yield (name, *ends, *extreme.pop(name))
    for name, ends in extreme.items():
        yield (name, None, None, *ends)
