"""Four realisations of one tree: manifold3d and OCCT share no code, so that these two agree is evidence.

The two libraries on OCCT draw it by operations of their own.
"""

import contextlib
import importlib
import math
from collections import Counter

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, assume, given, settings
from hypothesis import strategies as st
from manifold3d import Manifold, Mesh64
from sample_bodies import LAYER1, QUARTER, all_bodies

from unitcad.errors import UnitcadError
from unitcad.kernels import bounds, mesh
from unitcad.shape import (
    Below,
    Common,
    Component,
    Cut,
    Extrude,
    Place,
    Profile,
    Revolve,
    Union,
    box,
    cylinder,
    exact_volume,
    polygon,
    rectangle,
    rounded_rectangle,
    turned,
)

occt = pytest.importorskip("unitcad.kernels.occt", exc_type=UnitcadError)
brep_measures = importlib.import_module("benchmarks.accuracy.brep_measures")
WITHOUT_SHRINKING = (Phase.explicit, Phase.reuse, Phase.generate)
"""Making a failing tree smaller takes minutes of booleans."""
BODIES = {body.name: body for body in all_bodies()}
LEAVES = {
    "tube": Revolve(polygon((3, 0), (5, 0), (5, 10), (3, 10))),
    "stepped": Revolve(LAYER1),
    "ball": Revolve(Profile(((0, -3, math.tan(math.pi / 4)), (0, 3, 0), (0, 1, 0)))),
    "torus": Revolve(Profile(((4, 0, 1.0), (6, 0, QUARTER), (5, 1, QUARTER)))),
    "key": Extrude(rounded_rectangle(8, 6, 2, key=3), -1, 1),
    "letter": Extrude(rounded_rectangle(3, 2, 1), 0, 1, holes=(rounded_rectangle(1, 1, 0.5),)),
    "taper": Extrude(rounded_rectangle(8, 6, 2, key=3), 0, 3, top=rounded_rectangle(7, 5, 2, key=3)),
    "cone": Extrude(rounded_rectangle(8, 8, 4), 0, 3, top=rounded_rectangle(6, 6, 3)),
    "turned": Place(turned(box(0, 1, 0, 2, 0, 3), "y", 3), move=(1, 2, 3)),
}


def solids_of(shape):
    """The shape by every B-rep library that is installed (CI has both)."""
    found = {"occt": occt.solids([shape])[0]}
    for name in ("build123d", "cadquery"):
        with contextlib.suppress(ImportError):
            library = importlib.import_module(f"benchmarks.accuracy.{name}_kernel")
            found[name] = library.solid(shape).wrapped
    return found


def assert_breps_agree(shape, share=1e-9):
    measured = {name: brep_measures.measure(solid) for name, solid in solids_of(shape).items()}
    reference = measured.pop("occt")
    for other in measured.values():
        assert other.solids == reference.solids
        assert other.volume == pytest.approx(reference.volume, rel=share)
        assert other.box == pytest.approx(reference.box, abs=1e-5)
    return reference


def assert_mesh_within_bound(shape, segments, reference):
    solid = mesh.realise(shape, segments)
    allowed = 2 * bounds.deviation(shape, segments)
    assert len(solid.decompose()) == reference.solids
    assert abs(solid.volume() - reference.volume) <= bounds.volume_bound(shape, segments) + 1e-9 * reference.volume
    for side, (found, true) in enumerate(zip(solid.bounding_box(), reference.box, strict=True)):
        assert abs(found - true) <= allowed + 1e-6, side


@pytest.mark.parametrize("name", BODIES)
def test_kernels_agree_on_bodies(name):
    shape = BODIES[name].shape
    reference = assert_breps_agree(shape)
    assert reference.solids == 1
    for tolerance in (0.1, 0.01):
        assert_mesh_within_bound(shape, mesh.segment_count(20, tolerance), reference)


@pytest.mark.parametrize("name", LEAVES)
def test_leaves_have_their_closed_form_volume(name):
    reference = assert_breps_agree(LEAVES[name])
    assert reference.volume == pytest.approx(exact_volume(LEAVES[name]), rel=1e-9)
    assert_mesh_within_bound(LEAVES[name], 64, reference)


