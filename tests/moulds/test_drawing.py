"""The dimensioned drawing: its lengths are the meshes', no number is on a line, its scales are ISO's, its bytes stay."""

import base64
import math
import re
import sys
import zlib

import pytest
from faulty_sets import set_of
from manifold3d import CrossSection, FillRule

from tests.drawn_sheets import ISO_5455, allowed, cells, faults, measured, number
from unitcad import __version__
from unitcad.errors import Missing
from unitcad.export import drawing, lengths, paper
from unitcad.kernels.mesh import bounds, realise
from unitcad.pipeline import workshop
from unitcad.pipeline.unit import Unit
from unitcad.pipeline.write import build
from unitcad.shape import box, cut, cylinder, moved
from unitcad.spec import spec_hash
from unitcad.validation import load

ALL = ("unit", "moulds")
DEFAULT = [("encapsulating",), ("embedded", "moulds.cavities=[2,2]", "moulds.printer=sla")]
MORE = [
    *(("three-layer",), ("pass-through",), ("motor-10mm",), ("no-fpcb",), ("single-embedded",), ("single-encapsulating",)),
    ("encapsulating", "moulds.pour=injected"), ("embedded", "moulds.cavities=[3,8]"), ("encapsulating", "diameter_mm=40"),
    *((f"templates/custom/{name}.toml",) for name in ("dome", "strap-lugs")),
]  # fmt: skip
SOURCES = [*DEFAULT, *(pytest.param(source, marks=pytest.mark.long) for source in MORE)]
each_source = pytest.mark.parametrize("source", SOURCES, ids=lambda source: " ".join(source))


def sheets_of(moulds):
    return list(workshop.sheets(moulds, ALL, spec_hash(moulds.spec)))


def texts(content):
    """Return the texts of each page of a PDF, in their order."""
    found = []
    for stream in re.findall(rb"stream\r?\n(.+?)endstream", content, re.S):
        code = zlib.decompress(base64.a85decode(stream.strip().removesuffix(b"~>"))).decode("latin-1")
        page = re.findall(r"\(((?:[^()\\]|\\.)*)\) Tj", code)
        found.append([re.sub(r"\\(\d{3})", lambda octal: chr(int(octal[1], 8)), text) for text in page])
    return found


@each_source
def test_a_caliper_finds_each_length_on_the_mesh(source):
    moulds = set_of(*source)
    _, *tools = sheets_of(moulds)
    printed = [body for body in moulds.plan.pieces if body.made == "printed"]
    assert [sheet.facts[0][0][1] for sheet in tools] == [moulds.plan.called(body.name) for body in printed]
    for body, sheet in zip(printed, tools, strict=True):
        for one, found in measured(moulds.mesh(body), sheet):
            off = allowed(one.value, moulds.segments)
            assert found == pytest.approx(number(one.text, one.side == "right"), abs=off), (body.name, one)
        checks = sheet.checks
        assert [one.check for one in checks] == [1, 2, 3, 4, 5], body.name
        x0, y0, z0, x1, y1, z1 = bounds(moulds.mesh(body))
        named = {one.name: one.value for one in checks}
        size = [named["length"], named["width"], named["height"]]
        assert size == pytest.approx([x1 - x0, y1 - y0, z1 - z0], abs=0.01)
        assert y0 < sheet.cut < y1


@each_source
def test_no_text_is_on_a_line_and_scales_are_those_of_iso_5455(source):
    for page in drawing.pages(sheets_of(set_of(*source))):
        assert not list(faults(page))
        assert cells(page).get("scale", "1:1") in ISO_5455


def test_lengths_are_those_of_the_plan():
    moulds = set_of("encapsulating")
    unit, base, cup1, cup2, tongue, blade = sheets_of(moulds)
    dims, play = moulds.plan.dimensions, moulds.spec.moulds.window_clearance_mm
    assert f"Ø{2 * dims.outer_radius:g}" in [one.text for one in unit.front.lengths]
    assert f"Ø{2 * dims.cavity_radius:g}" in [one.text for one in base.checks]
    slot = moulds.dimensions.exit.width
    for cup, radius in zip((cup1, cup2), dims.radii, strict=True):
        assert f"Ø{2 * radius:g}" in [one.text for one in cup.checks]
        assert f"{slot + 2 * play:g} x 0.8" in [one.text for one in cup.front.lengths]
    assert [one.name for one in cup1.front.lengths if one.running] == ["", "depth from below", "", "", "height"]
    assert f"{slot:g}" in [one.text for one in tongue.checks]
    assert "12" in [one.text for one in blade.checks]


