import math
import re

import pytest
from sample_bodies import tongue, tube

from unitcad.api.variant import Variant
from unitcad.errors import UnitcadError
from unitcad.kernels.mesh import realise
from unitcad.shape import Revolve, Union, cylinder, moved, polygon, turned
from unitcad.shape.tree import Body
from unitcad.validation import templates

occt = pytest.importorskip("unitcad.kernels.occt", exc_type=UnitcadError)
step = pytest.importorskip("unitcad.export.step", exc_type=UnitcadError)
import step_reader  # noqa: E402  it needs OCP

from benchmarks.accuracy import brep_measures  # noqa: E402

QUICK = {"encapsulating", "three-layer"}


@pytest.mark.parametrize(
    "template", [pytest.param(one, marks=() if one in QUICK else pytest.mark.long) for one in sorted(templates())]
)
def test_every_template_comes_back_as_written(template, tmp_path, monkeypatch):
    made = []
    build = occt.solids
    monkeypatch.setattr(occt, "solids", lambda shapes: made.extend(build(shapes)) or made)
    variant = Variant.of(template)
    bodies = (*variant.unit, *variant.plan.tools)
    step.write(tmp_path / "all.step", bodies, "all")
    bodies_read = step_reader.read(tmp_path / "all.step")
    assert [(b.name, b.colour) for b in bodies_read] == [(b.name, pytest.approx(b.colour, abs=1e-6)) for b in bodies]
    for back, solid in zip(bodies_read, made, strict=True):
        true = brep_measures.measure(solid)
        assert back.measures.solids == true.solids == 1
        assert back.measures.volume == pytest.approx(true.volume, rel=1e-9)
        assert back.measures.box == pytest.approx(true.box, abs=1e-6)


def test_time_stamp_is_source_date_epoch(monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    assert b"'2023-11-14T22:13:20'" in step.content([tube()], "tube")
    monkeypatch.delenv("SOURCE_DATE_EPOCH")
    assert b"'1980-01-01T00:00:00'" in step.content([tube()], "tube")


def test_schema_is_ap242_and_the_process_keeps_its_settings(capfd):
    from OCP.Interface import Interface_Static

    before = Interface_Static.IVal_s("write.step.schema"), Interface_Static.IVal_s("write.surfacecurve.mode")
    data = step.content([tube()], "tube")
    assert b"AP242_MANAGED_MODEL_BASED_3D_ENGINEERING_MIM_LF" in data
    after = Interface_Static.IVal_s("write.step.schema"), Interface_Static.IVal_s("write.surfacecurve.mode")
    assert before == after
    assert capfd.readouterr().out == ""


def test_copies_of_a_body_are_in_the_file_once(tmp_path):
    shape = tongue().shape
    places = [(0, 0, 0), (30, 0, 0), (0, 40.5, 2), (-30, 1.25, 0)]
    copies = [
        Body(f"filament{i + 1}", "tool", "filament", moved(turned(shape, "z", i), *at), (0.5, 0.5, 0.5))
        for i, at in enumerate(places)
    ]
    others = [tube(), Body("filament", "tool", "filament", moved(shape, 0, 0, 50), (1, 0, 0))]
    step.write(tmp_path / "a.step", [*copies, *others], "a")
    text = (tmp_path / "a.step").read_text()
    assert re.findall(r" = PRODUCT\('([^']*)'", text) == ["a", "filament-1", others[0].name, "filament"]
    assert len(re.findall("MANIFOLD_SOLID_BREP", text)) == 3
    back = step_reader.read(tmp_path / "a.step")
    assert [(body.name, body.colour) for body in back] == [(body.name, body.colour) for body in (*copies, *others)]
    for read, body in zip(back, (*copies, *others), strict=True):
        box = realise(body.shape, 96).bounding_box()
        assert read.measures.box == pytest.approx(box, abs=2e-3)  # of facets
        assert read.measures.volume == pytest.approx(
            brep_measures.measure(occt.solids([body.shape])[0]).volume, rel=1e-9
        )


@pytest.mark.parametrize("origin", range(3))
def test_a_copy_at_the_origin_keeps_its_name(origin, tmp_path):
    places = [(-20, 0, 0), (20, 0, 0)]
    places.insert(origin, (0, 0, 0))
    motors = [Body(f"m{i}", "unit", "motor", moved(cylinder(3, 0, 2), *at), (1, 0, 0)) for i, at in enumerate(places)]
    step.write(tmp_path / "a.step", motors, "a")
    back = step_reader.read(tmp_path / "a.step")
    assert [body.name for body in back] == ["m0", "m1", "m2"]
    assert [body.measures.box[0] + 3 for body in back] == pytest.approx([x for x, _, _ in places], abs=1e-9)


def test_a_body_of_several_solids_keeps_them_all(tmp_path):
    three = Union((cylinder(1, 0, 1), moved(cylinder(1, 0, 1), 5, 0, 0), moved(cylinder(1, 0, 2), 9, 0, 0)))
    pair = [
        Body("one", "unit", "layer", cylinder(2, 3, 4), (0, 1, 0)),
        Body("three", "unit", "layer", three, (1, 0, 0)),
    ]
    step.write(tmp_path / "a.step", pair, "a")
    one, back = step_reader.read(tmp_path / "a.step")
    assert [(body.name, body.colour, body.measures.solids) for body in (one, back)] == [
        ("one", (0, 1, 0), 1),
        ("three", (1, 0, 0), 3),
    ]
    assert back.measures.volume == pytest.approx(4 * math.pi, rel=1e-9)


def test_a_body_that_occt_gets_wrong_is_not_written():
    """A cylinder and a cone lying in it, edge on edge: OCCT loses a part and calls the rest valid."""
    shape = Union((cylinder(1, 0, 1), turned(Revolve(polygon((0, 0), (1, 0), (0, 1))), "y", 3)))
    with pytest.raises(UnitcadError, match=r"OCCT and manifold3d differ: 1 solids of 3\.6"):
        step.content([Body("odd", "tool", "coupon", shape, (0, 0, 0))], "odd")
