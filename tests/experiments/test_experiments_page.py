"""docs/experiments.md holds what its script computes."""

from __future__ import annotations

import importlib.util
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import pytest

from unitcad.experiments.lab_file import load_lab

DOCS = Path(__file__).parents[2] / "docs"


def _make_experiments() -> ModuleType:
    spec = importlib.util.spec_from_file_location("make_experiments", DOCS / "make_experiments.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_a_row_of_the_page_is_what_is_found_again() -> None:
    pytest.importorskip("skfem")
    make, lab, what = _make_experiments(), load_lab("paper"), "stiff inside: on a plate over gel"
    (ratio,) = make.ROWS[what]
    part = replace(lab, variants={c: lab.variants[c] for c in (ratio.above, ratio.below)})
    row = make.row(what, make.predicted(part))
    assert row in (DOCS / "experiments.md").read_text("utf-8").splitlines()


def test_the_plot_and_the_tables_are_there() -> None:
    page = (DOCS / "experiments.md").read_text("utf-8")
    assert "experiments-ranges.svg" in page
    assert ET.parse(DOCS / "experiments-ranges.svg").getroot().tag.endswith("svg")
    assert page.count("<!-- computed:") == page.count("<!-- end -->") == 3
    assert "-->\n<!-- end" not in page
