"""Charts: well-formed, values at their places on linear and logarithmic axes, the same data the same bytes."""

import math
import xml.etree.ElementTree as ET

import pytest

from unitcad.export.chart import HEIGHT, LEFT, RIGHT, TOP, WIDTH, Series, chart

SVG = "{http://www.w3.org/2000/svg}"


@pytest.mark.parametrize("log", [False, True])
def test_a_value_lies_between_the_ticks_round_it(log):
    text = chart([Series("a & b", [1, 10, 100], [3, 30, 50], points=True)], "t", "x", "y <1>", log, log)
    root = ET.fromstring(text)
    labels = {
        t.text: float(t.get("x", "nan"))
        for t in root.iter(f"{SVG}text")
        if t.get("text-anchor") == "middle" and t.get("x")
    }
    low, high = ("1", "100") if log else ("0", "100")
    at = float(next(root.iter(f"{SVG}circle")).get("cx", "nan"))
    ten = [float(c.get("cx", "nan")) for c in root.iter(f"{SVG}circle")][1]
    share = (ten - labels[low]) / (labels[high] - labels[low])
    assert share == pytest.approx(0.5 if log else 0.1, abs=0.002)
    assert labels[low] <= at + 0.1
    assert all(LEFT - 0.1 <= float(c.get("cx", "nan")) <= WIDTH - RIGHT + 24 for c in root.iter(f"{SVG}circle"))
    assert text == chart([Series("a & b", [1, 10, 100], [3, 30, 50], points=True)], "t", "x", "y <1>", log, log)


def test_what_an_axis_can_not_show_is_left_out():
    text = chart([Series("s", [0, 1, math.nan, 2], [1, 0, 1, 5], points=True)], "t", "x", "y", log_y=True)
    spots = [(float(c.get("cx", "0")), float(c.get("cy", "0"))) for c in ET.fromstring(text).iter(f"{SVG}circle")]
    assert len(spots) == 2 + 2  # two in the legend
    assert all(TOP - 0.1 <= y <= HEIGHT for _, y in spots)
    ET.fromstring(chart([], "empty", "x", "y"))


@pytest.mark.parametrize(("low", "first"), [(-0.001, "0"), (-0.2, "-5")])
def test_an_axis_starts_at_zero_unless_values_are_seen_below_it(low, first):
    text = chart([Series("a", [0, 1], [low, 20])], "t", "x", "y")
    ticks = [t.text for t in ET.fromstring(text).iter(f"{SVG}text") if t.get("text-anchor") == "end"]
    assert ticks[0] == first
