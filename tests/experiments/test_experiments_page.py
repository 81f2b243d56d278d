"""docs/experiments.md holds what its script computes."""

from __future__ import annotations

import importlib.util
import xml.etree.ElementTree as ET
from pathlib import Path
from types import ModuleType

import pytest

from unitcad.experiments.lab_file import load_lab
from unitcad.experiments.range_plot import BELOW, svg
from unitcad.experiments.study import span_text

DOCS = Path(__file__).parents[2] / "docs"


def _make_experiments() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_experiments", DOCS / "make_experiments.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_a_figure_of_the_page_is_what_is_found_again() -> None:
    """Of the prior's row, which needs no unit but its own."""
    pytest.importorskip("skfem")
    make, lab, what = _make_experiments(), load_lab("paper"), "soft inside: on a plate over gel"
    found = make.pooled(lab, None, what).information(make.ROWS[what])
    (row,) = [line for line in (DOCS / "experiments.md").read_text("utf-8").splitlines() if "the prior alone" in line]
    assert row.split(" | ")[1 + list(make.FIGURES).index(what)] == f"{found.bits:.2f} ± {found.error:.2f}"


def test_the_plot_and_the_tables_are_there() -> None:
    page = (DOCS / "experiments.md").read_text("utf-8")
    assert "experiments-ranges.svg" in page
    assert ET.parse(DOCS / "experiments-ranges.svg").getroot().tag.endswith("svg")
    assert page.count("<!-- computed:") == page.count("<!-- end -->") == 4
    assert "-->\n<!-- end" not in page


def test_the_plot_draws_what_the_table_says() -> None:
    """A prediction of which half or more can't be read has words in the plot, no bar, and does not widen the axis."""
    known = {"low": 0.5, "middle": 0.7, "high": 0.9, "unread": 0.2}
    unread = {"low": 1e-6, "middle": 1.0, "high": 1.0, "unread": 0.5}
    one = {"experiment": "A over B", "bits": 1.0, "error": 0.1, "predicted": {"bush": known, "elements": unread}}
    picture = svg([one], ["bush", "elements"])
    assert picture.count(f">{BELOW}<") == 1 == [span_text(span) for span in (known, unread)].count(BELOW)
    assert picture.count('fill-opacity="0.45"') == 1
    assert ">0.01<" not in picture
    empty = svg([{**one, "predicted": {"elements": unread}}], ["elements"])
    assert empty.count(BELOW) == 1
    assert ">1<" in empty
