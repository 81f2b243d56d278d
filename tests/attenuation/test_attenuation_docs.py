"""docs/model.md holds what its script computes."""

import importlib.util
import xml.etree.ElementTree as ET
from pathlib import Path

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
