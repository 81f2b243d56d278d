"""Work grows with the faces: counted, not timed. What reaches the exact stages and manifold3d, by size."""

import numpy as np
import pytest
from shapes import CUBE_CORNERS, CUBE_FACES

from unitcad.meshcheck import check_mesh
from unitcad.meshcheck.geometry import crossings, nesting, predicates


def cubes(n, turned=False):
    """n cubed cubes of 10 mm that touch."""
    place = np.stack(np.meshgrid(*[np.arange(n)] * 3, indexing="ij"), axis=-1).reshape(-1, 1, 3)
    points = (CUBE_CORNERS + place).reshape(-1, 3) * 10
    if turned:
        turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
        points = (points @ turn).astype(np.float32).astype(float)
    return points, (CUBE_FACES + 8 * np.arange(n**3)[:, None, None]).reshape(-1, 3).astype(np.int32)


def plate(n, around=24):
    """A plate with n squared round holes, cut into triangles by manifold3d: rims with fans of thin triangles."""
    from manifold3d import CrossSection, Manifold

    section = CrossSection.square((10.0 * n, 10.0 * n))
    for i in range(n):
        for j in range(n):
            section -= CrossSection.circle(3.0, around).translate((10.0 * i + 5, 10.0 * j + 5))
    mesh = Manifold.extrude(section, 4.0).to_mesh64()
    return np.asarray(mesh.vert_properties)[:, :3].astype(np.float32).astype(float), np.asarray(
        mesh.tri_verts, np.int32
    )


@pytest.fixture
def work(monkeypatch):
    """Pairs that get past the sieves, pairs decided and booleans, a face of the mesh."""
    count = {}

    def watch(module, name, key, rows):
        real = getattr(module, name)

        def counted(*given):
            count[key] = count.get(key, 0) + rows(*given)
            return real(*given)

        monkeypatch.setattr(module, name, counted)

    watch(crossings, "_decide_exactly", "sieved", lambda _, i, *others: len(i))
    watch(predicates, "meet", "decided", lambda a, _: len(a))
    watch(nesting, "_compare", "booleans", lambda _, pairs, *__: len(pairs))

    def judged(built):
        count.clear()
        count.update(dict.fromkeys(("sieved", "decided", "booleans"), 0))
        check_mesh(*built)
        return {key: value / len(built[1]) for key, value in count.items()}

    return judged


def test_touching_cubes(work):
    """A cube has 26 neighbours at most, and the share of those inside grows a little with the size."""
    small, large = work(cubes(5)), work(cubes(10))
    assert large["sieved"] < 1.3 * small["sieved"] < 60
    assert large["decided"] <= 1.3 * small["decided"] < 25
    assert large["booleans"] == 0


def test_touching_cubes_that_are_turned(work):
    small, large = work(cubes(4, turned=True)), work(cubes(8, turned=True))
    assert large["sieved"] < 1.5 * small["sieved"] < 90
    assert large["booleans"] <= 26 / 2 / 12


def test_plates_with_round_holes(work):
    small, large = work(plate(5)), work(plate(12))
    assert large["sieved"] < 2 * small["sieved"] < 3
    assert large["decided"] < 0.2


def test_one_missing_face_makes_no_more_work(work):
    points, faces = plate(5)
    assert work((points, faces[1:]))["sieved"] < 1.1 * work((points, faces))["sieved"] + 0.1
