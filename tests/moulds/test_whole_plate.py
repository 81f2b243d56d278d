"""Gangs judged by one cell of each kind have the findings of the whole plate, sound and with planted faults."""

import math
from dataclasses import replace

import pytest
from faulty_sets import set_of, with_fault
from manifold3d import Manifold, OpType

from tests.sample_bodies import LEADLESS
from unitcad.checks import check_moulds, draw, groove_walls, overlap
from unitcad.kernels.mesh import realise, shells
from unitcad.moulds.cavities import Cavity, united
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.surroundings import column_round
from unitcad.shape import box, cut, cylinder, moved, union

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


def whole_plate_findings(moulds, monkeypatch):
    """Return what the checks find where no place stands for another and every cavity is that of the whole plate."""
    whole = MouldSet(moulds.spec, moulds.altered)
    whole.__dict__["cells"] = (tuple(range(len(moulds.plan.layout.cells))),) * len(moulds.plan.steps)
    whole.__dict__["cavities"] = tuple(
        Cavity(cavity.step, cavity.where, cavity.drawn, reached_from(cavity, parts), i)
        for i, (cavity, parts) in enumerate(with_parts(whole))
    )
    with monkeypatch.context() as patch:
        patch.setattr(groove_walls, "_tiles", lambda *_: [])
        patch.setattr(overlap, "_alike", lambda *_: {})
        return [shown(finding) for finding in check_moulds(whole)]


def with_parts(moulds):
    """Return each cell with the layer as drawn, and the hollows of its pour on the whole plate."""
    found, count = [], len(moulds.plan.layout.cells)
    for step in moulds.plan.steps:
        parts, share = whole_plate_cavity(moulds, step.index - 1), len(step.channels) // count
        for i, layer in enumerate(moulds.meshes(step.layer)):
            drawn = united([layer, *moulds.meshes(step.channels[i * share : (i + 1) * share])])
            found.append((Cavity(step, f"pour {step.index} cell {i + 1}", drawn, drawn, 0), parts))
    return found


def reached_from(cavity, parts):
    """Return the part that holds most of a layer."""
    return max(parts, key=lambda part: (part ^ cavity.drawn).volume())


@pytest.mark.parametrize(
    ("columns", "rows"),
    [
        pytest.param(columns, rows, marks=[] if (columns, rows) == (2, 2) else [pytest.mark.long])
        for columns in range(1, 7)
        for rows in range(1, 7)
        if columns * rows > 1
    ],
)
def test_a_gang_has_the_findings_of_its_whole_plate(columns, rows, monkeypatch):
    moulds = set_of(LEADLESS, f"moulds.cavities=[{columns},{rows}]", *BED)
    assert [shown(finding) for finding in check_moulds(moulds)] == whole_plate_findings(moulds, monkeypatch)


def hole(x, y, radius=0.6):
    """Draw a hole through a cup."""
    return moved(cylinder(radius, -1, 20), x, y)


# Cells stand 18 mm apart, the middle one at 0, 0.
FAULTS = {
    "a lip in a corner cell": ("C300", "cup2", lambda s: union((s, box(16, 18, 24.9, 25.1, 1, 2)))),
    "a lump in the middle cell": ("C100", "cup2", lambda s: union((s, box(-1, 1, 6.5, 7.2, 1, 2)))),
    "a lump in an edge cell": ("C100", "cup2", lambda s: union((s, box(-20, -18, 6.5, 7.2, 1, 2)))),
    "a lump in a corner cell": ("C100", "cup2", lambda s: union((s, box(17, 19, 24.5, 25.2, 1, 2)))),
    "a leak between two cells": ("C100", "cup2", lambda s: cut(s, [box(6, 13, -0.5, 0.5, 1, 2)])),
    "a hole between two cells": ("C230", "cup2", lambda s: cut(s, [hole(9.5, 0)])),
    "a hole between four cells": ("C230", "cup2", lambda s: cut(s, [hole(9.5, 5.5)])),
    "a hole at the edge": ("C230", "cup2", lambda s: cut(s, [hole(-28.5, 0)])),
    "a hole at the corner": ("C230", "cup1", lambda s: cut(s, [hole(25.5, 25.5)])),
    "a filament too thick in a corner": (
        "C200",
        "filament1",
        lambda s: union((s, box(-19, -17.8, -19.5, -18.5, 0, 1))),
    ),
}


@pytest.mark.parametrize(
    "fault",
    [pytest.param(f, marks=[] if f.startswith("a hole between two") else [pytest.mark.long]) for f in FAULTS],
)
def test_a_planted_fault_has_the_findings_of_the_whole_plate(fault, monkeypatch):
    code, tool, change = FAULTS[fault]
    moulds = with_fault(set_of(LEADLESS, "moulds.cavities=[3,3]", *BED), tool, change)
    found = [shown(finding) for finding in check_moulds(moulds)]
    assert code in {each[0] for each in found if not each[2]}
    assert found == whole_plate_findings(moulds, monkeypatch)
