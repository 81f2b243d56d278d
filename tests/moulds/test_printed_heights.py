"""Heights as printed: against meshes that are cut at the middle of each layer, as a slicer does."""

from pathlib import Path

import numpy as np
import pytest
from faulty_sets import set_of
from manifold3d import CrossSection

from unitcad.casting import preparation
from unitcad.checks import mould_checks
from unitcad.errors import UnitcadError
from unitcad.kernels.mesh import bounds
from unitcad.moulds.heights import height_warnings, unit_heights
from unitcad.pipeline.summary import unit_summary
from unitcad.spec.layers import Layers
from unitcad.validation import load

COARSE = "moulds.first_layer_mm=0.3"


def ends(first, height, most):
    """Return the end of each layer up to a height, and the middle at which a slicer cuts it."""
    tops = first + height * np.arange(int(most / height) + 2)
    return [(top, top - (first if i == 0 else height) / 2) for i, top in enumerate(tops)]


@pytest.mark.parametrize(("first", "height"), [(0.2, 0.2), (0.3, 0.2), (0.35, 0.25), (0.2, 0.1)])
def test_a_height_is_the_end_of_the_last_layer_whose_middle_it_covers(first, height):
    layers = Layers(first, height)
    for solid in np.random.default_rng(7).uniform(0.2, 9.0, 300):
        sliced = max((top for top, middle in ends(first, height, solid) if middle <= solid), default=0.0)
        assert layers.printed(solid) == pytest.approx(sliced, abs=1e-9)
        assert layers.down(solid) <= solid + 1e-9
        assert solid <= layers.up(solid) + 1e-9


def sliced(moulds, name, x, y):
    """Return how high a tool is printed at a place, over its bed, by cutting its mesh as it lies on the bed."""
    solid = moulds.solids[name]
    if moulds.plan.tool(name).upside_down:
        solid = solid.rotate((180, 0, 0))
        y = -y
    low, high = bounds(solid)[2], bounds(solid)[5]
    lengths, found = moulds.spec.moulds, 0.0
    for top, middle in ends(lengths.first_layer_mm, lengths.layer_mm, high - low):
        spot = CrossSection.square((0.02, 0.02), True).translate((x, y))
        if not (solid.slice(low + middle) ^ spot).is_empty():
            found = top
    return found


@pytest.mark.parametrize("given", [(), (COARSE,), ("moulds.first_layer_mm=0.35",), ("moulds.layer_mm=0.25",)])
def test_cavity_and_caps_are_those_of_the_sliced_meshes(given):
    """The seat lies beside the core, the rim of a cup beside its bore: both are read off the printed layers."""
    moulds = set_of("encapsulating", *given)
    dims = moulds.plan.dimensions
    core, seat = sliced(moulds, "base", 2.0, 1.0), sliced(moulds, "base", 0.0, dims.radii[0] - 0.3)
    heights = {each.what: each.printed_mm for each in unit_heights(moulds)}
    assert heights["cavity"] == pytest.approx(core - seat, abs=1e-3)
    land = moulds.spec.moulds.land_mm / 2
    rims = [sliced(moulds, f"cup{i + 1}", 0.0, radius + land) for i, radius in enumerate(dims.radii)]
    assert heights["height over all"] == pytest.approx(
        heights["cavity"] + heights["layer 1's cap"] + heights["layer 2's cap"]
    )
    assert rims[1] - rims[0] == pytest.approx(heights["layer 2's cap"], abs=1e-3)


def test_motor_and_circuit_fit_with_a_thick_first_layer():
    """Drawn for layers of 0.2 throughout, a first layer of 0.3 made the cavity 2.0 mm for 2.11."""
    for first in (0.2, 0.3, 0.35):
        cavity = unit_heights(set_of("encapsulating", f"moulds.first_layer_mm={first}"))[0]
        assert cavity.printed_mm >= cavity.asked_mm - 0.05, first


def test_a_height_more_than_5_percent_off_is_said_with_layers_that_print_right():
    moulds = set_of("encapsulating", "moulds.layer_mm=0.25")
    (said,) = height_warnings(moulds)
    assert said.startswith("cavity comes out 2.25 mm for 2.11 (6.6 %)")
    better = said.split("moulds.layer_mm = ")[1].split()[0]
    assert height_warnings(set_of("encapsulating", f"moulds.layer_mm={better}")) == []
    found = {finding.where: finding for finding in mould_checks()["C260"].findings(moulds)}
    assert found["cavity"].ok  # a warning, no failure
    assert found["cavity"].advice == said
    assert found["cavity"].value == pytest.approx(100 * (2.25 / 2.11 - 1))
    assert not found["layer 1's cap"].advice


def test_a_cap_that_would_print_right_is_named():
    (said,) = (each for each in height_warnings(set_of("no-fpcb", "layers.1.cap_mm=0.7")) if "layer 2's cap" in each)
    cap = float(said.split("layers.1.cap_mm = ")[1].split()[0])
    assert height_warnings(set_of("no-fpcb", f"layers.1.cap_mm={cap}")) == []


def test_a_film_over_an_open_ring_is_said():
    off = set_of("embedded", "moulds.first_layer_mm=0.35", "moulds.layer_mm=0.25")  # no seat or rim is on its layers
    (said,) = (each for each in height_warnings(off) if "film" in each)
    assert "moulds.first_layer_mm = 0.25" in said
    assert not any("film" in each for each in height_warnings(set_of("embedded", COARSE)))
    assert height_warnings(set_of("embedded")) == []


def test_the_first_layer_stands_beside_the_layers():
    moulds = set_of("encapsulating", COARSE)
    assert preparation.print_description(moulds).startswith("Print in this attitude: layers 0.2, first layer 0.3 mm; ")


@pytest.mark.parametrize(("given", "line"), [((), "4.6 mm high (drawn 4.61), caps 1.2 and 1.2"), (
    ("moulds.first_layer_mm=0.35",), "4.55 mm high (drawn 4.61), caps 1.15 and 1.2")])  # fmt: skip
def test_the_terminal_says_the_heights_that_the_printer_makes(given, line):
    moulds = set_of("encapsulating", *given)
    manifest = {"outputs": ["unit", "moulds"], "casting": None, "estimate": None, "mould_checks": [], "steps": [],
        "parts": [{"role": "unit", "made": "cast", "bbox_mm": [-7, -7, 0, 7, 7, 4.61], "name": "layer1", "material": None}],
        "name": "one", "check": {"errors": 0, "warnings": 0, "findings": []}}  # fmt: skip
    first = next(unit_summary(moulds, Path("none"), manifest))
    assert line in first, "without a casting too"


def test_a_first_layer_of_nothing_is_refused():
    with pytest.raises(UnitcadError, match="first_layer_mm"):
        load("encapsulating", ["moulds.first_layer_mm=0"])
