"""Pictures by numpy alone: what covers what, against exact answers; names clear of everything; PNG against Pillow."""

import io
from itertools import combinations, product, starmap
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from unitcad.api.variant import Variant
from unitcad.export import raster
from unitcad.export.raster import Surface
from unitcad.pipeline.scenes import exploded_view, unit_cut_open
from unitcad.validation import templates

ROOT = Path(__file__).parents[1]

SQUARE = np.array([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], float)
FRONT = np.array([[0, 1, 2], [0, 2, 3]])  # seen from -y anticlockwise
BLUE, BROWN, CREAM = (0.2, 0.4, 0.6), (0.6, 0.5, 0.4), (0.9, 0.9, 0.7)


def view(size=(100, 100), reach=2.0):
    return raster.aim((0, -1, 0), np.zeros((1, 3)), size, reach)


def drawn(*surfaces, cut=np.inf, wires=False):
    """Pixels (height, width, 3), 0 to 255, twice as fine as the view."""
    layers = [raster.render(surface, view(), cut) for surface in surfaces]
    return raster.compose(layers, view(), wires)[0][..., :3].astype(int)


def test_a_square_covers_its_pixels_once():
    face, _ = raster.look(SQUARE, FRONT, view())
    covered = face >= 0
    assert covered.sum() == 50 * 50
    assert covered[25:75, 25:75].all()
    assert set(np.unique(face)) == {-1, 0, 1}


def test_the_nearer_face_is_seen_and_a_cut_takes_it_away():
    vertices = np.concatenate([SQUARE, SQUARE * 0.52 + [0, -1, 0], SQUARE * 0.52 + [0, 1, 0]])
    faces = np.concatenate([FRONT, FRONT + 4, FRONT + 8])
    face, depth = raster.look(vertices, faces, view())
    assert set(np.unique(face)) == {-1, 0, 1, 2, 3}
    assert (face >= 2).sum() == 26 * 26
    assert depth[50, 50] == pytest.approx(1, abs=0.01)
    assert set(np.unique(raster.rasterise(vertices, faces, view(), 0.5)[2])) == {-1, 0, 1}


@pytest.mark.parametrize("towards", [(1, -1.4, 0.9), (0, 0, 1), (0, 0, -1), (-0.1, 1, 0.15)])
@pytest.mark.parametrize("turned", [False, True])
def test_a_view_keeps_lengths_and_hands(towards, turned):
    camera = raster.aim(towards, np.array([[3.0, 4.0, 5.0]]), (400, 200), 10.0, turned)
    frame = np.stack([camera.right, camera.up, camera.eye])
    assert frame @ frame.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(frame) == pytest.approx(1)
    assert camera.project(np.array([3.0, 4.0, 5.0])).tolist() == [[200.0, 100.0, 0.0]]
    assert camera.scale == pytest.approx(10)
    assert turned == (camera.up[2] < 0 or (camera.up[2] == 0 and camera.up[1] < 0))


def test_front_back_and_background_have_their_colours():
    for faces, hue in ((FRONT, BLUE), (FRONT[:, ::-1], BROWN)):
        picture = drawn(Surface(SQUARE, faces, BLUE, inside=BROWN))
        assert picture[0, 0].tolist() == [255, 255, 255]
        shown = picture[80, 120] / picture[80, 120].max()
        assert shown == pytest.approx(np.array(hue) / max(hue), abs=0.01)
    assert (drawn(Surface(SQUARE, FRONT[:, ::-1], BLUE)) == 255).all()  # closed: only its front is drawn
    solid = drawn(Surface(SQUARE, FRONT[:, ::-1], BLUE, inside=CREAM), cut=5.0)
    flat = np.round(np.array(CREAM) * 255)
    assert {tuple(row) for row in solid[60:140, 60:140].reshape(-1, 3).tolist()} == {
        tuple(flat.astype(int).tolist()), tuple((flat * raster.HATCH).astype(int).tolist())
    }  # fmt: skip


def test_lines_run_round_smooth_patches_and_wires_along_all_sides():
    bent = np.concatenate([SQUARE, [[3, 1, -1], [3, 1, 1]]])  # a second square behind an edge of 27 degrees
    surface = Surface(bent, np.array([[0, 1, 2], [0, 2, 3], [1, 4, 5], [1, 5, 2]]), (1.0, 1.0, 1.0))
    plain, wired = drawn(surface).max(axis=2), drawn(surface, wires=True).max(axis=2)
    lit = plain[100, 60]
    dark = plain < 0.4 * lit
    assert set(np.flatnonzero(dark[100])) == {49, 50, 149, 150}  # not along the diagonal, which is at 99
    assert set(np.flatnonzero(wired[100] < 0.5 * lit)) - set(np.flatnonzero(dark[100])) <= {99, 100}
    assert wired[100, 99:101].min() == int(lit * raster.WIRE)


