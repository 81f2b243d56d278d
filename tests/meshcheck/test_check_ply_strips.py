"""Triangle strips of PLY, as the Stanford scans have them: text and binary of either order."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from conftest import Judge
from shapes import CUBE_CORNERS

# A cube of two strips; a third one turns at -1, and a fourth leads on by vertices named twice.
AROUND = [0, 1, 2, 3, 6, 7, 4, 5, 0, 1]
SIDES = [[0, 2, 4, 6], [1, 5, 3, 7]]
WAYS = {
    "three strips": [AROUND, *SIDES],
    "one strip with breaks": [[*AROUND, -1, *SIDES[0], -1, *SIDES[1]]],
    "one strip that leads on": [[*AROUND, 1, 0, *SIDES[0], 6, 1, *SIDES[1]]],
}


def ply(strips: list[list[int]], order: str) -> bytes:
    kind = {"": "ascii", "<": "binary_little_endian", ">": "binary_big_endian"}[order]
    corners = CUBE_CORNERS * 10
    head = ["ply", f"format {kind} 1.0", "element vertex 8", *(f"property float {axis}" for axis in "xyz")]
    head += [f"element tristrips {len(strips)}", "property list int int vertex_indices", "end_header", ""]
    if not order:
        rows = [" ".join(map(str, corner)) for corner in corners]
        rows += [" ".join(map(str, [len(strip), *strip])) for strip in strips]
        return ("\n".join(head) + "\n".join(rows) + "\n").encode()
    body = b"".join(struct.pack(f"{order}3f", *corner) for corner in corners)
    body += b"".join(struct.pack(f"{order}{len(strip) + 1}i", len(strip), *strip) for strip in strips)
    return "\n".join(head).encode() + body


@pytest.mark.parametrize("order", ["", "<", ">"])
@pytest.mark.parametrize("way", WAYS)
def test_strips_of_a_cube_are_a_cube(way: str, order: str, judge: Judge) -> None:
    report = judge(ply(WAYS[way], order), "a.ply")
    assert report.findings == ()
    assert report.facts.triangles == 12
    assert report.facts.volume_mm3 == pytest.approx(1000)


def test_a_strip_that_lacks_its_last_vertex_has_a_hole(judge: Judge) -> None:
    assert judge(ply([AROUND, SIDES[0], SIDES[1][:-1]], ""), "a.ply").has("T001")
    assert np.isclose(judge(ply([AROUND, *SIDES], "<"), "a.ply").facts.area_mm2, 600)