LUG = Extrude(rounded_rectangle(8, 3, 2), 2, 4)
UNDER = {
    "lug": (LUG, 5 * LUG.profile.area),
    "lug on a post": (Union((LUG, cylinder(2, 0, 6))), 5 * LUG.profile.area + 2 * math.pi * 4),
    "half ball": (Revolve(Profile(((0, 1, 0), (3, 1, QUARTER), (0, 4, 0)))), 2 * math.pi * 9 + 2 / 3 * math.pi * 27),
}


@pytest.mark.parametrize("name", UNDER)
def test_what_lies_below_a_shape_has_its_closed_form_volume(name):
    inner, volume = UNDER[name]
    shape = Below(inner, -1.0)
    reference = assert_breps_agree(shape)
    assert reference.volume == pytest.approx(volume, rel=1e-9)
    assert_mesh_within_bound(shape, 64, reference)


def test_a_face_that_turns_from_up_to_down_has_no_prism():
    with pytest.raises(UnitcadError, match="turns from up to down"):
        occt.solids([Below(LEAVES["ball"], -4.0)])
    under = mesh.realise(Below(LEAVES["ball"], -4.0), 512).volume()
    assert under == pytest.approx(4 * math.pi * 9 + 2 / 3 * math.pi * 27, rel=1e-3)


def test_what_lies_below_a_thread_is_the_integral_of_its_shadows():
    """Three turns of one face lie over each other: its prism alone would be no solid."""
    turns, sides, pitch = 3, 48, 2.0
    section = np.array([(4.9, -0.7), (5.8, -0.15), (5.8, 0.15), (4.9, 0.7)])
    angles = 2 * np.pi * np.arange(turns * sides + 1) / sides
    x, y = np.cos(angles)[:, None] * section[:, 0], np.sin(angles)[:, None] * section[:, 0]
    z = 1.2 + (pitch * np.arange(len(angles)) / sides)[:, None] + section[:, 1]
    corners, k = np.stack([x, y, z], axis=-1).reshape(-1, 3), len(section)
    here = (np.arange(len(angles) - 1)[:, None] * k + np.arange(k)).ravel()
    after = (np.arange(len(angles) - 1)[:, None] * k + np.roll(np.arange(k), -1)).ravel()
    ends = np.array([(0, 1, 2), (0, 2, 3)])
    faces = np.concatenate(
        [
            np.stack([here, after, after + k], 1),
            np.stack([here, after + k, here + k], 1),
            ends[:, ::-1],
            ends + k * (len(angles) - 1),
        ]
    )
    helix = Manifold(Mesh64(corners, faces[:, ::-1].astype(np.uint64)))
    assert helix.volume() > 0
    solid = helix + Manifold.cylinder(9, 5, 5, sides)
    levels = (np.arange(400) + 0.5) / 400 * 9
    shadows = [solid.trim_by_plane((0, 0, 1), level).project().area() for level in levels]
    assert mesh._below(solid, 0.0).volume() == pytest.approx(np.mean(shadows) * 9, rel=1e-5)


def test_a_component_is_the_piece_that_holds_the_point():
    three = Union(tuple(Place(cylinder(1, 0, 1 + i), move=(3 * i, 0, 0)) for i in range(3)))
    for i in range(3):
        reference = assert_breps_agree(Component(three, (3 * i, 0, 0.5)))
        assert reference.volume == pytest.approx(math.pi * (1 + i), rel=1e-9)
        assert_mesh_within_bound(Component(three, (3 * i, 0, 0.5)), 64, reference)
    for realise in (lambda shape: mesh.realise(shape, 64), lambda shape: occt.solids([shape])):
        with pytest.raises(UnitcadError, match="no solid is at the point"):
            realise(Component(three, (1.5, 0, 0.5)))


