"""Gangs judged by one cell of each kind have the findings of the whole plate, sound and with planted faults."""

import pytest
from faulty_sets import set_of, with_fault
from test_congruent_places import shown, whole_plate_cavity

from tests.sample_bodies import LEADLESS
from unitcad.checks import check_moulds, groove_walls, overlap
from unitcad.moulds.cavities import Cavity, united
from unitcad.moulds.mould_set import MouldSet
from unitcad.shape import box, cut, cylinder, moved, union

BED = ("moulds.bed_x_mm=400", "moulds.bed_y_mm=400")


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
