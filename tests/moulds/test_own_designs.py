"""A Design object in a user's file is honoured like a shipped one, with tooling of its own too."""

import re
from pathlib import Path

import pytest
from faulty_sets import broken, of_spec

from unitcad import designs
from unitcad.errors import Refusal, UnitcadError
from unitcad.pipeline.write import build
from unitcad.validation import load, templates

EMBEDDED = (Path(designs.__file__).parent / "embedded.py").read_text("utf-8")
SPEC = """
name = "own"
design = "own.py:DESIGN"
diameter_mm = 14.0
[[layers]]
material = "ecoflex-00-30"
wall_mm = 2.5
[output]
formats = ["stl"]
"""
PLAIN = """
from unitcad.designs import Design
from unitcad.designs.dimensions import concentric
from unitcad.shape import ring

def layers(spec, dims):
    return {"layer1": ring(dims.cavity_radius, dims.outer_radius, 0, dims.core_height)}

def dimensions(spec):
    return concentric(spec, spec.motor.thickness_mm, None)

DESIGN = Design(name="plain", about="a ring", layers=layers, dimensions=dimensions, MORE)
"""


def written(folder, code, spec=SPEC):
    """Write a design and its spec."""
    (folder / "own.py").write_text(code)
    (folder / "spec.toml").write_text(spec)
    return folder / "spec.toml"


def stl_files(folder):
    """Return the STL files of a result without their headers, which hold names."""
    return {str(file.relative_to(folder)): file.read_bytes()[80:] for file in sorted(folder.rglob("*.stl"))}


def test_a_copy_of_a_shipped_design_gives_the_same_files(tmp_path):
    text = templates()["embedded"].read_text("utf-8")
    copy = written(tmp_path, EMBEDDED, text.replace('design = "embedded"', 'design = "own.py:DESIGN"'))
    change = {"output.formats": ["stl"]}
    known, own = build(load("embedded", change), tmp_path / "known"), build(load(copy, change), tmp_path / "own")
    assert stl_files(own.folder) == stl_files(known.folder) != {}
    for key in ("label", "outputs", "mould_checks", "skipped", "warnings", "air_ring_mm"):
        assert own.manifest[key] == known.manifest[key]
    casting = [re.sub(r"(?m)^# .*", "", (done.folder / "casting.md").read_text()) for done in (own, known)]
    assert casting[0] == casting[1]
    levels = [(done.manifest["estimate"] or {})["level"] for done in (own, known)]
    assert levels[0] == levels[1]


def test_a_design_s_limits_are_the_spec_s(tmp_path):
    with pytest.raises(Refusal, match=r"layers\.0\.cap_mm = 1: an embedded layer is an open ring"):
        load(written(tmp_path, EMBEDDED), {"layers.0.cap_mm": 1.0})


SLEEVE = """
from unitcad.designs import Design, Tooling
from unitcad.designs.dimensions import concentric
from unitcad.moulds.base import stand
from unitcad.moulds.pieces import blade
from unitcad.moulds.cup import cup_blank, groove, recess
from unitcad.moulds.layout import Frame
from unitcad.moulds.pieces import base_piece, blade_piece, cup_piece
from unitcad.shape import cut, cylinder, moved, ring

def layers(spec, dims):
    return {"layer1": ring(dims.cavity_radius, dims.outer_radius, 0, dims.core_height)}

def dimensions(spec):
    return concentric(spec, spec.motor.thickness_mm, None)

def tooling(spec, cast):
    dims = dimensions(spec)
    frame, rim = Frame.of(spec, dims), dims.heights[0]
    lay = frame.lay
    core = cut(cylinder(dims.cavity_radius, -1, rim), [cylinder(1, RELIEF, rim + 1)])
    base = stand(frame, [moved(core, cell.x, cell.y) for cell in lay.cells])
    bores = [moved(cylinder(dims.outer_radius, -1, rim + 1), cell.x, cell.y) for cell in lay.cells]
    grooves = [groove(frame, 0, cell) for cell in lay.cells]
    cup = cut(cup_blank(frame, rim), [recess(frame), *bores, *grooves])
    return Tooling(dims, lay, (base_piece(base), cup_piece(1, cup), blade_piece(blade(lay, rim))), seals=((),))

DESIGN = Design(name="sleeve", about="a ring", layers=layers, dimensions=dimensions, tooling=tooling)
"""


