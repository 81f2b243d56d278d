"""Back sheets whose like cells are judged once have the findings that every cell has alone, sound and with faults."""

import pytest

from tests.arrays.made_arrays import findings, made, more, with_tool
from unitcad.arrays.patch import patch_moulds
from unitcad.checks import check_moulds, overlap
from unitcad.shape import box, cylinder, moved


def findings_of_each_cell(moulds, monkeypatch):
    """Return what the checks find where no place stands for another."""
    alone = patch_moulds(moulds.arranged, moulds.altered)
    alone.__dict__["cells"] = (tuple(range(len(moulds.plan.layout.cells))),) * len(moulds.plan.steps)
    with monkeypatch.context() as patch:
        patch.setattr(overlap, "_alike", lambda *_: {})
        return [shown(finding) for finding in check_moulds(alone)]


def shown(finding):
    """A finding, its value to six decimals; of overlaps that hold the largest is one of rounding, whichever it is."""
    where = finding.where.split(":")[0] if finding.code == "C200" and finding.ok else finding.where
    return finding.code, where, finding.ok, round(finding.value, 6), round(finding.limit, 6)


ROWS = "forearm-patch", "layout.rows=2", "layout.columns=2", "sheet.strap_slot_mm=[3,8]"


@pytest.mark.parametrize("source", [ROWS, pytest.param(("sleeve-curved",), marks=pytest.mark.long)])
def test_an_array_has_the_findings_that_each_cell_has_alone(source, monkeypatch):
    moulds = made(*source)
    assert len(set(moulds.cells[0])) < len(moulds.cells[0])
    assert [shown(f) for f in findings(*source)] == findings_of_each_cell(moulds, monkeypatch)


def test_the_rows_of_a_patch_are_alike():
    """A row's units differ in the ways of the circuit, left, right or both, and in nothing else."""
    cells = made("forearm-patch").cells
    assert cells[0] == cells[1]
    assert [cells[0].index(number) for number in cells[0]] == [0, 1, 2] * 3


def test_pours_between_which_layers_are_laid_in_elsewhere_have_surroundings_of_their_own():
    assert [len(each.steps) for each in made("sleeve-curved").surroundings] == [1, 1]


# Units stand at -10 and 10 along x and y: bores of 5.75, cores of 4.6, 2.11 high.
FAULTS = {
    "a lump in a bore": ("C100", "cup1", more(box(9.6, 10.4, -4.5, -4, 1, 2))),
    "a knob on a core": ("C300", "base", more(moved(cylinder(4.7, 1.0, 1.4), 10, 10))),
}


@pytest.mark.parametrize(
    "fault", [pytest.param(f, marks=[] if f.startswith("a lump") else [pytest.mark.long]) for f in FAULTS]
)
def test_a_fault_at_one_cell_is_found_as_if_each_were_judged(fault, monkeypatch):
    code, tool, change = FAULTS[fault]
    moulds = with_tool(made(*ROWS), tool, change)
    found = [shown(finding) for finding in check_moulds(moulds)]
    assert code in {each[0] for each in found if not each[2]}
    assert found == findings_of_each_cell(moulds, monkeypatch)
