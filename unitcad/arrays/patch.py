"""The patch as it is worn: sheet, units and what goes into them, each at its place (mm, z = 0 at the skin)."""

from __future__ import annotations

from dataclasses import replace

from unitcad.arrays.array import Array, Placed
from unitcad.arrays.circuit.circuit_files import has_circuit
from unitcad.arrays.circuit.outline import circuit_body
from unitcad.arrays.construction import constructions
from unitcad.designs import unit_bodies
from unitcad.shape import Shape, moved, rotated
from unitcad.shape.body import Body

SHEET = "sheet"


def patch_bodies(array: Array) -> tuple[Body, ...]:
    """Return the bodies of the whole patch: the silicone that the units share, then each unit's own as "A1-layer1".

    Units that are cast in one pour with the sheet are there with what is bought for them, but for a circuit of their
    own: the array's takes its place.
    """
    way = constructions()[array.construction]
    shared = way.bodies(array)
    if way.own_tails:
        shared = tuple(replace(body, name=SHEET, shape=moved(body.shape, z=array.sheet.low)) for body in shared)
    drawn = [unit_bodies(unit) for unit in array.units]
    own = [
        replace(body, name=f"{place.name}-{body.name}", shape=at_place(body.shape, place))
        for place in array.places
        for body in drawn[array.units.index(place.unit)]
        if way.own_tails or body.kind == "motor"
    ]
    return (*shared, *own, *([circuit_body(array)] if has_circuit(array) else ()))


def at_place(shape: Shape, place: Placed) -> Shape:
    """Return a unit's solid turned and moved to its place."""
    return moved(rotated(shape, "z", place.angle_deg), place.x, place.y)
