"""Walls, features, overhangs, bridges, hollows, bed: what must be found, and what must not."""

import numpy as np
import pytest
from manifold3d import CrossSection, Manifold
from shapes import box, finding, prism, stl

FDM = {"printer": "fdm-0.4"}


def triangles(solid):
    """The triangles of a manifold3d solid as a float32 file holds them."""
    mesh = solid.to_mesh()
    return np.asarray(mesh.vert_properties)[:, :3][np.asarray(mesh.tri_verts)]


def block(x, y, z, at=(0, 0, 0)):
    return Manifold.cube([x, y, z]).translate(list(at))


def tube(outer, inner, height, n=96):
    return Manifold.cylinder(height, outer, outer, n) - Manifold.cylinder(height, inner, inner, n)


def codes(judge, solid):
    return {found.code for found in judge(stl(triangles(solid)), **FDM).findings}


def thinnest(report):
    message = finding(report, "D001").message
    return float(message.split()[-2])


@pytest.mark.parametrize(("wall", "found"), [(0.8, False), (0.79, True), (0.5, True), (2.0, False)])
@pytest.mark.parametrize("shape", ["straight", "round", "leaning"])
def test_upright_wall_at_the_floor(wall, found, shape, judge):
    if shape == "straight":
        solid = block(20, wall, 10) + block(20, 20, 2)
    elif shape == "round":
        n = 96  # the polygon's flats are nearer than its corners: draw it so that they are `wall` apart
        solid = tube(8 / np.cos(np.pi / n), (8 - wall) / np.cos(np.pi / n), 6, n)
    else:
        solid = block(20, wall, 10).rotate([0, 0, 30]) + block(30, 30, 2, (-8, -1, 0))
    report = judge(stl(triangles(solid)), **FDM)
    assert report.has("D001") == found
    if found:
        assert thinnest(report) == pytest.approx(wall, rel=0.02)


@pytest.mark.parametrize(("height", "found"), [(0.4, False), (0.5, False), (0.35, True), (0.2, True)])
def test_flat_piece_needs_two_layers(height, found, judge):
    assert judge(stl(box((20, 3.4, height))), **FDM).has("D001") == found


@pytest.mark.parametrize("angle", [20, 30, 45])
def test_a_bevel_is_no_wall(angle, judge):
    """A scraper's blade: a plate whose long edge is ground to a line."""
    run = 1.5 / np.tan(np.radians(angle))
    blade = prism([(0, 0), (2 + run, 0), (2, 1.5), (0, 1.5)], 0, 4)
    lying, standing = blade[:, :, [2, 0, 1]], blade
    for turned in (lying, standing):
        assert "D001" not in {found.code for found in judge(stl(turned), **FDM).findings}


def test_tapered_plinth_is_no_wall(judge):
    slope = 2 * np.tan(np.radians(5))
    plinth = Manifold.hull_points(
        [(x * s, y * s, z) for x in (-1, 1) for y in (-1, 1) for z, s in ((0, 10.0), (2, 10.0 - slope))]
    )
    assert codes(judge, plinth) == set()


def test_strips_between_engraved_strokes_are_no_walls(judge):
    plate = block(30, 20, 4)
    for i in range(6):
        plate -= block(0.8, 6, 0.5, (5 + 1.3 * i, 5, 3.6))  # strips 0.5 wide, 0.4 high
    assert codes(judge, plate) == set()
    deep = block(30, 20, 4)
    for i in range(6):
        deep -= block(0.8, 6, 3.0, (5 + 1.3 * i, 5, 1.6))
    assert "D001" in codes(judge, deep)


def test_a_thin_wall_in_one_part_of_a_large_solid_is_found(judge):
    solid = block(40, 40, 10) - block(10, 10, 10, (0.6, 10, 2))
    report = judge(stl(triangles(solid)), **FDM)
    assert thinnest(report) == pytest.approx(0.6, rel=1e-3)
    place = finding(report, "D001").locations[0].xyz
    assert -0.1 < place[0] < 0.7
    assert 9 < place[1] < 21


@pytest.mark.parametrize(("side", "found"), [(0.3, True), (0.39, True), (0.4, False), (1.0, False)])
def test_pins(side, found, judge):
    solid = block(10, 10, 2) + block(side, side, 5, (5, 5, 0))
    assert ("D002" in codes(judge, solid)) == found


