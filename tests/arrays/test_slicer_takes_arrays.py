"""PrusaSlicer slices every piece of every tool of every shipped array, and repairs none of them."""

import prusa
import pytest

from unitcad.arrays.array_file import array_templates, load_array
from unitcad.arrays.patch import patch_moulds
from unitcad.casting.figures import FDM_ERROR, print_min
from unitcad.export import printing
from unitcad.export.printing import print_ready
from unitcad.kernels.mesh import arrays
from unitcad.spec import printer_of

pytestmark = prusa.MARKS


SLOW = ("sleeve-curved", "wrist-band")
NAMES = [pytest.param(name, marks=pytest.mark.long if name in SLOW else ()) for name in array_templates()]


@pytest.mark.parametrize("name", NAMES)
def test_every_tool_of_an_array_is_sliced(name, tmp_path):
    moulds = patch_moulds(load_array(name))
    taken = 0.0
    for tool in moulds.plan.pieces:
        if tool.made != "printed":
            continue
        path = tmp_path / f"{tool.name}.stl"
        path.write_bytes(printing.stl(*print_ready(*arrays(moulds.mesh(tool)), tool.upside_down), tool.name))
        assert not prusa.needs_repair(path), tool.name
        minutes = prusa.print_minutes(path, printer_of(moulds.spec), path.with_suffix(".gcode"))
        assert minutes > 1, tool.name
        taken += minutes
    solid = sum(moulds.mesh(tool).volume() for tool in moulds.plan.pieces if tool.made == "printed")
    low, high = FDM_ERROR
    assert low <= taken / print_min(moulds.spec, solid, 0.0) <= high