def test_a_design_s_own_tooling_is_checked_like_any_other(tmp_path):
    """The core has a blind hole, which no shipped tooling has: its volume is the hole's."""
    path = written(tmp_path, SLEEVE.replace("RELIEF", "1"))
    for cavities in ([1, 1], [2, 1]):
        moulds = of_spec(load(path, {"moulds.cavities": cavities}))
        assert broken(moulds) == set()
        assert [tool.name for tool in moulds.plan.tools] == ["base", "cup1", "blade"]
    solid = of_spec(load(path)).solids["base"]
    whole = of_spec(load(written(tmp_path, SLEEVE.replace("RELIEF", "1.99")))).solids["base"]
    # Over the seat: the two bases' labels differ below it.
    hole = whole.trim_by_plane((0, 0, 1), 0).volume() - solid.trim_by_plane((0, 0, 1), 0).volume()
    assert hole == pytest.approx(3.14159 * 0.99, rel=2e-3)
    done = build(load(path), tmp_path / "out", only=("unit", "moulds", "casting"))
    assert done.ok
    assert {"moulds/base.stl", "moulds/step1-cup.stl", "casting.md"} <= set(done.manifest["files"])


def test_a_core_too_small_in_a_design_s_own_tooling_is_found(tmp_path):
    narrow = SLEEVE.replace("cylinder(dims.cavity_radius, -1, rim)", "cylinder(dims.cavity_radius - 0.2, -1, rim)")
    assert "C100" in broken(of_spec(load(written(tmp_path, narrow.replace("RELIEF", "1")))))


@pytest.mark.parametrize(
    ("more", "why"),
    [
        ('tooling="concentrical"', "own.py:DESIGN: tooling is 'concentrical', not a function or one of"),
        ('opens="left"', "own.py:DESIGN: opens is 'left'"),
        ("tooling=lambda spec, cast: None", "own.py:DESIGN: tooling returns a NoneType, not a Tooling"),
        ("tooling=lambda spec, cast: cast[1]", r"own.py:DESIGN \(line 12\): IndexError"),
        ("advice=lambda spec, dims: 'thin'", "own.py:DESIGN: advice does not return a list of sentences"),
        ("skipped=lambda spec: ['tongue']", "own.py:DESIGN: skipped does not return a list of pairs of texts"),
        ("assembly=lambda spec, dims: [1 / 0]", r"own.py:DESIGN \(line 12\): ZeroDivisionError"),
        ("limits=lambda spec, dims: spec.nothing", r"own.py:DESIGN \(line 12\): AttributeError"),
    ],
)
def test_what_a_design_has_wrong_is_one_sentence(more, why, tmp_path):
    with pytest.raises(UnitcadError, match=why):
        build(load(written(tmp_path, PLAIN.replace("MORE", more))), tmp_path / "out")
    assert not (tmp_path / "out").exists() or not list((tmp_path / "out").glob("own*"))


@pytest.mark.parametrize(
    ("old", "new", "why"),
    [
        ("(base_piece(base), cup_piece(1, cup), ", "(cup_piece(1, cup), ", "its tooling has no base"),
        ("cup_piece(1, cup)", "cup_piece(2, cup)", "its tooling has no cup1"),
        ("cup_piece(1, cup),", "cup_piece(1, cup), cup_piece(1, cup),", "its tooling has cup1 twice"),
        ("seals=((),)", "seals=()", "its tooling has seals of 0 pours, not of 1"),
        ("seals=((),)", "seals=((),), grooves=(True, True)", "its tooling has grooves of 2 pours, not of 1"),
        ("return concentric(spec, spec.motor.thickness_mm, None)", "return 1", "dimensions returns a int"),
    ],
)
def test_what_a_tooling_lacks_is_one_sentence(old, new, why, tmp_path):
    assert old in SLEEVE
    with pytest.raises(UnitcadError, match=f"design own.py:DESIGN: {why}"):
        of_spec(load(written(tmp_path, SLEEVE.replace("RELIEF", "1").replace(old, new))))


def test_a_lid_needs_tooling_that_has_one(tmp_path):
    with pytest.raises(UnitcadError, match="its tooling has no lid1"):
        of_spec(load(written(tmp_path, SLEEVE.replace("RELIEF", "1")), {"moulds.pour": "injected"}))
