"""The page's paragraph follows from levels, the units' table shows a control's shapes, markers and legends are seen."""

import math
import re
from pathlib import Path

import pytest

from benchmarks.accuracy.level_scores import RANGE_HOLDS
from benchmarks.accuracy.runner import read
from benchmarks.accuracy.unexplained import NineLevels, unexplained
from unitcad.attenuation.edge.measured import measured_table
from unitcad.attenuation.edge.scoring import assessments

EVIDENCE = Path(__file__).parents[2] / "docs" / "evidence"
NAMES = measured_table().names


def levels(change=None):
    """A level of 0.5 everywhere but where `change` has another; controls in two shapes a factor of 4 apart."""
    flat = {
        name: {"embedded": 1.0, "encapsulating": 0.25} if name.startswith("single") else {name.split(" ")[0]: 0.5}
        for name in NAMES
    }
    return NineLevels({**flat, **(change or {})})


def said(drawn, bare):
    return unexplained(measured_table(), {"drawn": drawn, "bare": bare}, {}, assessments()["published"])


def test_a_control_is_the_geometric_mean_of_its_shapes_and_shows_both():
    assert levels().of("single E10") == pytest.approx(math.sqrt(1.0 * 0.25), rel=1e-15)
    assert levels().shown("single E10") == "0.500 (1.000 embedded, 0.250 encapsulating)"
    assert levels().shown("embedded D10/E10") == "0.500"


def test_ranges_are_of_single_units_and_of_both_variants():
    text = said(levels(), levels({"embedded D10/E10": {"embedded": 0.125}}))
    assert "0.25 to 1.00 (drawn), 0.12 to 1.00 (bare)" in text
    assert "up to 0.25 times what it was (embedded D10/E10)" in text
    assert "soft layer inside were measured at 0.04 to 0.16" in text
    assert "1/14 to 1/67 of a shear wavelength" in text
    assert "must be" not in text


def test_who_gives_the_measured_orders_is_found_and_a_tie_is_no_order():
    assert said(levels(), levels()).count("is given by nothing here") == 3
    above = levels({"embedded E10/D30": {"embedded": 0.6}})
    text = said(levels(), above)
    assert "embedded E10/D30 above E10/D10, as was measured, is given by bare." in text
    assert "encapsulating E10/D30 above E10/D10, as was measured, is given by nothing here." in text
    measured = dict(zip(NAMES, measured_table().levels, strict=True))
    ordered = NineLevels({name: {"": float(level)} for name, level in measured.items()})
    solved = {"drawn": levels(), "bare": levels()}
    text = unexplained(measured_table(), solved, {"table": ordered}, assessments()["published"])
    assert "D10 < E10 < D30, is given by table." in text
    assert text.count("is given by table.") == 3


def test_the_estimates_page_says_how_often_the_range_misses():
    """By the suite's stored result: a range of 90 % that holds in fewer tables is said so where it stands."""
    (models,) = (one for one in read(EVIDENCE) if one.suite == "models")
    (holds,) = (row[1] for table in models.tables for row in table.rows if row[0].endswith("holds the truth's score"))
    page = (EVIDENCE.parent / "explanation" / "estimate.md").read_text("utf-8")
    assert page.count(f"{100 * (1 - holds):.0f} % of them, not in 10 %") == 1
    assert holds >= RANGE_HOLDS


def test_the_page_says_what_fills_the_space_of_a_left_out_circuit():
    page = (EVIDENCE / "accuracy" / "models.md").read_text("utf-8")
    assert re.search(r"Without the circuit Layer 1 (now )?fills the space between motor and cap", page)
