"""Severity is that of the print: layers under each fill rule, and one verdict for a file turned, cut or refined."""

import numpy as np
import pytest
from manifold3d import CrossSection, FillRule
from shapes import CUBE_CORNERS, CUBE_FACES, box, fin, finding, obj, prism, stl, turned
from test_check_depth import pieces
from test_check_overlap import BOW_TIE, pentagram

from unitcad.meshcheck import check_bytes
from unitcad.meshcheck.geometry.disputed import deepest
from unitcad.meshcheck.geometry.layers import Slicer, eroded
from unitcad.meshcheck.geometry.mesh import weld_exact
from unitcad.meshcheck.geometry.rays import winding_numbers
from unitcad.meshcheck.geometry.topology import edges_of


def layers_of(triangles, axis, heights):
    vertices, faces = weld_exact(np.asarray(triangles, float))
    return list(Slicer(vertices, faces, edges_of(faces, len(vertices)), lambda: None).layers(axis, np.asarray(heights)))


def knot():
    """A wavy torus with some vertices pulled through the others: winding numbers from -2 to 3."""
    n = 14
    u, v = np.meshgrid(np.arange(n) * 2 * np.pi / n, np.arange(n) * 2 * np.pi / n, indexing="ij")
    points = np.stack([(20 + 8 * np.cos(v)) * np.cos(u), (20 + 8 * np.cos(v)) * np.sin(u), 8 * np.sin(v)], axis=-1)
    points = points.reshape(-1, 3) + np.random.default_rng(4).normal(scale=4.0, size=(n * n, 3))
    i, j = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
    a, b, c, d = i * n + j, (i + 1) % n * n + j, (i + 1) % n * n + (j + 1) % n, i * n + (j + 1) % n
    faces = np.concatenate([np.stack(t, axis=-1).reshape(-1, 3) for t in ((a, b, c), (a, c, d))])
    return points[faces]


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_disputed_is_where_the_winding_number_is_below_0_or_even(axis):
    """Against the sum of solid angles at points of three layers."""
    soup, rng = knot(), np.random.default_rng(axis)
    vertices, faces = weld_exact(soup)
    seen = set()
    for layer in layers_of(soup, axis, [-6.1, 0.03, 5.2]):
        points = layer.in_space(rng.uniform(-30, 30, (400, 2)))
        several = np.zeros(len(points), int), np.full(len(points), len(faces))
        number = winding_numbers(vertices, faces, *several, points, lambda: None)
        area = layer.disputed()
        from manifold3d import CrossSection

        spots = (CrossSection.circle(1e-6, 4).translate(np.roll(point, -axis)[1:].tolist()) for point in points)
        inside = np.array([not (area ^ spot).is_empty() for spot in spots])
        assert np.array_equal(inside, (number < 0) | ((number % 2 == 0) & (number != 0)))
        seen |= set(number.tolist())
    assert {-1, 0, 1, 2} <= seen


def test_outlines_are_those_that_a_plain_walk_finds():
    """The signed area of each layer against a sum over its segments, and every outline closed."""
    soup = np.concatenate([knot(), turned(box(), 3) + 15])
    for layer in layers_of(soup, 2, np.linspace(-8, 20, 40)):
        total = 0.0
        for a, b, c in soup:
            ends = [p + (layer.height - p[2]) / (q[2] - p[2]) * (q - p) for p, q in ((a, b), (b, c), (c, a))
                    if (p[2] > layer.height) != (q[2] > layer.height)]  # fmt: skip
            if ends:
                normal = np.cross(b - a, c - a)
                one, other = ends
                if np.dot(np.cross([0, 0, 1], normal), other - one) < 0:
                    one, other = other, one
                total += (one[0] * other[1] - one[1] * other[0]) / 2
        x, y = np.concatenate(layer.outlines).T
        assert len({*zip(x.tolist(), y.tolist(), strict=True)}) == len(x)
        areas = [np.dot(o[:, 0], np.roll(o[:, 1], -1)) - np.dot(o[:, 1], np.roll(o[:, 0], -1)) for o in layer.outlines]
        assert sum(areas) / 2 == pytest.approx(total, abs=1e-6)


def test_the_largest_circle_of_a_needle_ends():
    """No offset of it leaves anything; halving the radius for ever found no end."""
    needle = CrossSection([[(-0.0125, 1.6942), (-0.01328, 1.80462), (-0.01256, 1.7)]])
    assert not needle.is_empty()
    assert deepest(needle)[0] < 1e-3
    for side in (1e-6, 3e-8):
        assert deepest(CrossSection.square([5, side]))[0] == pytest.approx(side / 2, rel=0.03, abs=1e-7)


