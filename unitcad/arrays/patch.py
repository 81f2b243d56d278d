"""The patch as it is worn: sheet, units and what goes into them, each at its place (mm, z = 0 at the skin)."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

from unitcad.arrays.array import Array, Placed
from unitcad.arrays.circuit.circuit_files import has_circuit
from unitcad.arrays.circuit.laid import laid_circuit
from unitcad.arrays.construction import construction_of
from unitcad.arrays.limb_frame import at_place
from unitcad.designs import unit_bodies
from unitcad.shape import moved, rotated
from unitcad.shape.body import Body

SHEET = "sheet"


class PatchPart(NamedTuple):
    """A body in its own frame, its name among the parts, the places that it stands at; without any it is in place."""

    name: str
    body: Body
    places: tuple[Placed, ...] = ()


def patch_parts(array: Array) -> tuple[PatchPart, ...]:
    """Return the distinct bodies of the whole patch: the silicone that the units share, then each distinct unit's own.

    Units that are cast in one pour with the sheet are there with what is bought for them, but for a circuit of their
    own: the array's takes its place.
    """
    way = construction_of(array.construction, array.cast)
    shared = way.bodies(array)
    if way.own_tails:
        shared = tuple(replace(body, name=SHEET, shape=moved(body.shape, z=array.sheet.low)) for body in shared)
    own = []
    for i, unit in enumerate(array.units):
        places = tuple(place for place in array.places if array.units.index(place.unit) == i)
        of = f"unit{i + 1}-" if len(array.units) > 1 else ""
        own += [
            PatchPart(f"{of}{body.name}", body, places)
            for body in unit_bodies(unit)
            if way.own_tails or body.kind == "motor"
        ]
    if array.cast == "curved":
        # Turned about the limb, each is a solid of its own.
        own = [PatchPart(body.name, body) for part in own for body in _at_places(array, part)]
    circuit = laid_circuit(array) if has_circuit(array) else ()
    return (*(PatchPart(body.name, body) for body in shared), *own, *(PatchPart(each.name, each) for each in circuit))


def patch_bodies(array: Array) -> tuple[Body, ...]:
    """Return all bodies of the whole patch at their places, a unit's own as "A1-layer1", in the order of the parts."""
    return tuple(
        body for part in patch_parts(array) for body in (_at_places(array, part) if part.places else (part.body,))
    )


def _at_places(array: Array, part: PatchPart) -> tuple[Body, ...]:
    """Return a part's bodies, turned about their axes, at its places."""
    return tuple(
        replace(
            part.body,
            name=f"{place.name}-{part.body.name}",
            shape=at_place(array, rotated(part.body.shape, "z", place.angle_deg), place),
        )
        for place in part.places
    )
