"""Damaged meshes, from seeds: every reader gives a verdict, in time, and no face is lost without a word.

The body is one closed shell, so that a file of which some faces are lost has a hole: without an error it must have all.
"""

import sys
import time
import zipfile
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "meshcheck"))

from polygon_files import every_way
from shapes import mesh_xml, model_xml, package, stl, text_stl

from unitcad.meshcheck import Limits, Options, check_bytes

OUTLINE = [(0.0, 0.0), (9.0, 0.0), (9.0, 4.0), (4.0, 4.0), (4.0, 9.0), (0.0, 9.0)]
LIMITS = Limits(max_faces=100_000, seconds=20)
TRIANGLES = 20


def body():
    """A prism over an L: two concave caps of six corners and six quads."""
    n = len(OUTLINE)
    points = np.array([(x, y, z) for z in (0.0, 5.0) for x, y in OUTLINE])
    faces = [list(range(n))[::-1], list(range(n, 2 * n))]
    return points, faces + [[i, (i + 1) % n, n + (i + 1) % n, n + i] for i in range(n)]


def files():
    """The body in every format by a name with the format's suffix."""
    points, faces = body()
    made = every_way(points, faces)
    caps = [(0, 1, 2), (0, 2, 3), (0, 3, 5), (3, 4, 5)]
    rows = [row[::-1] for row in caps] + [tuple(6 + i for i in row) for row in caps]
    rows += [row for a, b, c, d in faces[2:] for row in ((a, b, c), (a, c, d))]
    triangles = np.array(rows)
    made |= {"binary.stl": stl(points[triangles]), "text.stl": text_stl(points[triangles]).encode()}
    model = model_xml(f'<object id="1">{mesh_xml(points, triangles)}</object>')
    made |= {"packed.3mf": package(model), "stored.3mf": package(model, compression=zipfile.ZIP_STORED)}
    materials = (
        '<basematerials id="5"><base name="a" displaycolor="#FF0000"/></basematerials>'
        '<m:colorgroup id="6"><m:color color="#FFFFFF"/></m:colorgroup>'
        '<m:multiproperties id="7" pids="5 6"><m:multi pindices="0 0"/></m:multiproperties>'
        f'<object id="2" pid="7" pindex="0">{mesh_xml(points, triangles)}</object>'
        '<object id="1"><components><component objectid="2" transform="1 0 0 0 1 0 0 0 1 5 5 5"/></components></object>'
    )
    made["materials.3mf"] = package(model_xml(materials), compression=zipfile.ZIP_STORED)
    return made


FILES = files()


def damaged(data, rng):
    """The bytes after one to three kinds of damage."""
    for _ in range(int(rng.integers(1, 4))):
        size = max(len(data), 1)
        at, width = int(rng.integers(size)), int(rng.integers(1, 40))
        kind = int(rng.integers(9))
        some = rng.integers(0, 256, width, np.uint8).tobytes()
        if kind == 0:  # flipped bit
            data = data[:at] + bytes([data[at] ^ (1 << int(rng.integers(8)))]) + data[at + 1 :] if data else data
        elif kind == 1:  # lost
            data = data[:at] + data[at + width :]
        elif kind == 2:  # cut short
            data = data[:at]
        elif kind == 3:  # put in
            data = data[:at] + some + data[at:]
        elif kind == 4:  # repeated
            data = data[:at] + data[max(0, at - width) : at] + data[at:]
        elif kind == 5:  # written over
            data = data[:at] + some + data[at + width :]
        elif kind == 6:  # another digit, sign or space
            data = data[:at] + bytes([int(rng.choice(list(b"0123456789-+.e \n#/\\,")))]) + data[at + 1 :]
        else:  # a line is lost, or goes elsewhere
            lines = data.split(b"\n")
            line = lines.pop(int(rng.integers(len(lines))))
            if kind == 8:
                lines.insert(int(rng.integers(len(lines) + 1)), line)
            data = b"\n".join(lines)
    return data


@pytest.mark.parametrize("name", sorted(FILES))
def test_the_body_itself_is_sound(name):
    report = check_bytes(FILES[name], name)
    assert report.findings == ()
    assert report.facts.triangles == TRIANGLES
    assert report.facts.volume_mm3 == pytest.approx(5 * 56, rel=1e-5)


@pytest.mark.parametrize(
    "seeds", [range(25), pytest.param(range(25, 3000), marks=pytest.mark.long)], ids=["few", "many"]
)
@pytest.mark.parametrize("name", sorted(FILES))
def test_damage_is_never_silent(name, seeds):
    for seed in seeds:
        data = damaged(FILES[name], np.random.default_rng([seed, sorted(FILES).index(name)]))
        begin = time.monotonic()
        report = check_bytes(data, name, Options(limits=LIMITS))
        assert time.monotonic() - begin < 30, (name, seed)
        facts = report.facts
        assert facts.triangles is not None or report.verdict == "error", (name, seed)
        if report.verdict != "error":
            assert facts.watertight, (name, seed)
            assert facts.triangles >= TRIANGLES, (name, seed)