def test_many_pieces_are_eroded_as_they_are_at_once():
    """Of some hundred pieces of all sizes one is a ring with an island and a dot in it, one a hole's neighbour."""
    rng = np.random.default_rng(1)
    strips = []
    for angle, shift in zip(rng.uniform(0, np.pi, 30), rng.normal(0, 0.3, (30, 2)), strict=True):
        strip = CrossSection.square([18, 0.6], center=True).rotate(np.degrees(angle)).translate(shift.tolist())
        strips += strip.to_polygons()
    ring = CrossSection.square([8, 8]) - CrossSection.square([6, 6]).translate([1, 1])
    inner = CrossSection.square([3, 3]).translate([2, 2]) + CrossSection.square([0.1, 0.1]).translate([6, 6])
    area = CrossSection(strips, FillRule.EvenOdd) + (ring + inner).translate([-4, 20])
    assert area.num_vert() > 2000
    for radius in (0.001, 0.02, 0.15, 0.9):
        one, other = eroded(area, radius), area.offset(-radius)
        assert other.area() > 0.1
        assert ((one - other) + (other - one)).area() < 1e-6


def test_loose_ends_are_joined_to_the_nearest():
    """A box without one side: its layers are those of the whole box."""
    for lost in ([0], [0, 1], [4], [8, 9]):
        left = np.delete(box(), lost, axis=0)
        for layer in layers_of(left, 2, [2.5, 7.1]):
            assert abs(
                sum(o[:, 0] @ np.roll(o[:, 1], -1) - o[:, 1] @ np.roll(o[:, 0], -1) for o in layer.outlines)
            ) / 2 == (pytest.approx(100))


def test_the_message_tells_the_worst_layer(judge):
    """A bar of 4 by 4 through a box, and a foot of 6 by 6 inside it: in three bodies all rules fill."""
    body = np.concatenate([box(), box((4, 4, 20), (3, 3, -5)), box((6, 6, 2), (2, 2, 4))])
    message = finding(judge(stl(body)), "G001").message
    assert "layers differ by up to 20 mm2 between fill rules, worst at z = " in message
    assert 4 < float(message.rpartition("= ")[2]) < 6


def _folded(width):
    """A cube of 20 mm whose top has a vertex `width` across the diagonal that it should lie on: a fold."""
    corners = np.concatenate([CUBE_CORNERS * 20, [[10 + width / np.sqrt(2), 10 - width / np.sqrt(2), 20]]])
    rest = np.array([face for face in CUBE_FACES if not {*face.tolist()} <= {1, 3, 5, 7}])
    return corners[np.concatenate([rest, [[1, 5, 7], [7, 3, 8], [3, 1, 8], [1, 7, 8]]])]


def _waves(depth, step):
    """Two slabs whose common side is a wave: the upper one reaches `depth` into the lower one at its crests."""
    n = round(4 / step)
    x = np.linspace(0, 4, n + 1)
    u, v = np.meshgrid(x, x, indexing="ij")
    wave = 2 + depth / 2 * np.sin(2 * np.pi * u) * np.sin(2 * np.pi * v)

    def slab(low, high):
        def grid(z):
            return np.stack([u, v, z], axis=-1)

        def quads(a, b, c, d):
            found = np.stack([a, b, c], axis=-2).reshape(-1, 3, 3), np.stack([a, c, d], axis=-2).reshape(-1, 3, 3)
            return np.concatenate(found)

        lower, upper = grid(low), grid(high)
        found = [quads(upper[:-1, :-1], upper[1:, :-1], upper[1:, 1:], upper[:-1, 1:])]
        found += [quads(lower[:-1, :-1], lower[:-1, 1:], lower[1:, 1:], lower[1:, :-1])]
        for side in (np.s_[:, 0], np.s_[-1, :], np.s_[::-1, -1], np.s_[0, ::-1]):
            a, b = lower[side], upper[side]
            found.append(quads(a[:-1], a[1:], b[1:], b[:-1]))
        return np.concatenate(found)

    flat = np.zeros_like(u)
    return np.concatenate([slab(flat, wave), slab(2 - depth / 2 + 0 * flat, flat + 4)])


def _crack():
    """A cube one face of which is cut at a vertex that its neighbour does not have."""
    a, b, c = box()[0]
    middle = (a + b) / 2
    return np.concatenate([box()[1:], [[a, middle, c], [middle, b, c]]])


def overlap(depth):
    return np.concatenate([box(), box((6, 6, 9), (2, 2, 10 - depth))])


