"""STEP: judged where a B-rep extra is installed, refused with a clear message where none is."""

from pathlib import Path

import pytest

from unitcad.extras import install_command
from unitcad.meshcheck import Limits, Options, check_file, file_checks
from unitcad.meshcheck.readers import read_step


def test_without_the_extra_the_message_says_what_to_install(tmp_path, monkeypatch):
    path = tmp_path / "a.step"
    path.write_text("ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\nENDSEC;\nEND-ISO-10303-21;\n")
    monkeypatch.setattr(read_step, "find_spec", lambda name: None)
    report = check_file(path)
    assert report.verdict == "error"
    assert report.has("F012")
    assert report.findings[0].message.endswith(install_command("step"))


@pytest.mark.parametrize("there", [True, False])
def test_step_in_a_folder_is_a_warning_without_the_extra(there, tmp_path, monkeypatch):
    (tmp_path / "a.STEP").write_text("x")
    (tmp_path / "b.stl").write_text("x")
    monkeypatch.setattr(read_step, "find_spec", lambda name: there or None)
    paths, reports = file_checks.expand([str(tmp_path)])
    assert [Path(path).name for path in paths] == (["a.STEP", "b.stl"] if there else ["b.stl"])
    assert [(report.verdict, report.has("F012")) for report in reports] == ([] if there else [("warning", True)])
    assert file_checks.expand([str(tmp_path / "a.STEP")]) == ([str(tmp_path / "a.STEP")], [])


@pytest.mark.parametrize(
    ("text", "code"), [("", "F001"), ("solid a", "F005"), ("ISO-10303-21;\nHEADER;", "F003"), ("<html>", "F005")]
)
def test_what_is_no_step_file(text, code, tmp_path):
    path = tmp_path / "a.step"
    path.write_text(text)
    assert [found.code for found in check_file(path).findings] == [code]


def test_solids_volume_and_box(tmp_path):
    pytest.importorskip("OCP")
    from OCP.BRep import BRep_Builder
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox, BRepPrimAPI_MakeCylinder
    from OCP.STEPControl import STEPControl_AsIs, STEPControl_Writer
    from OCP.TopoDS import TopoDS_Compound

    compound, builder = TopoDS_Compound(), BRep_Builder()
    builder.MakeCompound(compound)
    builder.Add(compound, BRepPrimAPI_MakeBox(10.0, 20.0, 30.0).Shape())
    builder.Add(compound, BRepPrimAPI_MakeCylinder(5.0, 10.0).Shape())
    writer = STEPControl_Writer()
    writer.Transfer(compound, STEPControl_AsIs)
    path = tmp_path / "two.step"
    writer.Write(str(path))
    report = check_file(path)
    assert [found.code for found in report.findings] == ["G002"]  # a quarter of the cylinder lies in the box
    assert report.facts.shells == 2
    assert report.facts.volume_mm3 == pytest.approx(6000 + 785.3981633974483, rel=1e-9)
    assert report.facts.bbox_mm[1] == pytest.approx((10, 20, 30), abs=1e-6)
    assert check_file(path, Options(shells=1)).has("G005")
    cut = tmp_path / "cut.step"
    cut.write_bytes(path.read_bytes()[:-200])
    assert check_file(cut).has("F003")


def test_a_reader_that_dies_or_prints_is_a_finding(tmp_path, monkeypatch, capfd):
    path = tmp_path / "a.step"
    path.write_text("ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\nENDSEC;\nEND-ISO-10303-21;\n")
    monkeypatch.setattr(read_step, "find_spec", lambda name: True)
    monkeypatch.syspath_prepend(str(Path(__file__).parent))
    import dying

    for child, code, said, seconds in (
        (dying.aborts, "F003", "died", 60),
        (dying.prints, "F012", "does not load", 60),
        (dying.hangs, "F011", "not finished", 1),
    ):
        monkeypatch.setattr(read_step, "MEASURE", child)
        (found,) = check_file(path, Options(limits=Limits(seconds=seconds))).findings
        assert found.code == code
        assert said in found.message
    assert capfd.readouterr().out == ""


