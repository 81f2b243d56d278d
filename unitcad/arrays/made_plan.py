"""Tools and pours of an array with all that is drawn before them: whatever can't be made is refused here."""

from __future__ import annotations

from unitcad.arrays.array import Array
from unitcad.arrays.construction import construction_of
from unitcad.moulds.plan import Plan


def made_plan(array: Array) -> Plan:
    """Return tools and pours. Raises Refusal for tools that can't be made, and for a circuit that does not fit."""
    way = construction_of(array.construction, array.cast)
    made = way.plan(array)
    if not way.own_tails:
        from unitcad.arrays.circuit.outline import outline  # the mesh kernel: reading an array does without

        outline(array)
    return made