@pytest.mark.parametrize(
    ("whisker", "found"),
    [
        (lambda: block(10, 0.3, 0.3), True),
        (lambda: block(10, 0.39, 0.39), True),
        (lambda: block(10, 0.4, 0.4), False),
        (lambda: block(10, 0.3, 0.45), False),
        (lambda: block(10, 0.3, 0.1), True),
        (lambda: block(2, 0.3, 0.3), True),
        (lambda: block(10, 0.3, 0.3).rotate([0, 0, 30]), True),
        (lambda: block(10, 0.3, 0.3).rotate([45, 0, 0]), True),
        (lambda: Manifold.cylinder(10, 0.15, 0.15, 16).rotate([0, 90, 0]), True),
        (lambda: Manifold.cylinder(10, 0.18, 0.18, 3).rotate([0, 90, 0]), True),
        (lambda: Manifold.cylinder(10, 0.15, 0.15, 16).rotate([0, 50, 0]), True),
        (lambda: Manifold.revolve(CrossSection.square([0.3, 0.3]).translate([4, 0]), 200).translate([4, 0, 0]), True),
        (lambda: Manifold.cylinder(10, 3, 0, 32).rotate([0, 90, 0]), False),
    ],
    ids=["square", "below", "at the floor", "high", "foil", "short", "aslant", "on edge", "round", "three-sided",
         "leaning", "ring", "spike"],
)  # fmt: skip
@pytest.mark.parametrize("height", [0, 2.5])
def test_whiskers_that_lie_or_stand_out(whisker, found, height, judge):
    solid = block(10, 10, 5) + whisker().translate([9, 5, height])
    solid = solid ^ block(40, 40, 20, (-10, -10, 0))  # nothing below the bed
    assert ("D002" in codes(judge, solid)) == found


@pytest.mark.parametrize("depth", [0.0, 0.1])
def test_a_rib_along_its_length_is_no_whisker(depth, judge):
    assert "D002" not in codes(judge, block(10, 10, 5) + block(8, 0.3, 0.3 + depth, (1, 5, 5 - depth)))
    bent = block(8, 0.3, 0.4, (1, 5, 4.9)) + block(0.3, 4, 0.4, (1, 5, 4.9))
    assert "D002" not in codes(judge, block(10, 10, 5) + bent)


@pytest.mark.parametrize(("angle", "found"), [(40, False), (45, False), (50, True), (70, True)])
def test_cone_upside_down(angle, found, judge):
    """The angle from the vertical at which the side leans out."""
    reach = 8 * np.tan(np.radians(angle))
    assert ("D003" in codes(judge, Manifold.cylinder(8, 4, 4 + reach, 64))) == found


@pytest.mark.parametrize(("span", "found"), [(3.0, False), (5.0, False), (5.5, True), (12.0, True)])
def test_bridges(span, found, judge):
    gate = block(span + 6, 8, 10) - block(span, 8, 6, (3, 0, 0))
    assert ("D003" in codes(judge, gate)) == found


def test_groove_ceiling_is_a_bridge_and_a_ledge_is_none(judge):
    ring = Manifold.cylinder(8, 15, 15, 96) - tube(12, 9, 3)
    assert codes(judge, ring) == set()
    ledge = tube(15, 10, 8) + tube(18, 12, 3).translate([0, 0, 5])
    assert "D003" in codes(judge, ledge)
    lip = tube(15, 10, 8) + tube(15.3, 12, 3).translate([0, 0, 5])
    assert "D003" not in codes(judge, lip)


def test_window_through_a_wall_is_a_bridge(judge):
    cup = tube(12, 9, 8) - block(10, 3.6, 2, (5, -1.8, 3))
    assert codes(judge, cup) == set()


