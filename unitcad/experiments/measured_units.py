"""The nine units that were measured, as specs and as the estimate's input, in the shapes that they may have had."""

from __future__ import annotations

from functools import cache

from unitcad.attenuation.edge.measured_levels import CONTROL, measured_table
from unitcad.attenuation.inputs import EstimateInput
from unitcad.catalogue import measurements
from unitcad.designs import shipped
from unitcad.estimating import estimate_input
from unitcad.spec import Spec
from unitcad.validation import from_data


def unit_spec(design: str, unit: str) -> Spec:
    """Return the spec of a measured unit in a design, "E10/D30" or a control "D10", with its walls and caps."""
    names, shared = measurements().layers(unit), measurements().unit
    wall = 2 * shared.wall_mm / len(names)
    layers = [
        {"material": name, "wall_mm": wall, **({"cap_mm": wall} if shipped()[design].caps else {})} for name in names
    ]
    data = {"name": unit, "design": design, "diameter_mm": shared.diameter_mm, "fpcb": {}, "layers": layers}
    return from_data(data)


@cache
def measured_variants() -> tuple[tuple[EstimateInput, ...], ...]:
    """Return the input of every measured unit, in the order of `measured_table`; a control's in both shapes."""
    found = []
    for name in measured_table().names:
        design, layers = name.split(" ")
        shapes = tuple(measurements().designs) if design == CONTROL else (design,)
        found.append(tuple(estimate_input(unit_spec(shape, layers)) for shape in shapes))
    return tuple(found)