def faults(owner, boxes, ends):
    """What is wrong with names at `boxes` (left, right, top, bottom) of the layers whose leaders end at `ends`."""
    height, width = owner.shape
    found = []
    for (a, one), (b, other) in combinations(boxes.items(), 2):
        if one[0] < other[1] and other[0] < one[1] and one[2] < other[3] and other[2] < one[3]:
            found.append(f"{a} over {b}")
    for part, (left, right, top, bottom) in boxes.items():
        if left < 0 or top < 0 or right > width or bottom > height:
            found.append(f"{part} off the page")
        if (owner[max(round(top), 0) : round(bottom), max(round(left), 0) : round(right)] >= 0).any():
            found.append(f"{part} over a part")
        if owner[int(ends[part][1]), int(ends[part][0])] != part:
            found.append(f"{part}'s leader ends elsewhere")
    return found


SETS = [(name, []) for name in sorted(templates())] + [
    ("encapsulating", ["moulds.cavities=[2, 2]", 'moulds.pour="injected"']),
    ("encapsulating", ['moulds.printer="sla"']),
    ("templates/custom/strap-lugs.toml", []),
    ("templates/custom/film-closed.toml", []),
]


@pytest.mark.parametrize("draw", [exploded_view, unit_cut_open])
@pytest.mark.parametrize(("name", "changes"), SETS)
def test_names_in_the_pictures_of_all_templates(draw, name, changes, monkeypatch):
    named = []
    placed = []
    name_layers, place_names = raster.name_layers, raster.place_names
    monkeypatch.setattr(raster, "name_layers", lambda *a: (named.append(a[:3]), name_layers(*a))[1])
    monkeypatch.setattr(raster, "place_names", lambda *a: (placed.append(place_names(*a)), placed[-1])[1])
    draw(Variant.of(str(ROOT / name) if "/" in name else name, *changes))
    ((layers, labels, shown),) = named
    starts = np.cumsum([1, *(len(one.patches) for one in layers)])
    owner = np.searchsorted(starts, shown, "right") - 1
    written = {labels.index(label.text): label for label in placed[0]}
    cut_away = {"wire 1"} if draw is unit_cut_open else set()  # wires side by side: one is in the half that is gone
    assert sorted(label.text for label in placed[0]) == sorted(text for text in labels if text and text not in cut_away)
    boxes = {i: (one.left, one.left + one.width, one.top, one.top + one.height) for i, one in written.items()}
    assert faults(owner, boxes, {i: one.start for i, one in written.items()}) == []
    assert all(one.end for one in written.values())


def test_letters_lie_in_their_box_and_any_name_can_be_written():
    """Black pixels of a picture that shows nothing else, where the name's place is known."""
    for text in ("cup 1", "Qgjpqy ÀÖ|", "x" * 99, "mm² 层\n\0"):
        name = raster.Name(text, (0.0, 0.0, 0.0), on=True)
        camera = view((600, 200))
        (label,) = raster.place_names([name], np.zeros((200, 600), bool), camera)
        pixels = np.asarray(Image.open(io.BytesIO(raster.finish([], camera, [name])))).min(axis=2)
        rows, columns = np.nonzero(pixels < 128)
        assert len(rows) > 30
        assert label.left <= columns.min()
        assert columns.max() < label.left + label.width
        assert np.ptp(rows) < label.height


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("parts", [0, 3, 9, 200])
def test_a_name_takes_the_nearest_place_that_covers_least(parts, seed):
    """Counted pixel by pixel over every place, in pictures from empty to full."""
    rng = np.random.default_rng(10 * parts + seed)
    height, width = rng.integers(80, 400, 2)
    drawn = np.zeros((height, width), bool)
    for _ in range(parts):
        y, x = rng.integers(0, height), rng.integers(0, width)
        drawn[y : y + rng.integers(1, height), x : x + rng.integers(1, width)] = True
    x, y = rng.uniform(0, width), rng.uniform(0, height)
    wide, high = rng.integers(10, 60, 2)

    def cost(left, top):
        covered = drawn[top - 6 : top + high + 6, left - 6 : left + wide + 6].sum()
        return np.hypot(max(left - x, x - left - wide, 0.0), max(top - y, y - top - high, 0.0)) + 1e6 * covered

    places = product(range(8, width - 8 - wide + 1, 2), range(8, height - 8 - high + 1, 2))
    assert cost(*raster.find_free_box(drawn, (x, y), (wide, high))) == min(starmap(cost, places))