STACK = np.concatenate([box(), box((4, 4, 4), (3, 3, 10))])
TIP = np.array([[0, 0, 0], [1, 0, 5], [0, 1, 5], [-1, -1, 5]], float)[[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]]
ROOF = prism([(0, 0), (2, 2), (-2, 2)], 0, 3)[:, :, [2, 0, 1]]
ZOO = {
    "sound": (box(), "pass"),
    "side by side": (np.concatenate([box(), box(at=(10, 0, 0))]), "warning"),
    "stacked": (STACK, "warning"),
    "tip on a face": (np.concatenate([box(), TIP + np.array([4, 5, 10])]), "warning"),
    "edge on a face": (np.concatenate([box(), ROOF + np.array([3, 5, 10])]), "warning"),
    "overlap of 0.1 um": (overlap(1e-4), "warning"),
    "overlap of 15 um": (overlap(0.015), "warning"),
    "overlap of 30 um": (overlap(0.03), "error"),
    "overlap of 4 mm": (overlap(4.0), "error"),
    "needle": (np.concatenate([box(), box((0.06, 0.06, 12), (9.95, 9.95, -1))]), "warning"),
    "fin": (np.concatenate([box(), fin(other_diagonals=False)]), "error"),
    "fin of other triangles": (np.concatenate([box(), fin(other_diagonals=True, cells=3)]), "error"),
    "narrow fin": (np.concatenate([box(), fin(other_diagonals=True) * [0.01, 0.01, 1]]), "warning"),
    "cavity at the surface": (np.concatenate([box(), box((4, 4, 4), (3, 3, 6))[:, ::-1]]), "error"),
    "hollow": (np.concatenate([box(), box((4, 4, 4), (3, 3, 3))[:, ::-1]]), "warning"),
    "nested": (np.concatenate([box(), box((4, 4, 4), (3, 3, 3))]), "error"),
    "foil inside": (np.concatenate([box(), box((4, 4, 0.01), (3, 3, 3))]), "warning"),
    "pierced": (np.concatenate([box(), box((4, 4, 20), (3, 3, -5))]), "error"),
    "in line": (np.concatenate([box(), box((20, 10, 10), (5, 0, 0))]), "error"),
    "twice": (np.concatenate([box(), box()]), "error"),
    "bow tie": (BOW_TIE, "error"),
    "pentagram": (pentagram(False), "error"),
    "fold": (_folded(1), "error"),
    "slight fold": (_folded(0.05), "warning"),
    "wave": (_waves(0.015, 0.5), "warning"),
    "deep wave": (_waves(0.05, 0.5), "error"),
    "hole": (box()[1:], "error"),
    "crack": (_crack(), "warning"),
    "turned over": (np.concatenate([box()[:1, ::-1], box()[1:]]), "error"),
    "inside out": (box()[:, ::-1], "error"),
}  # fmt: skip


def verdict(triangles, form):
    if form == "stl":
        return check_bytes(stl(triangles), "a.stl").verdict
    corners, faces = np.unique(np.asarray(triangles, np.float32).reshape(-1, 3), axis=0, return_inverse=True)
    return check_bytes(obj(corners, faces.reshape(-1, 3)).encode(), "a.obj").verdict


def _rotations(name, seeds):
    body, right = ZOO[name]
    wrong = []
    for seed in seeds:
        moved = turned(body, seed, 1.0, 60.0 * (seed % 3), bool(seed % 2))
        wrong += [(seed, form, said) for form in ("stl", "obj") if (said := verdict(moved, form)) != right]
    assert not wrong
    assert verdict(body, "stl") == verdict(body, "obj") == right


@pytest.mark.parametrize("name", ZOO)
def test_a_file_turned_at_random_keeps_its_verdict(name):
    _rotations(name, range(2))


@pytest.mark.long
@pytest.mark.parametrize("name", ZOO)
def test_a_file_turned_at_random_500_times_keeps_its_verdict(name):
    _rotations(name, range(500))


@pytest.mark.parametrize("name", [name for name in ZOO if name not in ("crack", "hole", "turned over")])
def test_a_file_cut_into_finer_faces_keeps_its_verdict(name):
    body, right = ZOO[name]
    assert verdict(pieces(body, 2), "stl") == right
    assert verdict(pieces(turned(body, 7), 1), "obj") == right


@pytest.mark.parametrize("step", [0.5, 0.1])
@pytest.mark.parametrize(("depth", "right"), [(0.015, "warning"), (0.05, "error")])
def test_a_wave_is_judged_by_its_depth_not_by_its_faces(depth, right, step):
    assert verdict(_waves(depth, step), "stl") == right
