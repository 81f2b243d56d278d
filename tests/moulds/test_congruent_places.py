"""Cells of a gang in like surroundings: found from the drawing, judged once, with the findings of the whole plate."""

import math
from dataclasses import replace

import pytest
from faulty_sets import set_of, with_fault
from manifold3d import Manifold, OpType

from tests.sample_bodies import LEADLESS
from unitcad.checks import check_moulds, draw, groove_walls
from unitcad.kernels.mesh import realise, shells
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.surroundings import column_round
from unitcad.shape import box, cut, union

BED = ("moulds.bed_x_mm=1000", "moulds.bed_y_mm=1000")
GANGS = [
    (LEADLESS, "moulds.cavities=[3,3]"),
    ("encapsulating", "moulds.cavities=[2,3]"),
    ("encapsulating", "moulds.cavities=[2,2]", "moulds.pour=injected"),
    ("embedded", "moulds.cavities=[1,3]", "fpcb.tail=both"),
    ("three-layer", "moulds.cavities=[2,2]"),
    ("encapsulating", "moulds.cavities=[2,2]", "moulds.printer=sla"),
    ("custom/strap-lugs", "moulds.cavities=[2,1]"),
]


BELOW = box(-1, 1, -1, 1, -30, -29)
"""A box under the middle of a plate."""


def each_cell_alone(moulds):
    """Return the same set, every cell of which counts as one of its own."""
    alone = MouldSet(moulds.spec, moulds.altered)
    alone.__dict__["cells"] = (tuple(range(len(moulds.plan.layout.cells))),) * len(moulds.plan.steps)
    return alone


def whole_plate_cavity(moulds, step):
    """Return what silicone can reach in a pour of the whole plate: block less all tools, seals and cured layers."""
    pour = moulds.plan.steps[step]
    tools = [moulds.solids[name] for name in pour.tools]
    filled = [*tools, *moulds.meshes((*pour.earlier, *(body.shape for body in pour.inserts), *pour.seals))]
    x0, y0, z0, x1, y1, _ = Manifold.compose(tools).bounding_box()
    block = realise(box(x0 - 5, x1 + 5, y0 - 5, y1 + 5, z0 - 5, pour.top), 4)
    return Manifold.batch_boolean([block, *filled], OpType.Subtract).decompose()


@pytest.mark.parametrize("gang", GANGS, ids=[" ".join(gang) for gang in GANGS])
def test_a_cell_s_cavity_is_that_of_the_whole_plate(gang):
    moulds = set_of(*gang)
    for step in range(len(moulds.plan.steps)):
        there = whole_plate_cavity(moulds, step)
        for cavity in (c for c in moulds.cavities if c.step is moulds.plan.steps[step]):
            whole = max(there, key=lambda part: (part ^ cavity.drawn).volume())
            differ = whole.volume() + cavity.reached.volume() - 2 * (whole ^ cavity.reached).volume()
            assert abs(differ) < 1e-9 * whole.volume()


@pytest.mark.parametrize(
    "gang",
    [
        GANGS[0],
        (LEADLESS, "moulds.cavities=[4,2]"),
        pytest.param((LEADLESS, "moulds.cavities=[6,6]"), marks=pytest.mark.long),
    ],
)
def test_like_cells_have_the_findings_that_each_has_alone(gang):
    moulds = set_of(*gang)
    assert all(len(set(cells)) < len(cells) for cells in moulds.cells)
    assert [shown(f) for f in check_moulds(moulds)] == [shown(f) for f in check_moulds(each_cell_alone(moulds))]


@pytest.mark.parametrize(
    "gang",
    [
        pytest.param((LEADLESS, f"moulds.cavities=[{columns},{rows}]"), marks=[] if cells <= 6 else [pytest.mark.long])
        for columns in range(1, 7)
        for rows in range(1, 7)
        if (cells := columns * rows) in (4, 6, 9, 16, 25, 36)
    ],
)
def test_a_gang_s_groove_walls_are_those_of_the_whole_plate(gang, monkeypatch):
    moulds = set_of(*gang)
    in_parts = [shown(finding) for finding in groove_walls.findings(moulds)]
    monkeypatch.setattr(groove_walls, "_tiles", lambda *_: [])
    assert in_parts == [shown(finding) for finding in groove_walls.findings(MouldSet(moulds.spec))]


