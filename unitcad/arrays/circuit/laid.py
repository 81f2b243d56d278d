"""The common circuit as it lies in the silicone."""

from __future__ import annotations

from dataclasses import replace

from unitcad.arrays.array import Array
from unitcad.arrays.circuit.outline import circuit_body
from unitcad.arrays.limb_frame import LENGTH, at_place
from unitcad.shape import Common, cylinder, moved
from unitcad.shape.body import Body


def laid_circuit(array: Array) -> tuple[Body, ...]:
    """Return the circuit in the frame that the silicone is cast in.

    In a curved cast what of it lies within each unit is flat; between the units it bends freely, and is not drawn.
    """
    whole = circuit_body(array)
    if array.cast == "flat":
        return (whole,)
    return tuple(
        replace(
            whole,
            name=f"{place.name}-circuit",
            shape=at_place(
                array,
                Common((moved(whole.shape, -place.x, -place.y), cylinder(place.radius, -LENGTH, LENGTH))),
                place,
            ),
        )
        for place in array.places
    )
