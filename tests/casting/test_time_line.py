"""The time line: sums by hand, phases one after the other, cures that follow the room."""

from __future__ import annotations

import pytest

from unitcad.casting.bench_step import BenchStep
from unitcad.casting.procedure import Procedure, procedure
from unitcad.casting.time_line import duration, phases
from unitcad.moulds.mould_set import MouldSet
from unitcad.validation import load


def casting(*source: str) -> Procedure:
    moulds = MouldSet(load(source[0], list(source[1:])))
    return procedure(moulds, [100.0] * len(moulds.plan.steps), 1000.0)


def test_a_cure_ends_a_phase_and_a_rest_does_not() -> None:
    steps = [
        BenchStep("a", "", minutes=3),
        BenchStep("b", "", kind="rest", minutes=1, wait_min=9),
        BenchStep("c", "", kind="cure", wait_min=60),
        BenchStep("d", "", minutes=2),
    ]
    first, opened, last = phases([("pour 1", steps), ("out", [BenchStep("e", "", minutes=4)])])
    assert (first.name, first.start_min, first.bench_min, first.wait_min, first.end_min) == ("pour 1", 0, 4, 69, 73)
    assert (opened.name, opened.start_min, opened.end_min) == ("pour 1: open", 73, 75)
    assert (last.name, last.start_min, last.end_min) == ("out", 75, 79)


def test_the_earliest_finish_holds_both_cures_and_the_bench() -> None:
    """Ecoflex 00-10 cures in 4 h, Dragon Skin 30 in 16 h, and each pour is struck again after 10 min."""
    made = casting("encapsulating")
    assert made.earliest_finish_min == pytest.approx(20 * 60 + 2 * 9 + made.bench_min)
    steps = [*(step for pour in made.pours for step in pour.steps), *made.release]
    assert made.earliest_finish_min == pytest.approx(sum(step.minutes + step.wait_min for step in steps))
    assert 30 < made.bench_min < 90
    assert made.time_line[-1].name == "motor in"
    for one, other in zip(made.time_line, made.time_line[1:], strict=False):
        assert other.start_min == pytest.approx(one.end_min)


def test_a_warmer_room_is_done_sooner() -> None:
    """Ten kelvin more: half the cure, the same bench."""
    cold, warm = casting("encapsulating"), casting("encapsulating", "casting.room_c=33")
    assert warm.bench_min == cold.bench_min
    assert cold.earliest_finish_min - warm.earliest_finish_min == pytest.approx(600)


@pytest.mark.parametrize(
    ("minutes", "text"), [(0, "0 min"), (59.6, "1 h"), (1240, "20 h 40 min"), (60, "1 h"), (7, "7 min")]
)
def test_durations_in_words(minutes: float, text: str) -> None:
    assert duration(minutes) == text
