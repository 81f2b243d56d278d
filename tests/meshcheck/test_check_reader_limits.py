"""What readers cost: time that grows with the file, memory that grows with its vertices and faces alone."""

import time
import tracemalloc

import numpy as np
import pytest
from polygon_files import obj, off, ply
from shapes import CUBE_CORNERS, box, text_stl

from unitcad.meshcheck.readers import reader_of
from unitcad.meshcheck.rules.f_file import Deadline, Limits, Unreadable

FACET = "\n".join(text_stl(box()).split("\n")[1:8]) + "\n"
CUBE = obj(CUBE_CORNERS, [[0, 1, 3], [0, 3, 2], [4, 6, 7]])


def read(name, content):
    try:
        reader_of(name.rpartition(".")[2])(memoryview(content), Limits(), Deadline(600), [])
    except Unreadable as stop:
        assert not any(found.code == "F011" for found in stop.findings)


def peak(name, content):
    """The most memory that reading takes at a time, bytes."""
    tracemalloc.start()
    try:
        read(name, content)
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def grid(n):
    """A square of n x n quads."""
    x, y = np.meshgrid(np.arange(n + 1.0), np.arange(n + 1.0))
    points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
    first = (np.arange(n)[:, None] * (n + 1) + np.arange(n)).reshape(-1)
    return points, np.column_stack([first, first + 1, first + n + 2, first + n + 1]).tolist()


LINEAR  = {
    "solid lines": ("a.stl", lambda n: b"solid a\n" * n),
    "solids that do not end": ("a.stl", lambda n: f"solid a\n{FACET}".encode() * n),
    "solids": ("a.stl", lambda n: f"solid a\n{FACET}endsolid a\n".encode() * n),
    "materials": ("a.obj", lambda n: CUBE + b"usemtl a\nf 1 2 3\n" * n),
    "objects": ("a.obj", lambda n: CUBE + b"o a\nf 1 2 3\n" * n),
    "blank lines": ("a.obj", lambda n: b"\n \n\t" * n + CUBE),
    "slashes": ("a.obj", lambda n: CUBE + b"f " + b"/" * 9 * n),
    "comments": ("a.off", lambda n: b"OFF\n" + b"# # #\n" * n + b"3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n"),
    "a round polygon": ("a.off", lambda n: off(round_(n), [list(range(n))])),
    "a polygon with a notch": ("a.off", lambda n: off(round_(n) * ([0.5, 0.5, 1], 1)[n % 2], [[*range(n - 1)]])),
    "faces of differing sizes": ("a.ply", lambda n: ply(CUBE_CORNERS, [[0, 1, 2], [0, 1, 2, 3]] * n, ">")),
}  # fmt: skip


def round_(n):
    angle = np.linspace(0, 2 * np.pi, n, endpoint=False)
    return np.column_stack([np.cos(angle), np.sin(angle), np.zeros(n)])


@pytest.mark.parametrize("name", LINEAR)
def test_time_grows_with_the_size(name):
    """Eight times the size takes at most 24 times as long (64 where each line is looked for from the start)."""
    file, made = LINEAR[name]

    def seconds(content):
        times = []
        for _ in range(2):
            begin = time.process_time()
            read(file, content)
            times.append(time.process_time() - begin)
        return min(times)

    n = 1500
    assert seconds(made(8 * n)) < 24 * seconds(made(n)) + 0.05


def test_materials_take_no_memory():
    """trimesh makes a mesh of all vertices for each material."""
    points, faces = grid(60)
    plain = obj(points, faces)
    head, _, rows = plain.partition(b"\nf")
    lines = rows.split(b"\nf")
    split = b"".join(b"\nusemtl m%d\nf" % (i % 400) + line for i, line in enumerate(lines))
    assert peak("a.obj", head + split) < 1.3 * peak("a.obj", plain) + 1e6


@pytest.mark.parametrize("file", ["a.obj", "a.off", "text.ply", "a.ply"])
def test_memory_is_a_few_times_the_meshs(file):
    """Less than 500 bytes for a quad and its vertex, which take 24 + 32 as numbers and 72 as welded triangles."""
    points, faces = grid(150)
    content = {"a.obj": obj(points, faces), "a.off": off(points, faces), "text.ply": ply(points, faces, ""),
               "a.ply": ply(points, faces)}[file]  # fmt: skip
    assert peak(file, content) < 500 * len(faces) + 60 * 200_000
