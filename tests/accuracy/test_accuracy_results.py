"""Suites' results: promises, frontier, page, plots, timing; and the command's exit codes."""

import json
import math
import re
import time
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.accuracy import runner
from benchmarks.accuracy.answers import answer, question
from benchmarks.accuracy.command import accuracy
from benchmarks.accuracy.pages import front, markdown
from benchmarks.accuracy.plot import svg
from benchmarks.accuracy.result import (
    Plot,
    Promise,
    Result,
    Table,
    fastest,
    frontier,
    kept,
    shown,
)
from unitcad.accuracy.measurements import PROCESSOR, interleaved, timing
from unitcad.errors import UnitcadError

RESULT = Result(
    "stability",
    "Stability",
    "Text.",
    (Table("t", ("a", "b"), (("x", 1.5), ("y", None), ("z", math.inf))),),
    (Plot("p", "s", "e", {"one": ((1e-3, 1e-2), (1e-1, 1e-4), (0.0, 1.0))}, curves=("one",), linear_x=True),),
    (Promise("kept", 1e-14, 1e-13), Promise("broken", math.nan, 1.0)),
    {"cores": 2},
    "--specs 9",
)
STORED = runner.read(Path(__file__).parents[2] / "docs" / "evidence")


def test_a_promise_is_kept_up_to_its_limit_and_never_by_nan():
    assert Promise("", 1.0, 1.0).ok
    assert not Promise("", 1.1, 1.0).ok
    assert not Promise("", math.nan, 1.0).ok
    assert not RESULT.ok


def test_fastest_of_what_is_exact_enough():
    points = [("quick", 1.0, 0.1), ("slow", 9.0, 1e-9), ("middle", 2.0, 1e-3), ("lost", 0.5, math.nan)]
    assert [fastest(points, error) for error in (0.1, 1e-2, 1e-6, 1e-12)] == ["quick", "middle", "slow", None]


def test_frontier_is_what_no_other_point_beats():
    assert frontier([(1, 1), (2, 0.5), (3, 0.6), (0.5, 2), (1, 1)]) == [True, True, False, True, True]
    assert frontier([(1, math.nan), (1, 1)]) == [False, True]


def test_the_page_names_command_and_machine():
    text = markdown(RESULT, ["p.svg"])
    assert "`python -m benchmarks.accuracy stability --specs 9`; measured on: cores 2." in text
    assert "| y | - |" in text
    assert "2 promises, **1 broken**." in text
    assert "| broken | nan | 1 |" in text
    assert "| kept |" not in text


def test_promises_are_a_line_with_the_tightest():
    promises = [Promise("none", 0, 0), Promise("loose", 0.1, 1.0), Promise("tight", 0.09, 0.1)]
    assert kept(promises) == "3 promises, all kept; the tightest: tight (0.09, limit 0.1)"
    assert kept(promises[:1]) == "1 promise, all kept"


def test_results_survive_the_file_and_suites_are_merged(tmp_path):
    runner.write([RESULT], tmp_path)
    other = Result("moulds", "Mould checks", "More.")
    runner.write([other], tmp_path)
    there = runner.read(tmp_path)
    assert [r.suite for r in there] == ["moulds", "stability"]
    assert markdown(there[1], ["p.svg"]) == markdown(RESULT, ["p.svg"])
    assert there[1].plots == RESULT.plots
    assert (tmp_path / "accuracy" / "moulds.md").read_text() == markdown(other, [])
    assert (tmp_path / "accuracy" / "stability-1.svg").is_file()
    runner.write([replace(RESULT, plots=())], tmp_path)
    assert not (tmp_path / "accuracy" / "stability-1.svg").exists()
    (tmp_path / "accuracy.json").write_text("{}")
    with pytest.raises(UnitcadError, match="not a result"):
        runner.read(tmp_path)


def test_the_stored_results_are_read_and_a_cell_of_another_type_is_not_written(tmp_path):
    assert len(STORED) > 5
    with pytest.raises(TypeError, match="Table t"):
        replace(RESULT, tables=(Table("t", ("a",), ((True,),)),)).as_dict()


def test_the_front_page_is_one_screen_with_a_line_for_every_suite():
    text = front(STORED)
    assert text.count("](accuracy/") == len(STORED)
    assert len(text.split()) < 500
    assert all(f"[{question(result)}](accuracy/{result.suite}.md) | {answer(result)}" in text for result in STORED)


