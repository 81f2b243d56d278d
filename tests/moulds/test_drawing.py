"""The dimensioned drawing: its lengths are the plan's, its faces tile the outline, its bytes stay."""

import base64
import re
import sys
import zlib

import pytest
from faulty_sets import set_of
from manifold3d import CrossSection, FillRule

from unitcad.errors import Missing
from unitcad.export import drawing as sheet
from unitcad.kernels.mesh import realise
from unitcad.pipeline.scenes import drawing
from unitcad.pipeline.write import build
from unitcad.shape import box, cut, cylinder
from unitcad.validation import load

ALL = ("unit", "moulds")


def pages(content):
    """Return the texts of each page, in their order."""
    found = []
    for stream in re.findall(rb"stream\r?\n(.+?)endstream", content, re.S):
        code = zlib.decompress(base64.a85decode(stream.strip().removesuffix(b"~>"))).decode("latin-1")
        texts = re.findall(r"\(((?:[^()\\]|\\.)*)\) Tj", code)
        found.append([re.sub(r"\\(\d{3})", lambda octal: chr(int(octal[1], 8)), text) for text in texts])
    return found


@pytest.mark.parametrize(
    "source",
    [("encapsulating",), ("embedded", "moulds.cavities=[2,2]", "moulds.printer=sla"), ("three-layer",)],
    ids=" ".join,
)
def test_a_sheet_each_with_the_lengths_of_the_plan(source):
    moulds = set_of(*source)
    unit, *tools = pages(drawing(moulds, ALL))
    printed = [body for body in moulds.plan.pieces if body.made == "printed"]
    assert [page[page.index("piece") + 1] for page in tools] == [moulds.plan.called(body.name) for body in printed]
    dims, lengths = moulds.plan.dimensions, {body.name: page for body, page in zip(printed, tools, strict=True)}
    assert f"Ø{2 * dims.outer_radius:g}" in unit
    assert f"Ø{2 * dims.cavity_radius:g}" in lengths["base"]
    for step, radius in zip(moulds.plan.steps, dims.radii, strict=True):
        assert f"Ø{2 * radius:g}" in lengths[step.cup]
    for page in tools:
        assert page[page.index("mould set") + 1] == moulds.plan.label


def test_windows_and_tongue_have_their_widths():
    moulds = set_of("encapsulating")
    unit, base, cup1, cup2, tongue, blade = pages(drawing(moulds, ALL))
    play, slot = moulds.spec.moulds.window_clearance_mm, moulds.dimensions.exit.width
    assert f"{slot:g}" in tongue
    for page in (cup1, cup2):
        assert f"{slot + 2 * play:g} x 0.8" in page
    assert "12" in blade
    assert f"slot 0.4 × {slot:g}" in unit
    assert "8.11" in base
    assert base.count("A") == 2


def test_the_same_bytes_and_lines_alone(tmp_path):
    spec = load("encapsulating", ["output.formats=['pdf']"])
    content = (build(spec, tmp_path / "a", only=ALL, check=False).folder / "drawing.pdf").read_bytes()
    assert content == (build(spec, tmp_path / "b", only=ALL, check=False).folder / "drawing.pdf").read_bytes()
    assert b"/Subtype /Image" not in content
    named = load(spec, {"name": "größe 名"})
    other = (build(named, tmp_path / "c", only=ALL, check=False).folder / "drawing.pdf").read_bytes()
    assert [page[page.index("variant") + 1] for page in pages(other)] == ["größe ?"] * 6


def test_without_reportlab_it_is_refused_before_the_work(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "reportlab.pdfgen.canvas", None)
    with pytest.raises(Missing, match=r"reportlab.*\[pdf\]"):
        build(load("embedded", ["output.formats=['pdf']"]), tmp_path, only=ALL)
    assert not list(tmp_path.iterdir())


def test_faces_from_above_tile_the_outline():
    """A block with a step, pockets and a hole: the areas of the faces add up to the block's less the hole."""
    block = box(-10, 10, -5, 5, 0, 8)
    piece = cut(block, [box(2, 10, -5, 5, 6, 9), cylinder(3, 4, 9), cylinder(1, -1, 9), box(-9, -6, -1, 1, 1, 3)])
    outline, *faces = sheet.from_above(realise(piece, 64))
    areas = [CrossSection(face.loops, FillRule.EvenOdd).area() for face in (outline, *faces)]
    assert len(faces) == 3
    assert sum(areas[1:]) == pytest.approx(areas[0], rel=1e-6)
    assert areas[0] == pytest.approx(200 - realise(cylinder(1, 0, 1), 64).volume(), rel=1e-4)


def test_only_faces_alike_on_both_sides_are_a_width():
    """A plate of 20 with a slot of 6, tapered by 5 degrees, and a notch on one side alone."""
    taper = 0.35
    loops = [[(-10, 0), (-3, 0), (-3 + taper, 4), (3 - taper, 4), (3, 0), (10, 0), (10, 6), (8, 6), (8, 8), (-10, 8)]]
    assert [one.text for one in sheet.across(loops, (0.0,), lambda *_: False)] == ["6", "20"]
    assert [one.text for one in sheet.upright(loops)] == ["4", "2", "2", "8"]
    assert [one.text for one in sheet.across(loops, (0.0,), lambda half, *_: half == 3)] == ["Ø6", "20"]