@pytest.mark.parametrize("radius", [0.5, 4.5, 30])
@pytest.mark.parametrize("tolerance", [0.1, 0.01, 0.002])
def test_segment_count_keeps_the_tolerance(radius, tolerance):
    """Distance measured on the mesh: its corners outside, the middles of its sides inside."""
    n = mesh.segment_count(radius, tolerance)
    vertices, _ = mesh.arrays(mesh.realise(cylinder(radius, 0, 1), n))
    corner = max(math.hypot(x, y) for x, y, _ in vertices)
    assert corner - radius <= tolerance + 1e-9
    assert radius - corner * math.cos(math.pi / n) <= tolerance + 1e-9


def numbers(low, high):
    """Quarters of a mm: coincident faces come up often."""
    return st.integers(4 * low, 4 * high).map(lambda value: value / 4)


@st.composite
def leaves(draw):
    """Round ones stand upright; straight ones lie any way."""
    kind = draw(st.sampled_from(["ring", "cone", "dome", "block", "slab", "taper"]))
    z0, height, r0, width = draw(numbers(-4, 4)), draw(numbers(1, 4)), draw(numbers(0, 3)), draw(numbers(1, 4))
    if kind == "ring":
        return Revolve(polygon((r0, z0), (r0 + width, z0), (r0 + width, z0 + height), (r0, z0 + height)))
    if kind == "cone":
        return Revolve(polygon((r0, z0), (r0 + width, z0), (r0, z0 + height)))
    if kind == "dome":
        return Revolve(Profile(((r0, z0, 0), (r0 + width, z0, QUARTER), (r0, z0 + width, 0))))
    half = 2 + width
    if kind == "slab":
        return Extrude(rounded_rectangle(half, half + 1, 1), z0, z0 + height, holes=(rounded_rectangle(1, 1, 0.5),))
    x0, y0 = draw(numbers(-4, 4)), draw(numbers(-4, 4))
    straight = box(x0, x0 + width, y0, y0 + draw(numbers(1, 4)), z0, z0 + height)
    if kind == "taper":
        straight = Extrude(rectangle(-half, -2, half, 2), z0, z0 + height, top=rectangle(-2, -1, 2, 1))
    return turned(straight, draw(st.sampled_from("xyz")), draw(st.integers(0, 3)))


def trees():
    def grown(children):
        # Off the grid of quarters, so that round faces cross instead of touching along a line.
        off = st.integers(-2000, 2000).map(lambda value: (value * 2 + 1) / 1024)
        return st.one_of(
            st.tuples(children, children, children).map(Union),
            st.tuples(children, st.tuples(children, children)).map(lambda pair: Cut(*pair)),
            st.tuples(children, children).map(Common),
            st.tuples(children, off, off, off).map(lambda t: Place(t[0], move=t[1:])),
        )

    return st.recursive(leaves(), grown, max_leaves=6)


@settings(max_examples=8, deadline=None, suppress_health_check=list(HealthCheck), phases=WITHOUT_SHRINKING)
@given(trees())
def test_kernels_agree_on_random_trees(shape):
    """Where curved faces cross off their axes OCCT errs by 1e-7 mm: a volume by that times its area."""
    solid = mesh.realise(shape, 64)
    assume(solid.volume() > 1)
    rough = 1e-7 * solid.surface_area()
    reference = assert_breps_agree(shape, rough / solid.volume())
    assert abs(solid.volume() - reference.volume) <= bounds.volume_bound(shape, 64) + rough


def test_flat_sides_of_a_taper_are_planes():
    """A boolean of splines takes twenty times as long; a side that is not flat stays what it is, to its volume."""
    kinds = Counter(map(_kind, occt.faces_of(occt.solids([LEAVES["taper"]])[0])))
    assert kinds["Plane"] == 7, kinds  # two ends, four sides, the cut corner
    assert set(kinds) <= {"Plane", "Cone", "BSplineSurface"}
    twisted = Extrude(polygon((0, 0), (4, 0), (4, 3), (0, 3)), 0, 2, top=polygon((0, 0), (4, 1), (4, 3), (0, 3)))
    assert Counter(map(_kind, occt.faces_of(occt.solids([twisted])[0]))) == {"Plane": 5, "BSplineSurface": 1}


def _kind(face):
    from OCP.BRepAdaptor import BRepAdaptor_Surface

    return BRepAdaptor_Surface(face).GetType().name.removeprefix("GeomAbs_")
