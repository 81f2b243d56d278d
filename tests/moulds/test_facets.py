"""Films that facets leave are told from pieces by their thickness: bodies from STEP, and films alone."""

import math
from pathlib import Path

import numpy as np
import pytest
from faulty_sets import broken, of_spec
from manifold3d import Manifold

from unitcad.checks import check_moulds
from unitcad.errors import Refusal
from unitcad.kernels.mesh import thick_pieces
from unitcad.moulds.complement import complement
from unitcad.moulds.plan import cast_layers
from unitcad.shape import cut, cylinder, ring
from unitcad.shape.profile import FACETS
from unitcad.shape.tree import Body
from unitcad.validation import load

BODIES = Path(__file__).parent / "bodies"
SPEC = """
name = "body"
design = "{design}"
diameter_mm = 22.0
[motor]
diameter_mm = 7.0
thickness_mm = {motor}
[[layers]]
material = "ecoflex-00-30"
wall_mm = 2.0
cap_mm = 2.0
"""


def moulds_of(folder, design, motor=2.7):
    """Return the mould set of a file of bodies."""
    pytest.importorskip("OCP")
    (folder / "spec.toml").write_text(SPEC.format(design=design, motor=motor))
    return of_spec(load(folder / "spec.toml"))


def step_of(folder, shape):
    """Write a layer as STEP."""
    pytest.importorskip("OCP")
    from unitcad.export import step

    step.write(folder / "body.step", [Body("layer1", "unit", "layer", shape, (1, 0, 0))], "unit")
    return folder / "body.step"


def turned(solid, seed):
    return solid.rotate(tuple(np.random.default_rng(seed).uniform(0, 360, 3)))


@pytest.mark.parametrize("seed", range(8))
def test_a_film_is_told_by_its_thickness(seed):
    for share, kept in ((0.8, 0), (1.2, 1)):
        film = turned(Manifold.cube((5, 3, share * FACETS)), seed)
        assert len(thick_pieces(film)) == kept
        tube = Manifold.cylinder(5, 4, 4, 96) - Manifold.cylinder(7, 4 - share * FACETS, -1, 96).translate((0, 0, -1))
        assert len(thick_pieces(turned(tube, seed))) == kept
    # A lump that a large film hangs on: twice the volume over the area is far below the film's own limit.
    lump = turned(Manifold.cube((30, 30, FACETS / 50)) + Manifold.cube((0.1, 0.1, 0.1)), seed)
    assert 2 * lump.volume() / lump.surface_area() < FACETS / 10
    assert len(thick_pieces(lump)) == 1


@pytest.mark.parametrize(
    "name", ["round6", pytest.param("round4", marks=pytest.mark.long), pytest.param("cyl", marks=pytest.mark.long)]
)
def test_bodies_with_round_edges_get_moulds_that_keep_every_check(name, tmp_path):
    assert broken(moulds_of(tmp_path, BODIES / f"{name}.step")) == set()


def test_a_body_without_a_pocket_gets_moulds_and_a_finding(tmp_path):
    moulds = moulds_of(tmp_path, BODIES / "plug30.step")
    (finding,) = [finding for finding in check_moulds(moulds) if not finding.ok]
    assert (finding.code, finding.where) == ("C200", "unit: layer1 and motor")
    assert finding.value == pytest.approx(math.pi * 3.5**2 * 2.7, rel=1e-3)


@pytest.mark.parametrize(
    ("radius", "depth", "shared"),
    [
        (3.5, 2.7, 0.0),
        pytest.param(3.48, 2.7, math.pi * (3.5**2 - 3.48**2) * 2.7, marks=pytest.mark.long),
        (3.5, 2.68, math.pi * 3.5**2 * 0.02),
    ],
)
def test_an_exact_pocket_holds_its_motor_and_one_too_small_by_0_02_does_not(radius, depth, shared, tmp_path):
    body = step_of(tmp_path, cut(cylinder(8, 0, 6), [cylinder(radius, -1, depth)]))
    found = [finding for finding in check_moulds(moulds_of(tmp_path, body)) if not finding.ok]
    if not shared:
        assert found == []
        return
    (finding,) = found
    assert (finding.code, finding.where) == ("C200", "unit: layer1 and motor")
    facets = 2 * math.pi * radius * depth * FACETS  # what they take or add at most, round the pocket
    assert finding.value == pytest.approx(shared, abs=facets)


def test_a_hollow_of_five_films_is_refused(tmp_path):
    body = step_of(tmp_path, cut(cylinder(8, 0, 6), [cylinder(3.6, -1, 2.7), ring(4.5, 9, 4, 4 + 5 * FACETS)]))
    with pytest.raises(Refusal, match=r"a hollow of .* is closed in by silicone below and above"):
        spec = moulds_of(tmp_path, body).spec  # which the room of bodies casts, if it is there
        complement(spec, cast_layers(spec))
