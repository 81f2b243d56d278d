"""docs/model.md holds what its script computes."""

import importlib.util
import re
import xml.etree.ElementTree as ET
from pathlib import Path

import numpy as np
import pytest

from unitcad.attenuation import HalfSpace, KelvinVoigt, Layer, LayeredMedium, LossFactor, Point

DOCS = Path(__file__).parents[2] / "docs"


def _script():
    found = importlib.util.spec_from_file_location("make_model", DOCS / "make_model.py")
    assert found
    assert found.loader
    module = importlib.util.module_from_spec(found)
    found.loader.exec_module(module)
    return module


def test_tables_are_the_computed_ones():
    page = (DOCS / "model.md").read_text("utf-8")
    assert _script().filled(page) == page
    assert "validated" not in page.lower()


def test_plots_are_drawn():
    for name in ("contrast", "decay"):
        file = DOCS / f"model-{name}.svg"
        assert file.name in (DOCS / "model.md").read_text("utf-8")
        assert ET.parse(file).getroot().tag.endswith("svg")


def test_what_a_nearly_fluid_film_leaves_is_as_the_page_says():
    page = " ".join((DOCS / "model.md").read_text("utf-8").split())
    said = re.search(r"A nearly fluid film .*? reaches between \S+ and (\S+) of the largest", page)
    assert said
    layers = [
        Layer(1e-4, 1000, 1e-4, 0.4999999, KelvinVoigt(1e-3)),
        Layer(1.5e-3, 1100, 130e3, 0.49, LossFactor(0.14)),
        Layer(4e-3, 950, 9e3, 0.495, KelvinVoigt(3.0)),
        Layer(25e-3, 1050, 12e3, 0.495, KelvinVoigt(4.5)),
    ]
    medium = LayeredMedium(layers, HalfSpace(1900, 15e9, 0.3, LossFactor(0.01)))
    found = medium.response(Point(), 2 * np.pi * 250, [1e-3, 4e-3, 1.2e-2, 4e-2], rtol=1e-4)
    reached = found.error / max(np.max(abs(found.u_r)), np.max(abs(found.u_z)))
    assert reached == pytest.approx(float(said[1]), rel=0.3)
