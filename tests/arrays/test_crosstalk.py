"""Crosstalk of arrays: every pair by the solver alone, sums by hand, figures known before, files and pictures."""

import csv
import io
import json
import math
from xml.etree import ElementTree

import numpy as np
import pytest

from unitcad.arrays.array_file import load_array
from unitcad.arrays.circuit import outline
from unitcad.arrays.crosstalk import (
    crosstalk,
    crosstalk_csv,
    crosstalk_lines,
    distances,
    heat_map_svg,
    patch_map_svg,
)
from unitcad.attenuation import UniformDisc
from unitcad.attenuation.curve import crosstalk_ratio
from unitcad.attenuation.inputs import tissue_medium
from unitcad.estimate_inputs import answer_spec, estimate_input

UNIT = {"like": "encapsulating", "fpcb": {"tail_length_mm": 1.0}}


def array(layout, **tables):
    return load_array({"name": "test", "array": "pockets", "unit": UNIT, "layout": layout} | tables)


def grid(columns, rows, pitch, **tables):
    return array({"kind": "grid", "columns": columns, "rows": rows, "pitch_mm": pitch}, **tables)


NINE = grid(3, 3, 20.0)
DATA = crosstalk(NINE)


def scattered(drive):
    """Five units at random, two of them of other kinds, all with motors of that drive."""
    rng, points = np.random.default_rng(2), []
    while len(points) < 5:
        at = rng.uniform(0, 60, 2).tolist()
        if all(math.dist(at, known) > 19.0 for known in points):
            points.append(at)
    others = {"P2": "motor-10mm", "P5": "single-embedded"}
    driven = {**UNIT, "motor": {"drive": drive}}
    place = [{"at": at, "unit": {**driven, "like": like}} for at, like in others.items()]
    return array({"kind": "list", "points_mm": points}, unit=driven, place=place, sheet={"thickness_mm": 1.5})


def test_every_pair_is_what_the_solver_gives_it_alone():
    """The motion as a vector: two forces in quadrature along x and y, each component in Cartesian axes."""
    for drive in ("flat", "axial"):
        made = scattered(drive)
        matrix, rows = crosstalk(made)["matrix"], csv.DictReader(io.StringIO(crosstalk_csv(made).decode()))
        edges = {(row["from"], row["to"]): float(row["edge"]) for row in rows}
        for i, one in enumerate(made.places):
            variant = estimate_input(one.unit)
            medium, omega = tissue_medium(variant.tissue), 2 * np.pi * variant.frequency.middle
            for j, to in enumerate(made.places):
                if i == j:
                    assert matrix[i][j] is None
                    continue
                dx, dy = to.x - one.x, to.y - one.y
                away, theta = math.hypot(dx, dy), math.atan2(dy, dx)
                reached = {away: matrix[i][j], away - to.unit.diameter_mm / 2: edges[one.name, to.name]}
                for r, value in reached.items():
                    size = []
                    for at in (r, variant.diameter * 500):
                        load_ = UniformDisc(variant.motor_diameter / 2, "tangential" if drive == "flat" else "normal")
                        found = medium.response(load_, omega, 1e-3 * at, rtol=1e-5)
                        if drive == "axial":
                            size.append(math.sqrt(abs(found.u_r) ** 2 + abs(found.u_z) ** 2))
                            continue
                        u = np.zeros(3, complex)
                        for phase, axis in ((1.0, 0.0), (-1j, math.pi / 2)):
                            c, s = math.cos(theta - axis), math.sin(theta - axis)
                            out, round_, up = found.u_r * c, found.u_theta * s, found.u_z * c
                            u += phase * np.array(
                                [
                                    out * math.cos(theta) - round_ * math.sin(theta),
                                    out * math.sin(theta) + round_ * math.cos(theta),
                                    up,
                                ]
                            )
                        size.append(float(np.linalg.norm(u)))
                    assert value == pytest.approx(size[0] / size[1], abs=1e-3)


def test_the_middle_of_ten_by_ten_gets_the_most():
    data = crosstalk(grid(10, 10, 16.0))
    assert data["places"][0]["frequency_hz"] == 125
    assert data["worst"]["place"] == "E5"


