"""PrusaSlicer slices every piece of every tool of every shipped array, and repairs none of them."""

import pytest

from unitcad.arrays.array_file import array_templates, load_array
from unitcad.arrays.patch import patch_moulds
from unitcad.casting.figures import FDM_ERROR, print_min
from unitcad.export import printing, slicer
from unitcad.export.printing import print_ready
from unitcad.kernels.mesh import arrays
from unitcad.spec import printer_of

pytestmark = [
    pytest.mark.slicer,
    pytest.mark.skipif(slicer.program() is None, reason="PrusaSlicer is not installed"),
]


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
        assert not slicer.needs_repair(path), tool.name
        sliced = slicer.slice_file(path, printer_of(moulds.spec))
        assert sliced.print_s > 60, tool.name
        taken += sliced.print_s / 60
    solid = sum(moulds.mesh(tool).volume() for tool in moulds.plan.pieces if tool.made == "printed")
    low, high = FDM_ERROR
    assert low <= taken / print_min(moulds.spec, solid, 0.0) <= high