@pytest.mark.parametrize(
    ("printer", "width", "found"),
    [("fdm-0.4", 0.05, True), ("fdm-0.4", 0.149, True), ("fdm-0.4", 0.151, False), ("fdm-0.4", 0.5, False),
     ("sla", 0.05, True), ("sla", 0.079, True), ("sla", 0.081, False)],
)  # fmt: skip
@pytest.mark.parametrize("shape", ["slot", "blind slot", "two bodies", "ring", "turned"])
def test_a_gap_narrower_than_the_printers_play(printer, width, found, shape, judge):
    if shape == "slot":
        solid = block(20, 20, 5) - block(width, 12, 5, (8, 4, 0))
    elif shape == "blind slot":
        solid = block(20, 20, 5) - block(12, width, 3, (4, 8, 2))
    elif shape == "two bodies":
        solid = block(20, 10, 5) + block(20, 10, 5, (0, 10 + width, 0))
    elif shape == "ring":
        n = 96
        flat = 1 / np.cos(np.pi / n)
        solid = tube(15, 8 * flat, 5, n) + Manifold.cylinder(5, (8 - width) * flat, (8 - width) * flat, n)
    else:
        solid = (block(20, 20, 5) - block(width, 12, 5, (8, 4, 0))).rotate([0, 0, 23.7])
    report = judge(stl(triangles(solid)), printer=printer)
    assert report.has("D006") == found
    if found:
        said = finding(report, "D006")
        assert said.count == 1
        assert float(said.message.split()[-2]) == pytest.approx(width, rel=0.02)


@pytest.mark.parametrize(("height", "found"), [(0.05, True), (0.19, True), (0.21, False), (0.4, False)])
def test_a_flat_gap_is_closed_below_a_layer(height, found, judge):
    solid = block(20, 20, 5) - block(21, 16, height, (-0.5, 2, 2))
    assert judge(stl(triangles(solid)), **FDM).has("D006") == found


def test_grooves_and_scratches_are_no_gaps(judge):
    """A V-groove has no parallel sides; a scratch lower than the play reaches nowhere; touching shells have none."""
    groove = Manifold.cylinder(20, 0.3, 0.3, 3).rotate([90, 0, 0]).translate([10, 20, 5])
    assert "D006" not in codes(judge, block(20, 20, 5) - groove)
    assert "D006" not in codes(judge, block(20, 20, 5) - block(0.1, 12, 0.1, (8, 4, 4.9)))
    both = np.concatenate([box(), box(at=(10, 0, 0))])
    assert not judge(stl(both), **FDM).has("D006")


def test_bed(judge):
    assert judge(stl(box((219, 219, 219))), **FDM).findings == ()
    assert judge(stl(box((100, 100, 221))), **FDM).has("S002")
    assert judge(stl(box(at=(0, 0, -5))), **FDM).has("D005")
    assert not judge(stl(box(at=(500, 500, 0))), **FDM).has("D005")
    assert not judge(stl(box(at=(0, 0, 300))), **FDM).has("D005")  # a slicer drops it to the bed
    ball = triangles(Manifold.sphere(5, 32).translate([0, 0, 5]))
    edge = triangles(Manifold.cube([8, 8, 8]).rotate([45, 0, 0]).translate([30, 0, 0]))
    for height in (0, 7):
        both = judge(stl(np.concatenate([box(at=(-30, 0, 0)), ball, edge]) + np.array([0, 0, height])), **FDM)
        unsteady = finding(both, "D005")
        assert unsteady.message == "2 parts on an edge or a point: 0 mm2 of flat on the bed"
        assert [place.xyz[2] for place in unsteady.locations] == [height, height]


def test_hollow(judge):
    assert {"G006", "D004"} <= codes(judge, block(20, 20, 20) - block(5, 5, 3, (5, 5, 5)))
    assert "D004" not in codes(judge, block(20, 20, 20) - block(5, 5, 15, (5, 5, 5)))


def test_without_a_printer_none_of_these_rules_runs(judge):
    assert judge(stl(box((300, 0.3, 10), (0, 0, 4)))).findings == ()


@pytest.mark.parametrize(
    ("solid", "walls"),
    [
        (block(20, 0.5, 10) + block(20, 20, 2), 1),
        (block(20, 0.5, 10) + block(20, 0.5, 10, (0, 8, 0)) + block(20, 20, 2), 2),
        (block(20, 0.5, 10) + block(0.5, 10, 10, (0, 5, 0)) + block(20, 20, 2), 2),
        (tube(8, 7.5, 6), 1),
        (block(20, 20, 0.3), 1),
    ],
    ids=["one", "two side by side", "two at right angles", "a tube", "a flat one"],
)
def test_a_wall_with_two_sides_is_one_wall(solid, walls, judge):
    found = finding(judge(stl(triangles(solid)), **FDM), "D001")
    assert (found.count, len(found.locations)) == (walls, walls)
    assert found.message.startswith(f"{walls} wall{'s' * (walls > 1)} below")
