"""Tessellation: the libraries' own meshes, the exact volume of what is revolved alone, and the text that cites rows."""

import numpy as np
import pytest

pytest.importorskip("build123d")
pytest.importorskip("cadquery")

from benchmarks.accuracy import tessellation
from benchmarks.accuracy.measures import mesh_volume
from unitcad.accuracy.measurements import timing
from unitcad.api.variant import Variant
from unitcad.shape import Revolve


def test_each_librarys_own_mesh_and_the_exact_volume_of_a_revolved_body():
    variant = Variant.of("encapsulating")
    shape = next(body.shape for body in variant.unit if body.name == tessellation.REVOLVED)
    assert isinstance(shape, Revolve)
    dims = variant.dimensions
    exact = np.pi * dims.motor_radius**2 * dims.motor_height
    methods = tessellation._methods(shape, dims.outer_radius, 0.1)
    off = {name: mesh_volume(*method())[0] / exact - 1 for name, method in methods.items()}
    assert abs(off["manifold3d, area-true"]) < 1e-12
    assert -0.1 < off["manifold3d, plain"] < -1e-3
    for library in ("build123d", "CadQuery"):
        assert -2e-3 < off[library] < -1e-5


def row(method, tolerance, triangles, error, distance, seconds):
    return tessellation._Row(method, tolerance, triangles, error, distance, timing([seconds]))


ROWS = [
    row("CadQuery", 0.1, 500, 1e-4, 0.002, 0.05),
    row("CadQuery", 0.01, 500, 1e-4, 0.002, 0.06),
    row("manifold3d, area-true", 0.01, 400, 1e-6, 0.007, 0.002),
    row("manifold3d, area-true", 0.003, 900, 1e-7, 0.001, 0.004),
]


def test_the_table_has_a_frontier_for_each_cost_and_error():
    table = tessellation._table("layer2", ROWS)
    stars = {column: [r[table.columns.index(column)] for r in table.rows] for column in table.columns[-4:]}
    assert stars["time: volume"] == ["", "", "*", "*"]
    assert stars["time: distance"] == ["", "", "*", "*"]
    assert stars["triangles: volume"] == ["", "", "*", "*"]
    assert stars["triangles: distance"] == ["*", "*", "*", "*"]


def test_the_text_cites_rows():
    assert "as many triangles for layer2 at 0.1, 0.01 mm" in tessellation._same_triangles({"layer2": ROWS})
    assert tessellation._same_triangles({"layer2": ROWS[1:]}) == ""
    text = tessellation._default({"layer2": ROWS}, (0.1, 0.01, 0.003))
    assert "1.0e-06 of volume, 0.007 mm, 400 triangles, 2 ms (at 0.003 mm: 1.0e-07, 0.001 mm, 900, 4 ms)" in text
    assert "1/15 of the play between printed faces (0.15 mm)" in text
