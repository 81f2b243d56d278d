"""Random specs: exit 0 with every check passed, or a refusal whose nearest value leads on."""

import dataclasses
import os
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from benchmarks.accuracy import extremes
from benchmarks.accuracy.runner import JOURNALS
from unitcad.accuracy.random_specs import DOCUMENTED, EXTREME, Seeded, random_spec, seeded_spec
from unitcad.accuracy.survey import (
    BUILT,
    GOOD,
    REFUSED,
    Outcome,
    outcome,
    put_in,
    refusal_of,
)
from unitcad.checks import check_moulds
from unitcad.errors import UnitcadError
from unitcad.moulds.mould_set import MouldSet
from unitcad.validation import from_data

EXAMPLES = int(os.environ.get("UNITCAD_RANDOM_SPECS", "6"))
"""Of both ranges; `python -m benchmarks.accuracy extremes --quick` builds forty more, the long study ten thousand."""


class Drawn:
    """Hypothesis chooses, and so shrinks."""

    def __init__(self, draw):
        self._draw = draw

    def whole(self, low, high, /):
        return self._draw(st.integers(low, high))

    def pick(self, options, /):
        return self._draw(st.sampled_from(list(options)))


@st.composite
def specs(draw, ranges):
    return random_spec(Drawn(draw), ranges)


# Fine tolerances and large gangs take up to a minute each: the suite extremes has them.
COARSE = dataclasses.replace(EXTREME, tolerance_mm=(0.1, 0.2), cavities=(1, 2))


@pytest.mark.parametrize("ranges", [DOCUMENTED, COARSE], ids=["documented", "extreme"])
@settings(max_examples=EXAMPLES // 2, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(data=st.data())
def test_a_random_spec_passes_its_checks_or_is_refused_with_a_field(ranges, data):
    data = data.draw(specs(ranges))
    result = outcome(data)
    assert result.kind in GOOD, result
    assert result.kind == BUILT or result.field


def test_most_of_the_documented_ranges_builds():
    """Validation and plan decide; that what passes them passes its checks too is the test above."""
    seeds = range(100)
    passed = sum(refusal_of(seeded_spec(seed)) is None for seed in seeds)
    assert passed >= extremes.LEAST_BUILT * len(seeds)


def test_nearest_values_lead_to_a_build_or_another_limit():
    for seed in range(20):
        data = seeded_spec(seed, "extreme")
        for _ in range(41):
            refusal = refusal_of(data)
            if refusal is None or refusal.nearest is None:
                break
            data = put_in(data, refusal.field, refusal.nearest)
            after = refusal_of(data)
            assert after is None or (after.field, after.limit) != (refusal.field, refusal.limit), (seed, str(after))
        else:
            pytest.fail(f"seed {seed}: the nearest values never end")


def test_the_docs_have_the_documented_ranges():
    page = (Path(__file__).parents[2] / "docs" / "reference" / "spec.md").read_text("utf-8")
    for name, low, high in DOCUMENTED.rows():
        assert f"| `{name}` | {low:g} | {high:g} |" in page, name


def test_a_seed_is_a_spec():
    assert seeded_spec(5) == seeded_spec(5) != seeded_spec(6)


@pytest.mark.long
def test_ten_thousand_random_specs():
    result = extremes.study(10_000, print, journal=JOURNALS["extremes"])
    assert result.ok, [promise for promise in result.promises if not promise.ok]


def test_an_interrupted_study_resumes(tmp_path, monkeypatch):
    """Twelve specs, stopped after five with a line cut short: seven are built, and the result is that of one run."""
    run = []

    def quick(job):
        run.append(job)
        return job[0], Outcome(BUILT if len(run) % 2 else REFUSED, field="x", chain=("a", "b"), seconds=0.5)

    jobs = [("documented", seeded_spec(seed)) for seed in range(12)]
    monkeypatch.setattr(extremes, "run_job", quick)
    journal = tmp_path / "out" / "study.jsonl"
    going = extremes._journalled(jobs, journal)
    first = [next(going) for _ in range(5)]
    going.close()
    with journal.open("ab") as file:
        file.write(b'["cut')
    again = list(extremes._journalled(jobs, journal))
    assert again[:5] == first
    assert run == jobs
    assert list(extremes._journalled(jobs, journal)) == again
    journal.write_text("something else\n")
    with pytest.raises(UnitcadError, match="not a journal"):
        list(extremes._journalled(jobs, journal))


@pytest.mark.parametrize("seed", range(6))
def test_random_lids_and_wires_keep_the_laws_or_are_refused(seed):
    """From the documented ranges, with lids, resin and wires added: the nearest accepted values lead to a good set."""
    data, choose = random_spec(Seeded(seed), DOCUMENTED), Seeded(1000 + seed)
    data.setdefault("moulds", {}).update(pour=choose.pick(("open", "injected")), cavities=[1, 1])
    data["moulds"]["printer"] = choose.pick(("fdm-0.4", "fdm-0.25", "sla"))
    data.setdefault("output", {})["tolerance_mm"] = 0.02
    if choose.whole(0, 2) == 0:
        data.pop("fpcb", None)
        data["wires"] = {"diameter_mm": choose.whole(20, 80) / 100, "count": choose.whole(1, 3)}
    seen = set()
    while (refusal := refusal_of(data)) is not None:
        assert (refusal.field, refusal.limit) not in seen
        seen.add((refusal.field, refusal.limit))
        if refusal.nearest is None:
            return
        data = put_in(data, refusal.field, refusal.nearest)
    assert [finding for finding in check_moulds(MouldSet(from_data(data))) if not finding.ok] == []