def test_a_groove_that_joins_its_cells_is_looked_at_cell_by_cell(monkeypatch):
    """Ends of the joints' sides lie nearer to the cells than their middles do."""
    made = []
    tiles = groove_walls._tiles

    def counted(*given):
        made.append(len(tiles(*given)))
        return tiles(*given)

    monkeypatch.setattr(groove_walls, "_tiles", counted)
    assert len(list(groove_walls.findings(set_of(LEADLESS, "moulds.cavities=[10,2]", *BED)))) == len(made)
    assert made == [20] * len(made)


def test_shells_are_what_manifold_tells_apart():
    hollow = Manifold.sphere(3, 16) - Manifold.cube((1, 1, 1), True)
    parts = [Manifold.cube((1, 2, 1)).translate((3 * i, 0, 0)) for i in range(40)] + [hollow.translate((0, 50, 0))]
    solid = Manifold.compose(parts)
    found, known = shells(solid), solid.decompose()
    assert len(found) == len(known) == 42  # a cavity is a shell, with a volume below 0
    assert sorted(map(sizes, found)) == sorted(map(sizes, known))


def sizes(solid):
    return tuple(round(value, 9) for value in (*solid.bounding_box(), solid.volume()))


def shown(finding):
    """A finding, its value to six decimals; of overlaps that hold the largest is one of rounding, whichever it is."""
    where = finding.where.split(":")[0] if finding.code == "C200" and finding.ok else finding.where
    return finding.code, where, finding.ok, round(finding.value, 6), round(finding.limit, 6)


FAULTS = [
    ("C100", "base", lambda shape: cut(shape, [box(15, 16, 0, 1, 1.5, 9)])),
    ("C100", "cup2", lambda shape: union((shape, box(-19, -17, 6.5, 7.2, 1, 2)))),
    ("C300", "cup2", lambda shape: union((shape, box(16, 18, 24.9, 25.1, 1, 2)))),
    ("C200", "filament5", lambda shape: union((shape, box(0, 1.2, -0.5, 0.5, 0, 1)))),
]


@pytest.mark.parametrize(("code", "tool", "change"), FAULTS)
def test_a_fault_in_one_cell_is_found_there(code, tool, change):
    faulty = with_fault(set_of(LEADLESS, "moulds.cavities=[3,3]"), tool, change)
    found = {(f.code, f.where) for f in check_moulds(faulty) if not f.ok}
    alone = {(f.code, f.where) for f in check_moulds(each_cell_alone(faulty)) if not f.ok}
    assert code in {code for code, _ in found}
    assert found == alone
    cells = {where for code, where in found if code == "C100"}
    assert len(cells) <= 2  # pours of that one cell


def test_of_filaments_that_leave_together_the_one_that_is_caught_is_named():
    """A piece of the base below the middle filament stops it, and no other."""
    faulty = with_fault(set_of(LEADLESS, "moulds.cavities=[3,3]"), "base", lambda base: union((base, BELOW)))
    found = [f for f in draw.findings(faulty) if not f.ok]
    assert [f.where for f in found] == ["pour 2: filament5 out against base"]
    radius = faulty.spec.moulds.filament_mm / 2
    # Over the box lie half the elbow's disc and 1 mm of the lying tail.
    assert found[0].value == pytest.approx(math.pi / 2 * radius**2 + 2 * radius, rel=1e-3)


def test_a_hundred_cells_have_one_surrounding():
    """The filaments' ways, which differ from row to row, lie below them; numbers lie beside them."""
    moulds = set_of(LEADLESS, "moulds.cavities=[10,10]", *BED)
    assert [len(set(cells)) for cells in moulds.cells] == [1, 1]


def test_a_mesh_that_lacks_a_wedge_makes_a_cell_of_its_own():
    moulds = set_of(LEADLESS, "moulds.cavities=[3,3]")
    cell = moulds.plan.layout.cells[4]
    wedge = Manifold.cube((0.5, 0.02, 0.5)).translate((cell.x + 4.2, cell.y, 1.0))
    damaged = MouldSet(moulds.spec, replace(moulds.plan))
    damaged.__dict__["solids"] = {**moulds.solids, "base": moulds.solids["base"] - wedge}
    assert [cells.count(cells[4]) for cells in damaged.cells] == [1, 1]
    assert [cells.count(cells[4]) for cells in moulds.cells] == [9, 9]


def test_a_column_goes_round_what_it_is_drawn_for():
    column = column_round([Manifold.cube((2, 2, 1)).translate((4, 6, 0))], 0.5)
    assert (column.x, column.y) == (5, 7)
    assert column.radius == pytest.approx(2**0.5 + 0.5)
    assert (column.low, column.high) == (-0.5, 1.5)
