"""The printer's plates: every piece once, all within the bed, none on another."""

import io
import zipfile
from itertools import combinations
from xml.etree import ElementTree

import numpy as np
import pytest

from tests.sample_bodies import LEADLESS
from unitcad.casting.plates import mould_plates
from unitcad.moulds.mould_set import MouldSet
from unitcad.pipeline.plan import threemf_content
from unitcad.validation import load


def _gang(*settings):
    return MouldSet(load(LEADLESS, settings))


SETS = {
    "one unit": lambda: _gang(),
    "as wide as the bed": lambda: _gang("moulds.cavities=[7, 7]"),
    "half as wide": lambda: _gang("moulds.cavities=[5, 5]"),
    "a small bed": lambda: _gang("moulds.cavities=[2, 2]", "moulds.bed_x_mm=70", "moulds.bed_y_mm=60"),
}


@pytest.mark.parametrize("name", SETS)
def test_all_pieces_lie_apart_on_the_bed(name):
    lie_apart(SETS[name]())


def lie_apart(moulds):
    """Check that every piece of a set lies within the bed, once and on no other."""
    plates = mould_plates(moulds)
    printed = [piece.name for piece in moulds.plan.pieces if piece.made == "printed"]
    assert sorted(body.name for plate in plates.values() for body in plate) == sorted(printed)
    bed = moulds.spec.moulds.bed_x_mm, moulds.spec.moulds.bed_y_mm
    for plate in plates.values():
        boxes = _boxes(threemf_content(moulds, plate, {}))
        assert len(boxes) == len(plate)
        for low, high in boxes:
            assert (low >= -1e-3).all()
            assert (high <= [side + 1e-3 for side in bed]).all()
        for one, other in combinations(boxes, 2):
            assert (one[1] < other[0]).any() or (other[1] < one[0]).any()


def _boxes(package):
    """The low and the high corner in plan of every item of a 3MF."""
    core = "{http://schemas.microsoft.com/3dmanufacturing/core/2015/02}"
    model = ElementTree.fromstring(zipfile.ZipFile(io.BytesIO(package)).read("3D/3dmodel.model"))
    meshes = {
        one.get("id"): np.array(
            [[float(vertex.get(axis, "")) for axis in "xy"] for vertex in one.iter(f"{core}vertex")]
        )
        for one in model.iter(f"{core}object")
    }
    found = []
    for item in model.iter(f"{core}item"):
        *turn, x, y, _ = map(float, item.get("transform", "").split())
        assert turn == [1, 0, 0, 0, 1, 0, 0, 0, 1]
        corners = meshes[item.get("objectid")] + (x, y)
        found.append(np.array([corners.min(axis=0), corners.max(axis=0)]))
    return found


def test_a_piece_goes_on_the_first_plate_with_room():
    plates = mould_plates(SETS["as wide as the bed"]())
    assert [[body.name for body in plate] for plate in plates.values()] == [["base", "blade"], ["cup1"], ["cup2"]]
    assert list(plates) == [f"moulds/moulds-{i}.3mf" for i in (1, 2, 3)]
    assert list(mould_plates(SETS["one unit"]())) == ["moulds/moulds.3mf"]