def test_damaged_step_files_give_a_verdict_and_print_nothing(tmp_path, capfd):
    pytest.importorskip("OCP")
    path = tmp_path / "a.step"
    path.write_text(
        "ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\n#1=SHAPE_REPRESENTATION('',(#1),#1);\nENDSEC;\nEND-ISO-10303-21;\n"
    )
    assert [found.code for found in check_file(path).findings] == ["F003"]
    assert capfd.readouterr().out == ""


STEP = "ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\n{}\nENDSEC;\nEND-ISO-10303-21;\n"


@pytest.mark.parametrize("entities", [
    "#1=SHAPE_REPRESENTATION('',(" + "#1," * 500_000 + "#1),#1);",
    "#1=FOO(" + "(0.)," * 300_000 + "0.);",
    ("#1=FOO(" + "#2," * 25_000 + "0.);\n") * 8,
    "#1=FOO(" + "#2,';'," * 200_000 + "#2);",
    "#1=FOO(" + "#2,/*;*/" * 200_000 + "#2);",
    "#1=(" + "A()" * 30_000 + ");",
])  # fmt: skip
def test_references_are_counted_before_occt_reads_them(entities, tmp_path, monkeypatch):
    """OCCT takes ten minutes for the first one, of 1.5 MB."""
    monkeypatch.setattr(read_step, "MEASURE", None)
    path = tmp_path / "a.step"
    path.write_text(STEP.format(entities))
    (found,) = check_file(path).findings
    assert found.code == "F011"
    assert "the squares add up to" in found.message


@pytest.mark.parametrize("entities", [
    "".join(f"#{i}=CARTESIAN_POINT('',(0.,0.,0.));\n" for i in range(100_000)),
    "#1=CLOSED_SHELL('',(" + ",".join(f"#{i}" for i in range(2, 40_000)) + "));",
    "#1=CARTESIAN_POINT('" + "#(" * 500_000 + "',(0.,0.,0.));",
    "/*" * 200_000,
], ids=["points", "shell", "text", "open comment"])  # fmt: skip
def test_files_of_usual_counts_are_read(entities):
    read_step.expect_readable(STEP.format(entities).encode())


def test_a_small_file_that_places_its_parts_millions_of_times_is_refused(tmp_path):
    """A compound of two compounds of two ..., 20 deep: a million cubes, for which there is no memory."""
    pytest.importorskip("OCP")
    from OCP.BRep import BRep_Builder
    from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
    from OCP.gp import gp_Trsf, gp_Vec
    from OCP.TopLoc import TopLoc_Location
    from OCP.TopoDS import TopoDS_Compound

    from unitcad.meshcheck.readers.occt_bodies import MOST_REPEATS, expect_countable

    builder, shapes = BRep_Builder(), [BRepPrimAPI_MakeBox(1.0, 1.0, 1.0).Shape()]
    for i in range(20):
        whole = TopoDS_Compound()
        builder.MakeCompound(whole)
        for side in (0, 1):
            place = gp_Trsf()
            place.SetTranslation(gp_Vec(side * 2.0 * 2**i, 0, 0))
            builder.Add(whole, shapes[-1].Moved(TopLoc_Location(place)))
        shapes.append(whole)
    empty = TopoDS_Compound()
    builder.MakeCompound(empty)
    for _ in range(MOST_REPEATS):
        builder.Add(empty, shapes[0])
    for shape in (shapes[20], empty):
        with pytest.raises(read_step.TooMany, match="repeat their parts"):
            builder.Add(empty, shapes[0])
            builder.Add(empty, shapes[0])
            expect_countable(shape)
    assert expect_countable(shapes[9]).Extent() == 1
