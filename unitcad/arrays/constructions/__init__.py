"""Constructions: ways to fasten and cast the units of an array. Every file here that defines CONSTRUCTION is one."""

from __future__ import annotations

import pkgutil
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from typing import NamedTuple

from unitcad.arrays.array import Array, Sheet
from unitcad.arrays.array_tables import Cast
from unitcad.arrays.array_tables import Construction as Name
from unitcad.designs.design import Fitting
from unitcad.errors import Refusal
from unitcad.moulds.plan import Plan
from unitcad.shape.tree import Body
from unitcad.spec import Spec


class Level(NamedTuple):
    """Place of a sheet, mm over the skin, and the thickest one that would fit there."""

    low: float
    high: float
    most: float


@dataclass(frozen=True)
class Construction:
    """A construction by its name in a file.

    mixed         whether single places may hold another unit
    own_tails     whether units are cast whole by their own moulds, each with the tail of its own circuit
    thickness_mm  of the sheet if the file gives none
    apart         least distance between the edges of two units, mm, and why
    level         from the distinct units, a thickness and the limb's radius (None: flat) to the sheet's place
    unfit         from a unit and the sheet to the reason why it does not fit; "" if it does
    bodies        the silicone that an array has besides its units, as cast
    plan          tools and pours of those bodies; raises Refusal if they can't be made
    assembly      how motors and circuit go into the silicone, a sentence each; () if they are in the units
    greased       faces that get petroleum jelly before the cup of a pour (from 1) is put on; "" if none does
    """

    name: str
    about: str
    mixed: bool
    own_tails: bool
    thickness_mm: float
    apart: Callable[[Spec], tuple[float, str]]
    level: Callable[[tuple[Spec, ...], float, float | None], Level]
    bodies: Callable[[Array], tuple[Body, ...]]
    plan: Callable[[Array], Plan]
    unfit: Callable[[Spec, Sheet], str] = lambda _, __: ""
    assembly: Callable[[Array], tuple[Fitting, ...]] = lambda _: ()
    greased: Callable[[Array, int], str] = lambda _, __: ""
    cast: Cast = "flat"


def construction_of(name: Name, cast: Cast) -> Construction:
    """Return a construction cast flat, or curved. Raises Refusal for one that is cast flat only."""
    if (name, cast) not in _found():
        raise Refusal("limb.cast", cast, f"{name} are cast flat and bent; a back sheet can be cast curved", "flat")
    return _found()[name, cast]


@cache
def _found() -> dict[tuple[str, str], Construction]:
    """Return every CONSTRUCTION that a file of `constructions` defines, by its name and cast."""
    modules = (import_module(f"{__name__}.{file.name}") for file in pkgutil.iter_modules(__path__))
    found = (module.CONSTRUCTION for module in modules if hasattr(module, "CONSTRUCTION"))
    return {(construction.name, construction.cast): construction for construction in found}
