"""Gangs, lids and wires: what fits, what is refused and why, and that what is accepted passes the mould checks."""

import itertools
import math
from dataclasses import replace

import pytest
from faulty_sets import broken, of_spec, set_of
from manifold3d import CrossSection
from msgspec import structs

from tests.sample_bodies import LEADLESS
from unitcad.checks import air, overlap
from unitcad.designs import dimensions
from unitcad.errors import Refusal
from unitcad.moulds import lid
from unitcad.moulds.layout import layout
from unitcad.moulds.plan import plan
from unitcad.shape import moved
from unitcad.validation import from_data, load, read

WIRES = {"diameter_mm": 0.3, "count": 2}


def wired(design):
    data = {key: value for key, value in read(design).items() if key != "fpcb"}
    return {**data, "wires": WIRES}


@pytest.mark.parametrize(
    ("name", "size", "cells"), [("embedded", 73, 9), ("encapsulating", 73, 6), ("pass-through", 73, 3)]
)
def test_fill_takes_what_the_bed_takes_and_no_more(name, size, cells):
    bed = [f"moulds.bed_{axis}_mm={size}" for axis in "xy"]
    lay = set_of(name, 'moulds.cavities="fill"', *bed).plan.layout
    assert len(lay.cells) == cells
    assert max(2 * half for half in lay.plate) <= size
    columns = {cell.x for cell in lay.cells}
    with pytest.raises(Refusal) as refused:
        set_of(name, f"moulds.cavities=[{len(columns)},{cells // len(columns) + 1}]", *bed)
    assert refused.value.nearest == [len(columns), cells // len(columns)]
    assert "exceeds the bed by" in str(refused.value)


def accepted(spec, columns, rows):
    one = structs.replace(spec, moulds=structs.replace(spec.moulds, cavities=(columns, rows)))
    try:
        return len(layout(one, dimensions(one)).cells) == columns * rows
    except Refusal:
        return False


@pytest.mark.parametrize("printer", ["fdm-0.4", "fdm-0.25", "sla", "prusa-mk3s"])
@pytest.mark.parametrize(
    ("name", "settings"),
    [
        (LEADLESS, ["diameter_mm=14.0"]),
        (LEADLESS, ["diameter_mm=14.0", "moulds.bed_x_mm=70"]),
        (LEADLESS, ["diameter_mm=15.1", "moulds.bed_x_mm=400", "moulds.bed_y_mm=95"]),
        (LEADLESS, ["diameter_mm=30.0"]),
        ("embedded", ["diameter_mm=14.0"]),
        ("embedded", ["diameter_mm=20.3", "moulds.bed_y_mm=333"]),
        ("encapsulating", []),
        ("pass-through", []),
    ],
)
def test_fill_has_the_most_cells_of_all_splits(name, settings, printer):
    table = {"moulds.printer": printer, "moulds.cavities": "fill"}
    spec = load(load(name, settings), table)
    most = [int(bed // spec.diameter_mm) + 1 for bed in (spec.moulds.bed_x_mm, spec.moulds.bed_y_mm)]
    splits = itertools.product(*(range(1, count + 1) for count in most))
    cells = len(layout(spec, dimensions(spec)).cells)
    larger = [split for split in splits if math.prod(split) >= cells and accepted(spec, *split)]
    assert cells == max(map(math.prod, larger))


def test_a_unit_larger_than_the_bed_fills_nothing():
    with pytest.raises(Refusal, match="with one cavity"):
        set_of("embedded", 'moulds.cavities="fill"', "moulds.bed_x_mm=30")


def test_without_tails_any_number_of_columns():
    assert len(set_of(LEADLESS, "moulds.cavities=[4,2]").plan.layout.cells) == 8


@pytest.mark.parametrize("set_by_hand", [("moulds.bed_z_mm=8",), ("moulds.plate_mm=30", "moulds.bed_z_mm=25")])
def test_a_piece_higher_than_the_printer(set_by_hand):
    with pytest.raises(Refusal, match=r"moulds\.bed_z_mm") as refused:
        set_of("encapsulating", *set_by_hand)
    set_of("encapsulating", *set_by_hand, f"moulds.bed_z_mm={refused.value.nearest}")


def test_a_length_beyond_the_printer_s_height_is_the_one_refused():
    with pytest.raises(Refusal, match=r"the tallest piece has .* \(moulds\.bed_z_mm\) is 220 mm") as refused:
        set_of("encapsulating", "layers.1.cap_mm=500")
    assert refused.value.field == "layers.1.cap_mm"
    set_of("encapsulating", f"layers.1.cap_mm={refused.value.nearest}")


def test_cells_are_numbered_and_numbers_keep_off_grooves_and_each_other():
    moulds = set_of(LEADLESS, "moulds.cavities=[5,4]")
    names = [cell.name for cell in moulds.plan.layout.cells]
    assert names == [f"{i + 1:02X}" for i in range(20)]
    # Each character is a pocket of its own: the cup's top has the drawn number of outlines, none merged or cut open.
    rim = moulds.dimensions.heights[1]
    top = moulds.solids["cup2"].slice(rim - 0.2)
    rings = sum(1 for part in top.decompose() if part.area() > 1)
    assert top.area() < moulds.solids["cup2"].slice(rim - 1.2).area()
    assert rings >= 1 + 20  # the plate, and the land of each cell inside its groove


@pytest.mark.parametrize(("wall", "tolerance"), [(0.5, 0.1), (0.55, 0.1), (0.6, 0.002), (0.7, 0.1), (0.95, 0.1)])
def test_grooves_that_just_miss_each_other_are_joined(wall, tolerance):
    """The pitch is the last layer's; grooves of the one before leave a web of 2 * wall - 1 mm, which is not printed."""
    data = {
        "name": "webs",
        "design": "embedded",
        "diameter_mm": 12.0,
        "motor": {"diameter_mm": 12.0 - 4 * wall, "thickness_mm": 1.8, "fill": True},
        "layers": [{"material": "ecoflex-00-10", "wall_mm": wall}] * 2,
        "moulds": {"cavities": [2, 2]},
        "output": {"tolerance_mm": tolerance},
    }
    moulds = of_spec(from_data(data))
    assert broken(moulds) == set()
    lay, radius, lengths = moulds.plan.layout, 6 - wall, moulds.spec.moulds
    assert lay.pitch - 2 * (radius + 2.5) == pytest.approx(2 * wall - 1)
    section = moulds.solids["cup1"].slice(moulds.plan.steps[0].rim - 0.75)
    middle = lay.pitch / 2
    for i in range(-40, 41):
        for axis in (0, 1):
            line = CrossSection.square((3.0, 1e-3), True).translate((0, middle + i / 10)).rotate(90 * axis)
            ends = [part.bounds()[axis::2] for part in (section ^ line).decompose()]
            assert all(high - low >= lengths.least_wall_mm for low, high in ends if low < 0 < high), i
    for cell in lay.cells:
        land = CrossSection.circle(radius + 1 - tolerance, 200) - CrossSection.circle(radius + tolerance, 200)
        assert (land.translate((cell.x, cell.y)) - section).area() < 1e-3


def test_flat_lid_without_vents_traps_what_an_exact_integral_says():
    """A disc of radius r with a sprue of radius a in the middle: tan(t) times the integral of (x - a) over x > a."""
    moulds = set_of("encapsulating", "moulds.pour=injected")
    step = moulds.plan.steps[1]
    sprue = step.channels[:1]
    cup = moulds.cavities[1].reached
    from manifold3d import Manifold, OpType

    from unitcad.kernels.mesh import realise

    vents = [realise(shape, moulds.segments) for shape in step.channels[len(sprue) :]]
    above = Manifold.cube((60, 60, 30), True).translate((0, 0, step.rim + 15))
    blind = cup - Manifold.batch_boolean([vent ^ above for vent in vents], OpType.Add)
    pocket = air.pockets(blind, step.top)[0]
    r, a = 7.0, 1.5
    segment = r**2 * math.acos(a / r) - a * math.sqrt(r**2 - a**2)
    integral = 2 / 3 * (r**2 - a**2) ** 1.5 - a * segment
    expected = math.tan(math.radians(5)) * integral
    assert pocket.depth == pytest.approx((r - a) * math.sin(math.radians(5)), rel=5e-3)
    assert air.pocket_volume(blind, step.top, pocket) == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize("count", [8, 12, 16])
def test_measured_pocket_between_vents_is_the_formula(count):
    """Without a tongue, whose dent would be the deeper one; polygons stand for circles within 5 um."""
    moulds = set_of(LEADLESS, "moulds.pour=injected", f"moulds.vents={count}", "output.tolerance_mm=0.001")
    step = moulds.plan.steps[0]
    cavity = moulds.cavities[0].reached
    expected = lid.pocket_depth(moulds.dimensions, 0, count)
    assert air.pockets(cavity, step.top)[0].depth == pytest.approx(
        expected, abs=5e-3 * math.sin(math.radians(5)) + 2e-4
    )


@pytest.mark.parametrize("design", ["encapsulating", "embedded"])
@pytest.mark.parametrize("count", [1, 2, 4])
def test_wires_keep_every_law(design, count):
    data = wired(design)
    moulds = of_spec(from_data({**data, "wires": {**WIRES, "count": count}}))
    assert broken(moulds) == set()
    assert [body.name for body in moulds.unit if body.name.startswith("wire")] == [f"wire{i + 1}" for i in range(count)]
    assert sum(tool.name.startswith("tongue") for tool in moulds.plan.tools) == 1
    solids = moulds.solids
    for i in range(count):
        for layer in ("layer1", "layer2"):
            assert solids[f"wire{i + 1}"].min_gap(solids[layer], 1) > 0.09


@pytest.mark.parametrize(("lower", "fits"), [(0.0, True), (0.005, False)])
def test_a_wire_may_touch_its_slot_s_floor(lower, fits):
    """Its polygon and the grid put it 1.4e-3 mm into the silicone: a wire that is 0.005 mm lower is another matter."""
    data = {**wired("encapsulating"), "wires": {"diameter_mm": 0.8, "count": 2}, "skin_mm": 0.5}
    moulds = of_spec(from_data({**data, "motor": {**data["motor"], "thickness_mm": 2.1}}))
    slot = moulds.dimensions.exit
    wire = next(body for body in moulds.unit if body.kind == "wire")
    assert moulds.mesh(wire).bounding_box()[2] < slot.low  # the polygon's corner
    sunk = tuple(replace(b, shape=moved(b.shape, z=-lower)) if b.kind == "wire" else b for b in moulds.unit)
    moulds.__dict__["unit"] = sunk
    assert all(finding.ok for finding in overlap.of_unit(moulds)) == fits


def test_wires_that_cannot_be():
    with pytest.raises(Refusal, match="leave out"):
        from_data({**read("encapsulating"), "wires": WIRES})
    with pytest.raises(Refusal, match="half the motor") as refused:
        from_data({**wired("encapsulating"), "wires": {"diameter_mm": 1.2}})
    assert refused.value.nearest == 0.8
    with pytest.raises(Refusal, match="side by side"):
        from_data({**wired("encapsulating"), "wires": {"diameter_mm": 0.9, "count": 8}})
    with pytest.raises(Refusal) as refused:
        of_spec(from_data({**wired("embedded"), "moulds": {"pour": "injected"}}))
    assert refused.value.nearest == "open"


def test_a_connector_that_would_tear_the_slot():
    with pytest.raises(Refusal, match="would stretch it by") as refused:
        load("encapsulating", {"fpcb.tail_end_width_mm": 14.0})
    nearest = refused.value.nearest
    assert isinstance(nearest, float)
    # 2 (w + t) = 2 (3.4 + 0.4) (1 + 0.5 x 3.64), Dragon Skin 30's elongation being 364 %.
    assert nearest == pytest.approx(3.8 * 2.82 - 0.11, abs=1e-3)
    of_spec(load("encapsulating", {"fpcb.tail_end_width_mm": nearest}))


RINGS = ["layers=[{ material = 'ecoflex-00-10', wall_mm = 1.25 }, { material = 'ecoflex-00-10', wall_mm = 1.25 }]"]


@pytest.mark.parametrize(
    ("overrides", "field", "nearest"),
    [
        (["moulds.cavities=[3,40]"], "moulds.cavities", [2, 10]),
        (["moulds.cavities=[1000000,1000000]"], "moulds.cavities", [2, 10]),
        (["moulds.cavities=[3,2]"], "moulds.cavities", [2, 2]),  # a tail reaches an edge
        (["fpcb.tail=both", "moulds.cavities=[2,3]"], "moulds.cavities", [1, 3]),
        (["moulds.pour=injected", "moulds.vents=4"], "moulds.vents", 8),
        (["moulds.pour=injected", "moulds.vents=9"], "moulds.vents", 8),
        (["design=embedded", *RINGS, "moulds.pour=injected", "layers.0.wall_mm=0.7"], "layers.0.wall_mm", 1.0),
        (["moulds.cavities=full"], "moulds.cavities", "fill"),
        (["moulds.pour=injected", "moulds.sprue_mm=30"], "moulds.sprue_mm", 9.3),
        (["moulds.bed_x_mm=20"], "moulds.bed_x_mm", 36.3),
        (["moulds.window_clearance_mm=5"], "moulds.window_clearance_mm", 0.36),
    ],
)
def test_nearest_value_leads_out(overrides, field, nearest):
    """What is offered is no nonsense: put in, it meets no limit of its own again."""
    with pytest.raises(Refusal) as refused:
        set_of("encapsulating", *overrides)
    assert (refused.value.field, refused.value.nearest) == (field, nearest)
    put_in = f"{field}={nearest}"
    try:
        set_of("encapsulating", *overrides[:-1], put_in)
    except Refusal as further:
        assert further.field != field


@pytest.mark.parametrize("wall", [0.6, 0.713, 0.8])
def test_the_widest_tail_that_a_tongue_s_air_allows_is_offered(wall):
    change = {"layers.0.wall_mm": wall, "layers.0.cap_mm": 1.1, "fpcb.tail_width_mm": 5.5}
    with pytest.raises(Refusal, match="mm of air under the tongue") as refused:
        plan(load("encapsulating", change))
    offered = refused.value.nearest
    plan(load("encapsulating", change | {"fpcb.tail_width_mm": offered}))
    with pytest.raises(Refusal, match="under the tongue"):
        plan(load("encapsulating", change | {"fpcb.tail_width_mm": round(offered + 0.001, 3)}))