def test_sums_are_those_of_the_matrix():
    matrix = np.array(DATA["matrix"], float)
    for j in range(9):
        column = [matrix[i, j] for i in range(9) if i != j]
        assert DATA["sums"]["sum"][j] == pytest.approx(sum(column), abs=1e-5)
        root = math.sqrt(sum(value**2 for value in column))
        assert DATA["sums"]["root_sum_of_squares"][j] == pytest.approx(root, abs=1e-5)
    assert DATA["worst"]["place"] == "B2"
    assert DATA["worst"]["sum"]["value"] == DATA["sums"]["sum"][4]


def test_the_nearest_neighbour_is_the_ratio_of_two_units_with_its_range():
    alone = crosstalk_ratio(estimate_input(NINE.unit), 20e-3)
    nearest = DATA["nearest"]
    assert nearest["distance_mm"] == 20
    assert nearest["centre"]["value"] == pytest.approx(alone.middle, abs=1e-6)
    assert nearest["centre"]["low"] == pytest.approx(alone.ends[0], abs=1e-6)
    assert nearest["centre"]["high"] == pytest.approx(alone.ends[1], abs=1e-6)
    assert nearest["centre"]["value"] < nearest["nearest_edge"]["value"] < 1


def test_absolute_values_are_only_a_range():
    answer = answer_spec(NINE.unit)
    absolute = DATA["absolute"]
    assert set(absolute["sum"]) == {"low", "high"}
    for key in ("sum", "root_sum_of_squares"):
        worst = DATA["worst"][key]
        expected = {"low": answer.low * worst["low"], "high": answer.high * worst["high"]}
        assert absolute[key] == pytest.approx(expected, rel=1e-3)


def test_round_a_limb_distances_are_arcs_and_the_ends_of_a_ring_are_neighbours():
    ring = array({"kind": "ring", "count": 8}, limb={"radius_mm": 40.0})
    arc = 2 * math.pi * 40 / 8
    found = distances(ring)[0]
    assert found[0, 7] == pytest.approx(arc, abs=2e-3)
    assert found[0, 4] == pytest.approx(4 * arc, abs=2e-3)
    assert found.max() <= math.pi * 40 + 1e-3
    assert "arc" in crosstalk(ring)["distances"]


def test_a_single_unit_has_no_neighbour():
    single = grid(1, 1, 20.0)
    data = crosstalk(single)
    assert data["nearest"] is None
    assert data["worst"]["sum"]["value"] == 0
    json.dumps(data, allow_nan=False)
    for svg in (heat_map_svg(data), patch_map_svg(single, data)):
        assert "A1" in svg
        assert "nan" not in svg


def test_the_table_holds_the_matrix():
    rows = list(csv.DictReader(io.StringIO(crosstalk_csv(NINE).decode())))
    assert len(rows) == 72
    names = [place["name"] for place in DATA["places"]]
    for row in rows:
        i, j = names.index(row["from"]), names.index(row["to"])
        assert float(row["centre"]) == DATA["matrix"][i][j]
        assert float(row["centre"]) < float(row["edge"]) < 1
    assert crosstalk_csv(NINE) == crosstalk_csv(load_array(NINE.asked))


def test_the_heat_map_shows_every_pair_and_the_map_every_unit():
    svg = heat_map_svg(DATA)
    texts = [text.text for text in ElementTree.fromstring(svg).iter("{http://www.w3.org/2000/svg}text")]
    assert texts.count("35") == 24
    assert {"unit that vibrates", "unit that is reached", "A1", "C3"} <= set(texts)
    assert heat_map_svg(crosstalk(load_array(NINE.asked))) == svg
    patch = patch_map_svg(NINE, DATA, outline(NINE))
    drawn = ElementTree.fromstring(patch)
    assert len(list(drawn.iter("{http://www.w3.org/2000/svg}circle"))) == 9
    assert "<title>circuit</title>" in patch


def test_eight_units_round_a_limb_get_alike():
    """Symmetry: what differs is what the centres are rounded to."""
    said = " ".join(crosstalk_lines(crosstalk(load_array("wrist-band"))))
    assert "With all other units on, all get alike: 0.22" in said
