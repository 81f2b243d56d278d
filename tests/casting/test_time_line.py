"""The time line: sums by hand, phases one after the other, cures that follow the room."""

from dataclasses import asdict

import pytest

from unitcad.casting.procedure import procedure
from unitcad.casting.steps import BenchStep, casting_summary, duration, phases
from unitcad.moulds.mould_set import MouldSet
from unitcad.validation import load


def casting(*source):
    moulds = MouldSet(load(source[0], list(source[1:])))
    return procedure(moulds, [100.0] * len(moulds.plan.steps), 1000.0)


def test_a_cure_ends_a_phase_and_a_rest_does_not():
    steps = [
        BenchStep("a", "", kind="pour", minutes=3),
        BenchStep("b", "", kind="rest", minutes=1, wait_min=9),
        BenchStep("c", "", kind="cure", wait_min=60),
        BenchStep("d", "", minutes=2),
    ]
    first, opened, last = phases([("pour 1", steps), ("out", [BenchStep("e", "", minutes=4)])])
    assert (first.name, first.start_min, first.bench_min, first.wait_min, first.end_min) == ("pour 1", 0, 4, 69, 73)
    assert (opened.name, opened.start_min, opened.end_min) == ("pour 1: open", 73, 75)
    assert (last.name, last.start_min, last.end_min) == ("out", 75, 79)


def test_the_earliest_finish_holds_both_cures_and_the_bench():
    """Ecoflex 00-10 cures in 4 h, Dragon Skin 30 in 16 h, and each pour is struck again after 10 min."""
    made = casting("encapsulating")
    assert made.earliest_finish_min == pytest.approx(20 * 60 + 2 * 9 + made.bench_min)
    steps = [*made.preparation, *(step for pour in made.pours for step in pour.steps), *made.release]
    assert made.earliest_finish_min == pytest.approx(sum(step.minutes + step.wait_min for step in steps))
    assert 60 < made.bench_min < 120
    assert made.time_line[-1].name == "motor in"
    for one, other in zip(made.time_line, made.time_line[1:], strict=False):
        assert other.start_min == pytest.approx(one.end_min)


def test_a_warmer_room_is_done_sooner():
    """Ten kelvin more: half the cure, the same bench."""
    cold, warm = casting("encapsulating"), casting("encapsulating", "casting.room_c=33")
    assert warm.bench_min == cold.bench_min
    assert cold.earliest_finish_min - warm.earliest_finish_min == pytest.approx(600)


def test_preparation_counts_the_bake_and_the_test_of_the_cure():
    """In resin 8 h in the oven, then the longest cure of the silicones, before the first pour begins."""
    made = casting("three-layer", "moulds.printer=sla")
    longest = max(pour.cure_h for pour in made.pours)
    first = next(phase for phase in made.time_line if phase.name == "pour 1")
    assert first.start_min > 60 * (8 + longest)
    assert made.time_line[0].name == "preparation"
    assert made.time_line[0].start_min == 0


def test_a_gang_takes_longer_at_the_bench():
    """Four cavities are wiped, greased, pulled and peeled one by one; a mix is weighed once."""
    one, four = casting("encapsulating"), casting("encapsulating", "moulds.cavities=[2,2]")
    minutes = {step.title: step.minutes for step in four.pours[1].steps}
    for step in one.pours[1].steps:
        times = {"Tongue home": 4, "Wipe Layer 1": 4, "Tongue out FIRST": 4, "Weigh": 1, "Cup 2 off": 1}
        if step.title in times:
            assert minutes[step.title] == times[step.title] * step.minutes, step.title
    assert len([step for step in four.assembly if step.title.startswith("Motor in, ")]) == 2
    assert four.bench_min > 1.5 * one.bench_min


def test_bubbles_rise_in_the_mould_before_it_is_struck_off():
    """Ecoflex 00-30 without a vacuum rises in time; Ecoflex 00-10 does not, and is brushed on before it is poured."""
    for name, order in {
        "ecoflex-00-30": ["Mix", "Pour", "Let bubbles rise", "Strike off"],
        "ecoflex-00-10": ["Mix", "Brush a first coat", "Pour", "Strike off"],
    }.items():
        made = casting("encapsulating", f"layers.0.material={name}", "casting.vacuum=false")
        titles = [step.title for step in made.pours[0].steps]
        at = titles.index("Mix")
        assert titles[at : at + 4] == order
        assert all(step.minutes or step.wait_min for step in made.pours[0].steps)


@pytest.mark.parametrize(
    ("minutes", "text"),
    [
        (0, "0 min"),
        (59.6, "1 h"),
        (1240, "20 h 40 min"),
        (60, "1 h"),
        (7, "7 min"),
        (48 * 60, "48 h"),
        (48 * 60 + 1, "2 days"),
        (60 * 1146 + 6, "47 days 18 h"),
    ],
)
def test_durations_in_words(minutes, text):
    assert duration(minutes) == text


def test_the_summary_names_the_pours_whose_bubbles_stay():
    """Ecoflex 00-10 and Dragon Skin 30 as the verdicts of their pours have it; nothing is said with a vacuum."""
    made = casting("encapsulating", "casting.vacuum=false")
    *_, last = casting_summary(asdict(made))
    stay = [pour for pour in made.pours if "Such bubbles stay" in pour.verdict]
    assert stay
    assert last.startswith("warning: without a vacuum bubbles stay in pour ")
    assert all(f"pour {pour.index} ({pour.material})" in last for pour in stay)
    lines = list(casting_summary(asdict(casting("encapsulating"))))
    assert lines[0].startswith("print moulds/moulds.3mf: layers 0.2, first layer 0.2 mm; about ")
    assert lines[0].endswith(". Mix 2 g of ecoflex-00-10, 2 g of dragon-skin-30.")
    assert " at the bench. Out of the mould " in lines[1]
    assert len(lines) == 2


@pytest.mark.parametrize(
    ("files", "named"),
    [
        (["moulds/base.stl", "moulds/moulds.3mf"], "moulds/moulds.3mf"),
        (["moulds/base.stl"], "each STL of moulds/ (no 3MF was asked for)"),
        (["casting.md"], "moulds/moulds.3mf"),
    ],
)
def test_the_summary_names_files_that_were_made(files, named):
    first, *_ = casting_summary(asdict(casting("encapsulating")), files)
    assert first.startswith(f"print {named}: layers 0.2")
