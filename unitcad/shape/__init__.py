"""Solids as data: profiles and trees of them. No kernel is loaded here.

Examples
--------
A disc with a round pocket, in mm:

>>> from unitcad.shape import cut, cylinder, exact_volume
>>> disc = cylinder(7, 0, 4)
>>> unit = cut(disc, [cylinder(3.5, 0, 2)])
>>> round(exact_volume(disc), 1)
615.8
"""

from unitcad.shape.profile import (
    Profile,
    ProfileError,
    mm,
    polygon,
    rectangle,
    rounded_rectangle,
)
from unitcad.shape.tree import (
    Below,
    Common,
    Component,
    Cut,
    Extrude,
    Place,
    Polyhedron,
    Revolve,
    Shape,
    Union,
    box,
    content_hash,
    cut,
    cylinder,
    exact_volume,
    moved,
    ring,
    rotated,
    turned,
    union,
)

__all__ = [
    "Below",
    "Common",
    "Component",
    "Cut",
    "Extrude",
    "Place",
    "Polyhedron",
    "Profile",
    "ProfileError",
    "Revolve",
    "Shape",
    "Union",
    "box",
    "content_hash",
    "cut",
    "cylinder",
    "exact_volume",
    "mm",
    "moved",
    "polygon",
    "rectangle",
    "ring",
    "rotated",
    "rounded_rectangle",
    "turned",
    "union",
]
