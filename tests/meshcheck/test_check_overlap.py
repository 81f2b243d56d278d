"""A shell that overlaps itself (G008), and walls and gaps without thickness (G009)."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from manifold3d import triangulate
from shapes import FORMATS, box, fin, in_format, obj, stl, surface, text_ply, turned

from unitcad.meshcheck import check_bytes, check_mesh
from unitcad.meshcheck.geometry.mesh import weld_exact
from unitcad.meshcheck.rules.registry import rules

OVERLAP = {"G002", "G008", "T008", "G009", "T009"}


def codes(report):
    return {found.code for found in report.findings} - {"S001"}


def pentagram(peaks):
    """A prism over the star polygon {5/2}, 5 high; its walls share edges where they meet, so that no faces cross.

    Its middle pentagon is covered twice at top and bottom: by two fans, or by two pyramids of different height.
    """
    angle = np.radians(90 + 72 * np.arange(5))
    inner = 10 * np.sin(np.radians(18)) / np.sin(np.radians(126))
    rings = [np.stack([r * np.cos(a), r * np.sin(a)], axis=1) for r, a in ((10, angle), (inner, angle + np.pi / 5))]
    plan = np.concatenate(rings)

    def at(i, z):
        return [*plan[i], z]

    found = []
    for k in range(5):
        path = [k, 5 + k, 5 + (k + 1) % 5, (k + 2) % 5]
        for u, v in itertools.pairwise(path):
            found += [[at(u, 0), at(v, 0), at(v, 5)], [at(u, 0), at(v, 5), at(u, 5)]]
    caps = [(k, 5 + k, 5 + (k - 1) % 5) for k in range(5)]
    if peaks:
        for height in (1, 3):
            for k in range(5):
                u, v = 5 + k, 5 + (k + 1) % 5
                found += [[at(u, 5), at(v, 5), [0, 0, 5 + height]], [at(v, 0), at(u, 0), [0, 0, -height]]]
    else:
        caps += [(5 + s, 5 + (s + j) % 5, 5 + (s + j + 1) % 5) for s in (0, 2) for j in (1, 2, 3)]
    for a, b, c in caps:
        found += [[at(a, 5), at(b, 5), at(c, 5)], [at(a, 0), at(c, 0), at(b, 0)]]
    return np.array(found)


def double_sphere(n=6):
    """A sphere that goes round twice between its poles; the second round is listed apart and has other diagonals."""
    points = [[0.0, 0.0, 10.0], [0.0, 0.0, -10.0]]
    place = {}
    for i in range(1, n):
        for j in range(4 * n):
            place[i, j] = len(points)
            theta, phi = np.pi * i / n, 2 * np.pi * (j % (2 * n)) / (2 * n)
            points.append([10 * np.sin(theta) * np.cos(phi), 10 * np.sin(theta) * np.sin(phi), 10 * np.cos(theta)])
    faces = []
    for j in range(4 * n):
        k = (j + 1) % (4 * n)
        faces += [[0, place[1, j], place[1, k]], [1, place[n - 1, k], place[n - 1, j]]]
        for i in range(1, n - 1):
            a, b, c, d = place[i, j], place[i + 1, j], place[i + 1, k], place[i, k]
            faces += [[a, b, c], [a, c, d]] if j < 2 * n else [[a, b, d], [b, c, d]]
    return np.array(points), np.array(faces)


def prisms(triangles, height=5):
    """Upright prisms over triangles in plan that turn anticlockwise or clockwise; common walls are left out."""
    found, sides = [], {}
    for corners in triangles:
        a, b, c = corners
        found += [[[*a, height], [*b, height], [*c, height]], [[*a, 0], [*c, 0], [*b, 0]]]
        for side in ((a, b), (b, c), (c, a)):
            sides[side] = sides.get(side, 0) + 1
    for (u, v), n in sides.items():
        for _ in range(n - sides.get((v, u), 0)):
            found += [[[*u, 0], [*v, 0], [*v, height]], [[*u, 0], [*v, height], [*u, height]]]
    return np.array(found, float)


BOW_TIE = prisms([((0, 0), (5, -3), (5, 3)), ((0, 0), (-5, -4), (-5, 4))])
TWO_WEDGES = prisms([((0, 0), (5, -3), (5, 3)), ((0, 0), (-5, 4), (-5, -4))])
EDGE_TO_EDGE = np.concatenate([box(), box(at=(10, 10, 0))])


@pytest.mark.parametrize(
    "body", [pentagram(True), pentagram(False), BOW_TIE], ids=["pentagram with peaks", "pentagram", "bow tie"]
)
@pytest.mark.parametrize("name", FORMATS)
def test_a_shell_that_passes_through_itself_along_edges(body, name, judge):
    for seed, scale, shift, mirror in ((0, 1, 0, False), (1, 1, 20, True), (2, 7.3, 100, False), (3, 0.3, 1, True)):
        moved = turned(body, seed, scale, shift, mirror) if seed else body
        found = {item.code: item for item in judge(in_format(moved, name), name).findings}
        assert "G001" not in found
        assert found["G008"].severity == ("warning" if name == "part.3mf" else "error")
    assert rules()["G008"].severity == "error"


@pytest.mark.parametrize("listed_apart", [False, True])
@pytest.mark.parametrize("form", [text_ply, obj], ids=["ply", "obj"])
def test_vertices_listed_apart_do_not_hide_an_overlap(listed_apart, form, judge):
    points, faces = double_sphere()
    if not listed_apart:
        points, faces = weld_exact(points[faces])
    name = "part.ply" if form is text_ply else "part.obj"
    report = judge(form(points, faces), name)
    assert report.verdict == "error"
    assert codes(report) & {"G008", "G002", "T009"}
    assert codes(check_mesh(turned(points, 3), faces)) & OVERLAP


@pytest.mark.parametrize("body", [EDGE_TO_EDGE, TWO_WEDGES], ids=["cubes", "wedges"])
@pytest.mark.parametrize("apart", [False, True])
def test_solids_that_share_an_edge_do_not_overlap(body, apart):
    for seed in range(6):
        moved = turned(body, seed, 1 + seed, 10 * seed, bool(seed % 2)).astype(np.float32).astype(float)
        points, faces = weld_exact(moved)
        if apart:
            half = len(moved) // 2 if body is EDGE_TO_EDGE else None
            if half is None:
                continue
            (one, first), (other, second) = weld_exact(moved[:half]), weld_exact(moved[half:])
            points, faces = np.concatenate([one, other]), np.concatenate([first, second + len(one)])
        assert codes(check_mesh(points, faces)) <= {"G003", "T003"}


@settings(max_examples=40)
@given(
    seed=st.integers(0, 10**6),
    values=st.sampled_from([(0, 1), (0, 1, 2), (-1, 0, 1), (0, 1, 2, 3)]),
    turn=st.booleans(),
)
def test_every_winding_number_but_0_and_1_is_an_error(seed, values, turn):
    """Random cells with a winding number each, and the surface between them: neighbours differ by one at most, so that
    no face is there twice; where edges meet the surface touches itself in every way that a grid has.
    """
    rng = np.random.default_rng(seed)
    field = rng.choice(values, (3, 3, 3), p=[0.5, 0.5] if len(values) == 2 else None)
    for _ in range(40):  # smooth until no neighbours differ by more
        padded = np.pad(field, 1)
        low = np.full(field.shape, -9)
        for axis in range(3):
            for way in (-1, 1):
                low = np.maximum(low, np.roll(padded, way, axis)[1:-1, 1:-1, 1:-1] - 1)
        field = np.maximum(field, low)
    padded = np.pad(field, 1)
    if any(np.abs(np.diff(padded, axis=axis)).max() > 1 for axis in range(3)) or not field.any():
        return
    body = surface(field, rng)
    body = turned(body, seed, 3.0, 20, bool(seed % 2)) if turn else body
    report = check_bytes(stl(body), "a.stl")
    errors = {found.code for found in report.findings if found.severity == "error"}
    assert bool(errors) == (not {0, 1} >= set(field.ravel().tolist())), (errors, field)


@settings(max_examples=40)
@given(n=st.integers(4, 12), seed=st.integers(0, 10**6), turn=st.booleans(), scale=st.sampled_from([0.3, 1.0, 40.0]))
def test_faces_of_one_concave_polygon_are_not_accused(n, seed, turn, scale):
    """Top and bottom of a prism are one concave polygon each, cut into triangles that do not overlap."""
    rng = np.random.default_rng(seed)
    angle = 2 * np.pi * (np.arange(n) + rng.uniform(-0.3, 0.3, n)) / n
    radius = 10 * np.where(np.arange(n) % 2, rng.uniform(0.15, 0.5, n), 1.0)
    outline = np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=1).astype(np.float32).astype(float)
    low, high = (np.column_stack([outline, np.full(n, z)]) for z in (0.0, 5.0))
    cut = np.array(triangulate([outline]))
    sides = [[[low[k], low[k - n + 1], high[k - n + 1]], [low[k], high[k - n + 1], high[k]]] for k in range(n)]
    body = np.concatenate([high[cut], low[cut][:, ::-1], np.array(sides).reshape(-1, 3, 3)])
    body = turned(body, seed, scale, 3 * scale, bool(seed % 2)) if turn else body
    for name in ("binary.stl", "part.ply"):
        content = in_format(body, name)
        report = check_bytes(content if isinstance(content, bytes) else content.encode(), name)
        assert codes(report) == set()


@pytest.mark.parametrize("cells", [1, 2, 5])
@pytest.mark.parametrize("place", ["attached", "beside", "alone", "on a face", "in a corner"])
@pytest.mark.parametrize("seed", range(3))
def test_a_fin_is_an_error_whichever_way_its_quads_are_cut(cells, place, seed):
    verdicts = []
    for other in (False, True):
        sheet = fin(other_diagonals=other, cells=cells)
        if place == "beside":
            sheet = sheet - 20
        elif place == "on a face":
            sheet = sheet * 0.5 + [7, 7, 10]
        elif place == "in a corner":
            sheet = sheet * [1, 1, 0.5] + [0, 0, -10]
        body = sheet if place == "alone" else np.concatenate([box(), sheet])
        if seed:
            body = turned(body, seed, 1 + seed, 10, bool(seed % 2))
        verdicts.append(check_bytes(stl(body), "a.stl").verdict)
    assert verdicts == ["error", "error"]


@pytest.mark.parametrize("gap", [0.0, 1e-3])
@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(
    ("parts", "thin"),
    [
        (lambda gap: [box(), box((4, 4, 4), (3, 3, 10 + gap))], False),
        (lambda gap: [box(), box((6, 6, 6), (2, 2, 2))[:, ::-1], box((4, 4, 4), (3, 3, 2 + gap))], False),
        (lambda gap: [box(), box((4, 4, 4), (3, 3, 6 - gap))[:, ::-1]], True),
        (lambda gap: [box(), box((10, 10, 4), (0, 0, 10 + gap))], False),
        (lambda gap: [box(), box((4, 4, 4), (6 - gap, 6 - gap, 6 - gap))[:, ::-1]], True),
    ],
    ids=["stacked", "in a cavity", "cavity at the surface", "stacked flush", "cavity in the corner"],
)
def test_solids_touch_but_a_cavity_at_the_surface_leaves_no_wall(parts, thin, gap, seed):
    body = np.concatenate(parts(gap))
    if seed:  # quarter turns keep faces in one plane
        body = np.roll(body, seed, axis=2) * [1, 1, 1] + [seed, -seed, 0]
    found = codes(check_bytes(stl(body), "a.stl"))
    assert bool(found & {"G009", "T009"}) == (thin and gap == 0)
    assert not found & {"G001", "G002", "G008"}
