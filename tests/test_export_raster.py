"""Pictures by numpy alone: what covers what, against exact answers; PNG against Pillow."""

from __future__ import annotations

import io

import numpy as np
import pytest
from PIL import Image

from unitcad.export import raster
from unitcad.export.marks import common_line

SQUARE = np.array([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], float)
FRONT = np.array([[0, 1, 2], [0, 2, 3]])  # seen from -y anticlockwise


def view(size: tuple[int, int] = (100, 100), reach: float = 2.0) -> raster.Camera:
    return raster.camera((0, -1, 0), np.zeros(3), reach, size)


def test_a_square_covers_its_pixels_once() -> None:
    seen = raster.look(SQUARE, FRONT, view())
    covered = seen.face >= 0
    assert covered.sum() == 50 * 50
    assert covered[25:75, 25:75].all()
    assert set(np.unique(seen.face)) == {-1, 0, 1}


def test_the_nearer_face_is_seen_and_a_cut_takes_it_away() -> None:
    vertices = np.concatenate([SQUARE, SQUARE * 0.52 + [0, -1, 0], SQUARE * 0.52 + [0, 1, 0]])
    faces = np.concatenate([FRONT, FRONT + 4, FRONT + 8])
    seen = raster.look(vertices, faces, view())
    assert set(np.unique(seen.face)) == {-1, 0, 1, 2, 3}
    assert (seen.face >= 2).sum() == 26 * 26
    assert seen.depth[50, 50] == pytest.approx(1)
    assert set(np.unique(raster.look(vertices, faces, view(), cut=0.5).face)) == {-1, 0, 1}


def test_of_two_faces_in_one_place_the_marked_one_is_seen() -> None:
    faces = np.concatenate([FRONT, FRONT[:, [1, 2, 0]]])
    for marked in ([2, 3], [0, 1]):
        first = np.isin(np.arange(4), marked)
        assert set(np.unique(raster.look(SQUARE, faces, view(), first=first).face)) == {-1, *marked}


@pytest.mark.parametrize("towards", [(1, -1.4, 0.9), (0, 0, 1), (0, 0, -1), (-0.1, 1, 0.15)])
def test_a_view_keeps_lengths_and_hands(towards: tuple[float, float, float]) -> None:
    camera = raster.camera(towards, np.array([3.0, 4.0, 5.0]), 10.0, (400, 200))
    frame = np.stack([camera.right, camera.up, camera.eye])
    assert frame @ frame.T == pytest.approx(np.eye(3), abs=1e-12)
    assert np.linalg.det(frame) == pytest.approx(1)
    assert camera.project(np.array([3.0, 4.0, 5.0])).tolist() == [[200.0, 100.0, 0.0]]
    assert camera.scale == pytest.approx(10)


def test_points_fit_into_their_view() -> None:
    points = np.random.default_rng(1).uniform(-7, 30, (50, 3))
    at = raster.camera((1, -1.4, 0.9), points.mean(axis=0), points, (300, 200)).project(points)
    assert (at[:, :2] > 0).all()
    assert (at[:, :2] < [300, 200]).all()
    assert ((np.ptp(at[:, :2], axis=0) / [300, 200]).max()) == pytest.approx(1 / 1.1)


def test_front_back_and_background_have_their_colours() -> None:
    colours, plain = np.tile([0.2, 0.4, 0.6], (2, 1)), np.array([True, True])
    for faces, hue in ((FRONT, np.array([0.2, 0.4, 0.6])), (FRONT[:, ::-1], np.array(raster.INSIDE))):
        seen = raster.look(SQUARE, faces, view())
        picture = raster.shade(SQUARE, faces, colours, plain, seen, view(), np.zeros((2, 3)))
        assert picture[0, 0].tolist() == [1, 1, 1]
        shown = picture[40, 60]
        assert shown / shown.max() == pytest.approx(hue / hue.max())
    solid = raster.shade(SQUARE, FRONT[:, ::-1], colours, plain, seen, view(), np.zeros((2, 3)), cut=True)
    assert {tuple(row) for row in solid[30:70, 30:70].reshape(-1, 3).round(6).tolist()} == {
        raster.CUT, tuple(round(c * 0.72, 6) for c in raster.CUT)
    }  # fmt: skip


def test_lines_run_along_the_sides_that_ask_for_them() -> None:
    seen = raster.look(SQUARE, FRONT, view())
    lines = np.array([[0.0, 0.0, 2.0], [0.0, 0.0, 0.0]])  # the diagonal
    picture = raster.shade(SQUARE, FRONT, np.ones((2, 3)), np.zeros(2, bool), seen, view(), lines)
    dark = picture.sum(axis=2) < 1.0
    row, column = np.nonzero(dark)
    assert dark.any()
    assert (np.abs((row - 25) + (column - 75)) <= 4).all()


def test_png_is_what_pillow_reads_back() -> None:
    picture = np.random.default_rng(2).random((37, 53, 3))
    data = raster.png(picture)
    assert data == raster.png(picture)
    assert np.array_equal(np.array(Image.open(io.BytesIO(data))), np.round(picture * 255).astype(np.uint8))


def test_the_line_of_two_triangles() -> None:
    flat = np.array([[-4, -4, 0], [4, -4, 0], [0, 4, 0]], float)
    upright = np.array([[-1, 0, -1], [1, 0, -1], [0, 0, 3]], float)
    line = common_line(flat, upright)
    assert line is not None
    assert sorted(line.tolist()) == [pytest.approx([-0.75, 0, 0]), pytest.approx([0.75, 0, 0])]
    assert common_line(flat, flat) is None
    assert common_line(flat, upright + np.array([0, 0, 5])) is None
