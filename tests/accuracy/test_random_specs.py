"""Random specs: exit 0 with every check passed, or a refusal whose nearest value leads on."""

from pathlib import Path

import pytest

from benchmarks.accuracy import extremes
from benchmarks.accuracy.runner import JOURNALS
from unitcad.accuracy.random_specs import DOCUMENTED, Seeded, random_spec, seeded_spec
from unitcad.accuracy.survey import (
    BUILT,
    REFUSED,
    Outcome,
    put_in,
    refusal_of,
)
from unitcad.checks import check_moulds
from unitcad.errors import UnitcadError
from unitcad.moulds.mould_set import MouldSet
from unitcad.validation import from_data


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