def test_the_title_block_names_what_made_it_and_no_date():
    moulds = set_of("encapsulating")
    content = workshop.content(sheets_of(moulds))
    for page in texts(content):
        assert f"unitcad {__version__}, {spec_hash(moulds.spec)[:12]}" in page
        assert moulds.plan.label in page
        assert page.count("A") == 2
        assert "A-A" in page
        assert not [text for text in page if re.search(r"20\d\d|date", text)]


def test_the_tolerance_is_the_printers_and_says_if_it_is_assumed():
    for printer, changes, said in [
        ("fdm-0.4", [], "lengths ±0.15 assumed, heights ±0.2 assumed"),
        ("sla", [], "lengths ±0.08 assumed, heights ±0.05 assumed"),
        ("fdm-0.4", ["moulds.xy_play_mm=0.07"], "lengths ±0.07, heights ±0.2 assumed"),
    ]:
        spec = load("embedded", [f"moulds.printer={printer}", *changes])
        assert workshop.tolerance(spec)[1] == said
    sheet = sheets_of(set_of("embedded", "moulds.xy_play_mm=0.07"))[1]
    (page,) = drawing.pages([sheet])
    rows = [mark.text for mark in page.marks if isinstance(mark, paper.Text)]
    assert (rows.count("±0.07"), rows.count("±0.2")) == (3, 2)


def test_the_section_is_seen_from_where_its_arrows_point():
    """In the first angle the view from above is under the section, whose arrows point to its upper side."""
    page = drawing.pages(sheets_of(set_of("encapsulating")))[1]
    (title,) = [mark for mark in page.marks if isinstance(mark, paper.Text) and mark.text == "A-A"]
    letters = [mark for mark in page.marks if isinstance(mark, paper.Text) and mark.text == "A"]
    arrows = [mark for mark in page.marks if isinstance(mark, paper.Arrow)]
    for letter in letters:
        (arrow,) = [one for one in arrows if abs(one.tip[0] - letter.at[0]) < 1e-9]
        assert arrow.way == (0.0, 1.0)
        assert letter.at[1] < arrow.tip[1] < title.at[1]
    outlines = [paper.extent([mark]) for mark in page.marks if isinstance(mark, paper.Fill)]
    section, _, plan, *_ = outlines
    assert plan[3] < section[1]
    assert (section[0], section[2]) == pytest.approx((plan[0], plan[2]), abs=0.05)


def test_a_table_with_many_holes_has_sheets_of_its_own(monkeypatch):
    monkeypatch.setattr(drawing, "MOST_HOLES", 3)
    monkeypatch.setattr(drawing, "ON_A_SHEET", 3)
    sheet = sheets_of(set_of("embedded", "moulds.cavities=[2,2]"))[1]
    first, *more = drawing.pages([sheet])
    assert [cells(page)["sheet"] for page in (first, *more)] == ["1 of 3", "2 of 3", "3 of 3"]
    listed = [mark.text for page in more for mark in page.marks if isinstance(mark, paper.Text)]
    assert all(one.name in listed for one in sheet.holes)
    assert not [fault for page in more for fault in faults(page)]


def test_holes_are_where_the_cells_are():
    moulds = set_of("embedded", "moulds.cavities=[2,2]")
    for sheet in sheets_of(moulds)[1:3]:
        cells_at = [(cell.name, cell.x, cell.y) for cell in moulds.plan.layout.cells]
        assert [(hole.name, hole.x, hole.y) for hole in sheet.holes] == cells_at


