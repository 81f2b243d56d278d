"""Crosstalk of arrays: every pair by the solver alone, sums by hand, figures known before, files and pictures."""

import csv
import io
import json
import math
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from scipy import optimize

from unitcad.arrays.array_file import load_array
from unitcad.arrays.circuit import outline
from unitcad.arrays.crosstalk import (
    crosstalk,
    crosstalk_csv,
    crosstalk_lines,
    distances,
    heat_map_svg,
    patch_map_svg,
    worst_phases,
)
from unitcad.attenuation import LayeredMedium, UniformDisc
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


def test_a_response_that_misses_its_accuracy_is_told_once(monkeypatch):
    assert DATA["not_reached"] == []
    solve = LayeredMedium.response

    def poor(*arguments, **keywords):
        found = solve(*arguments, **keywords)
        return replace(found, error_z=found.error_z + 0.05 * found.largest)

    monkeypatch.setattr(LayeredMedium, "response", poor)
    data = crosstalk(grid(2, 1, 20.0))
    assert data["not_reached"] == ["the error may be 0.05 of the largest motion, 0.001 was wanted"]
    assert data["answer"][-1] == f"A response of the skin does not reach its accuracy: {data['not_reached'][0]}."


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


def test_the_root_of_squares_is_that_of_the_matrix():
    matrix = np.array(DATA["matrix"], float)
    for j in range(9):
        column = [matrix[i, j] for i in range(9) if i != j]
        root = math.sqrt(sum(value**2 for value in column))
        assert DATA["sums"]["root_sum_of_squares"][j] == pytest.approx(root, abs=1e-5)
        assert DATA["sums"]["in_phase"][j] <= DATA["sums"]["worst_phases"][j] <= sum(column) + 1e-5
        assert DATA["sums"]["worst_phases"][j] >= root
    assert DATA["worst"]["place"] == "B2"
    for key in ("in_phase", "worst_phases", "root_sum_of_squares"):
        assert DATA["worst"][key]["value"] == DATA["sums"][key][4]


def test_a_known_patch_in_one_phase():
    """Nine units at 20 mm: 1.06 times a unit's level at the middle; the magnitudes add to 2.17, which is no sum."""
    assert DATA["worst"]["in_phase"]["value"] == pytest.approx(1.06, abs=0.005)
    assert sum(row[4] for row in DATA["matrix"] if row[4] is not None) == pytest.approx(2.17, abs=0.01)


STILL = {
    "still": {
        "rock": {"density_kg_m3": 1100.0, "poisson_ratio": 0.3, "youngs_modulus_kpa": 1e8, "loss_factor": 0.0},
    }
}


def pushed(at, force, middles, nu=0.3):
    """The displacement at a point of a half-space under forces spread on discs: Cerruti's and Boussinesq's solutions.

    `at` and `middles` in mm; `force` is one complex vector, x, y and z (into the skin). Summed over points of each disc.
    """
    r, w = np.polynomial.legendre.leggauss(12)
    radius, angle = 3.5 * (r + 1) / 2, 2 * np.pi * (np.arange(24) + 0.5) / 24
    weight = (w * radius)[:, None] * np.ones(angle.size)
    total = np.zeros(3, complex)
    for middle in middles:
        px = middle[0] + radius[:, None] * np.cos(angle)
        py = middle[1] + radius[:, None] * np.sin(angle)
        x, y = at[0] - px, at[1] - py
        d = np.hypot(x, y)
        fx, fy, fz = force
        ux = fx * ((1 - nu) / d + nu * x**2 / d**3) + fy * nu * x * y / d**3 - fz * (1 - 2 * nu) / 2 * x / d**2
        uy = fy * ((1 - nu) / d + nu * y**2 / d**3) + fx * nu * x * y / d**3 - fz * (1 - 2 * nu) / 2 * y / d**2
        uz = fz * (1 - nu) / d + (1 - 2 * nu) / 2 * (fx * x + fy * y) / d**2
        total += [np.sum(weight * u) / weight.sum() for u in (ux, uy, uz)]
    return total


@pytest.mark.parametrize(("drive", "force"), [("flat", (1, -1j, 0)), ("axial", (0, 0, 1))])
def test_the_sum_in_one_phase_is_the_direct_superposition_of_forces(drive, force):
    """On a stiff half-space all is static: each unit's own disc of closed-form point forces, no angle, no solver."""
    points = [(0.0, 0.0), (21.0, 3.0), (-7.0, 24.0), (-19.0, -15.0), (9.0, -22.0)]
    unit = {**UNIT, "motor": {"drive": drive}, "tissue": STILL}
    made = array({"kind": "list", "points_mm": [list(at) for at in points]}, unit=unit,
                 estimate={"tissue": "still", "frequency_hz": 1.0}, sheet={"thickness_mm": 1.5})  # fmt: skip
    data = crosstalk(made)
    at = [(place.x, place.y) for place in made.places]
    edge = np.linalg.norm(pushed((at[0][0] + 7.0, at[0][1]), force, at[:1]))
    for j, place in enumerate(at):
        others = [pushed(place, force, [other]) / edge for i, other in enumerate(at) if i != j]
        assert data["sums"]["in_phase"][j] == pytest.approx(np.linalg.norm(sum(others)), rel=2e-3)
        root = math.sqrt(sum(np.linalg.norm(one) ** 2 for one in others))
        assert data["sums"]["root_sum_of_squares"][j] == pytest.approx(root, rel=2e-3)


def test_the_worst_phases_are_the_best_of_a_search():
    """By a general maximiser over the phases; for vectors of one direction the sum of their lengths."""
    rng = np.random.default_rng(4)
    for count in (2, 3, 5, 8):
        vectors = rng.normal(size=(count, 3)) + 1j * rng.normal(size=(count, 3))

        def less(phases, vectors=vectors):
            return -np.linalg.norm(np.exp(1j * np.append(0, phases)) @ vectors)

        best = min(optimize.minimize(less, rng.uniform(0, 7, count - 1)).fun for _ in range(20))
        assert worst_phases(vectors) == pytest.approx(-best, rel=1e-6)
    line = np.outer(rng.normal(size=6) + 1j * rng.normal(size=6), [1, 2j, 0.5])
    assert worst_phases(line) == pytest.approx(np.linalg.norm(line, axis=1).sum())
    assert worst_phases(np.zeros((4, 3), complex)) == 0


def test_motors_of_several_frequencies_have_no_phase():
    data = crosstalk(scattered("flat"))
    assert not data["synchronous"]
    assert data["sums"]["in_phase"] is data["worst"]["in_phase"] is data["worst"]["worst_phases"] is None
    assert "The motors run at several frequencies: no phase lasts." in data["answer"][1]
    assert set(data["absolute"]) == {"root_sum_of_squares"}
    json.dumps(data, allow_nan=False)


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
    for key in ("in_phase", "worst_phases", "root_sum_of_squares"):
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
    assert data["worst"]["in_phase"]["value"] == 0
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