def test_a_page_shows_question_answer_plot_and_table_and_folds_the_rest():
    for result in STORED:
        names = [f"{i}.svg" for i in range(len(result.plots))]
        text = markdown(result, names)
        shown_part, _, folded = text.partition('<details markdown="1">')
        assert shown_part.splitlines()[2].startswith(f"**{question(result)}** "), result.suite
        assert re.search(r"\d", answer(result)), result.suite
        assert shown_part.count("![") == min(1, len(result.plots))
        assert shown_part.count("\n| --- |") + shown_part.count("```text") == min(1, len(result.tables))
        assert result.text in folded
        assert all(f"({name})" in text for name in names)
        assert all(table.title in text for table in result.tables)
        assert len(re.sub(r"(?m)^\|.*$", "", shown_part).split()) < 80


def test_the_worst_case_on_the_front_page_is_that_of_every_table_of_its_page():
    """The Hankel line once said 0.20 of a bound where its page had 0.306."""
    (hankel,) = (result for result in STORED if result.suite == "hankel")
    over = [
        float(row[table.columns.index("over its bound")])
        for table in hankel.tables
        if "over its bound" in table.columns
        for row in table.rows
    ]
    over += [
        row[2] / max(row[3], 2e-13)
        for table in hankel.tables
        if "its own estimate" in table.columns
        for row in table.rows
        if row[0] == "unitcad"
    ]
    said = re.search(r"([\d.]+) of its bound", hankel.summary.worst)
    assert said
    assert float(said[1]) == pytest.approx(max(over), abs=0.006)


@pytest.mark.parametrize(
    ("suite", "options", "named"),
    [
        ("stability", {"specs": 10}, "'extremes'"),
        ("hankel", {"media": 600}, "'stability'"),
        ("stability", {"seed": 7}, "--media"),
        ("stability", {"quick": True, "media": 600}, "--quick"),
        ("extremes", {"quick": True, "specs": 10}, "--quick"),
        ("Left_Out", {"quick": True}, "closest: left-out; nearest accepted: 'left-out'"),
        ("stability", {"quick": True, "out": "file"}, "no folder that can be written"),
        ("stability", {"quick": True, "out": "damaged"}, "not a result"),
    ],
)
def test_a_bad_option_or_folder_is_refused_before_the_work(suite, options, named, tmp_path, monkeypatch):
    monkeypatch.setattr(runner, "run", lambda *_: pytest.fail("worked"))
    (tmp_path / "file").touch()
    (tmp_path / "damaged").mkdir()
    (tmp_path / "damaged" / "accuracy.json").write_text("{")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UnitcadError, match=named):
        accuracy([suite], **{name: Path(value) if name == "out" else value for name, value in options.items()})


def test_plots_repeat_and_leave_out_what_has_no_logarithm():
    assert svg(RESULT.plots[0]) == svg(RESULT.plots[0])
    assert svg(replace(RESULT.plots[0], curves=(), linear_x=False)).count('r="3.5"') == 2
    assert "&lt;b&gt;" in svg(Plot("<b>", "", "", {}))


def test_timing_is_interleaved_and_shows_its_spread():
    order = []
    times = interleaved({"a": lambda: order.append("a"), "b": lambda: (order.append("b"), time.sleep(0.002))}, 3)
    assert order == ["a", "b"] * 4
    assert times["b"].median >= 0.002
    waited = interleaved({"b": lambda: time.sleep(0.02)}, 3, clock=PROCESSOR)
    assert waited["b"].median < 0.01
    assert str(timing([1.0, 2.0, 3.0])) == "2 s (1.5 s to 2.5 s)"
    assert shown(1.23456e-7) == "1.2e-07"


def test_the_command_fails_on_a_broken_promise_alone(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(runner, "run", lambda *_: RESULT)
    with pytest.raises(SystemExit) as stopped:
        accuracy(["stability"], quick=True, specs=None, out=tmp_path, as_json=True)
    assert stopped.value.code == 1
    printed = capsys.readouterr()
    assert json.loads(printed.out)["suites"][0]["promises"][1]["value"] is None
    assert "broken: nan, promised 1" in printed.err


def test_curves_have_no_points_and_a_linear_axis_shows_zero():
    series = {"model": ((0.0, 1.0), (15.0, 0.1), (30.0, 0.01)), "measured": ((10.0, 0.2),)}
    text = svg(Plot("decay", "mm", "", series, lines=False, curves=("model",), linear_x=True))
    assert text.count("<circle") == 2  # the measured point and its legend
    assert 'points="70.0,36.0 300.0,212.0 530.0,388.0"' in text
    assert text.count("<polyline") == 1
    assert ">5<" in text
    assert ">30<" in text