def test_the_same_bytes_and_lines_alone(tmp_path):
    spec = load("encapsulating", ["output.formats=['pdf']"])
    content = (build(spec, tmp_path / "a", only=ALL, check=False).folder / "drawing.pdf").read_bytes()
    moulds = Unit(spec).moulds
    assert content == workshop.content(sheets_of(moulds)) == workshop.content(sheets_of(moulds))
    assert b"/Subtype /Image" not in content
    named = load(spec, {"name": "größe 名"})
    pages = texts(workshop.content(sheets_of(Unit(named).moulds)))
    assert [page[page.index("variant") + 1] for page in pages] == ["größe ?"] * 6


def test_without_reportlab_it_is_refused_before_the_work(tmp_path, monkeypatch):
    for module in ("reportlab.pdfgen.canvas", "reportlab.pdfbase.pdfmetrics"):
        monkeypatch.setitem(sys.modules, module, None)
    paper.text_width.cache_clear()
    with pytest.raises(Missing, match=r"reportlab.*\[pdf\]"):
        build(load("embedded", ["output.formats=['pdf']"]), tmp_path, only=ALL)
    assert not list(tmp_path.iterdir())


def test_faces_from_above_tile_the_outline():
    """A block with a step, pockets and a hole: the areas of the faces add up to the block's less the hole."""
    block = box(-10, 10, -5, 5, 0, 8)
    piece = cut(block, [box(2, 10, -5, 5, 6, 9), cylinder(3, 4, 9), cylinder(1, -1, 9), box(-9, -6, -1, 1, 1, 3)])
    outline, *faces = lengths.from_above(realise(piece, 64))
    areas = [CrossSection(face.loops, FillRule.EvenOdd).area() for face in (outline, *faces)]
    assert len(faces) == 3
    assert sum(areas[1:]) == pytest.approx(areas[0], rel=1e-6)
    assert areas[0] == pytest.approx(200 - realise(cylinder(1, 0, 1), 64).volume(), rel=1e-4)


def test_only_faces_alike_on_both_sides_are_a_width():
    """A plate of 20 with a slot of 6, tapered by 5 degrees, and a notch on one side alone."""
    taper = 0.35
    loops = [[(-10, 0), (-3, 0), (-3 + taper, 4), (3 - taper, 4), (3, 0), (10, 0), (10, 6), (8, 6), (8, 8), (-10, 8)]]
    assert [(one.text, one.name) for one in lengths.across(loops, 0.0)] == [
        ("6", "inside width"),
        ("20", "outside width"),
    ]
    assert [(one.text, one.name) for one in lengths.heights(loops, loops)] == [
        ("0", ""), ("4", "depth from below"), ("6", "height of the edge"), ("8", "height"),
    ]  # fmt: skip
    assert [one.text for one in lengths.across(loops, 0.0, lambda half, *_: half == 3)] == ["Ø6", "20"]


def test_circles_and_slots_are_found_and_letters_and_rings_of_holes_are_not():
    ring = [moved(cylinder(1, -1, 4), 6 * math.cos(i * math.tau / 8), 6 * math.sin(i * math.tau / 8)) for i in range(8)]
    end = [moved(cylinder(2, -1, 4), 15, y) for y in (-3, 3)]
    letter = box(-15, -11, -4, 4, 2, 4), box(-11, -9, -4, -2, 2, 4)
    plate = cut(box(-20, 20, -10, 10, 0, 3), [cylinder(3, -1, 4), *ring, *end, box(13, 17, -3, 3, -1, 4), *letter])
    slices = lengths.Slices(realise(plate, 64, 1.0))
    diameters = slices.diameters(0.0, 0.0)
    assert diameters == pytest.approx((6.0,), abs=0.002)
    assert slices.diameters(0.0, 0.0, 2.5) == ()
    assert slices.diameters(1.0, 0.0) == ()
    others = slices.others([lengths.Hole("", 0.0, 0.0, "Ø6", diameters)])
    assert [one.name for one in others] == [*(f"P{i}" for i in range(1, 9)), "S1"]
    assert [one.size for one in others] == [*["Ø2"] * 8, "4 x 10"]
    assert (others[0].x, others[0].y) == pytest.approx((0.0, 6.0), abs=0.005)
    assert (others[-1].x, others[-1].y) == pytest.approx((15.0, 0.0), abs=0.005)
