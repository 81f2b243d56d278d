"""Shape to boundary representation, by the library that is passed in: a module with the functions of `occt` (`line` to
`place`). No library is loaded here.

The result is exact: arcs are arcs, and every volume is OCCT's to about 1e-12. A node is one boolean with all its tools
in one list, which OCCT's general fuse does several times faster than one after the other.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from unitcad.kernels.mesh import arrays
from unitcad.kernels.mesh import realise as meshed
from unitcad.shape import Below, Common, Component, Cut, Extrude, Place, Polyhedron, Revolve, Shape, Union
from unitcad.shape.profile import Profile, arc_middle, sides
from unitcad.shape.tree import corners_and_faces

Point = tuple[float, float, float]


def realise(shapes: Iterable[Shape], library: Any) -> list[Any]:
    """Return the solids of `shapes` in `library`; common parts are built once."""
    known: dict[Shape, Any] = {}
    return [_solid(shape, library, known) for shape in shapes]


def _solid(shape: Shape, library: Any, known: dict[Shape, Any]) -> Any:
    if shape not in known:
        known[shape] = _built(shape, library, known)
    return known[shape]


def _is_faceted(shape: Shape) -> bool:
    """Tell whether a shape is made of polyhedra only: its mesh is exact then."""
    match shape:
        case Revolve() | Extrude():
            return False
        case Polyhedron():
            return True
        case Union(parts) | Common(parts):
            return all(map(_is_faceted, parts))
        case Cut(body, tools):
            return all(map(_is_faceted, (body, *tools)))
    return _is_faceted(shape.shape)


def _built(shape: Shape, library: Any, known: dict[Shape, Any]) -> Any:
    if not isinstance(shape, Polyhedron) and _is_faceted(shape):
        # OCCT takes minutes for booleans of thousands of faces.
        corners, faces = arrays(meshed(shape, 3))
        return library.polyhedron(corners.tolist(), faces.tolist())
    match shape:
        case Revolve(profile):
            return library.revolve(library.face(_wire(profile, lambda r, z: (r, 0.0, z), library), []))
        case Extrude(profile, z0, z1, holes, None):
            face = library.face(_level(profile, z0, library), [_level(hole, z0, library) for hole in holes])
            return library.extrude(face, z1 - z0)
        case Extrude(profile, z0, z1, _, Profile() as top):
            return library.loft(_level(profile, z0, library), _level(top, z1, library))
        case Polyhedron():
            corners, faces = corners_and_faces(shape)
            return library.polyhedron(corners.tolist(), faces.tolist())
        case Union(parts):
            return library.fuse([_solid(part, library, known) for part in parts])
        case Cut(body, tools):
            return library.cut(_solid(body, library, known), [_solid(tool, library, known) for tool in tools])
        case Common(parts):
            # Several tools in one list would mean their union, so one after the other.
            first, *rest = (_solid(part, library, known) for part in parts)
            for other in rest:
                first = library.common(first, other)
            return first
        case Component(inner, at):
            return library.component(_solid(inner, library, known), at)
        case Below(inner, bottom):
            return library.below(_solid(inner, library, known), bottom)
        case Place(inner, turn, move):
            return library.place(_solid(inner, library, known), turn, move)
    raise TypeError(f"not a shape: {shape!r}")


def _level(profile: Profile, z: float, library: Any) -> Any:
    return _wire(profile, lambda x, y: (x, y, z), library)


def _wire(profile: Profile, lift: Any, library: Any) -> Any:
    edges = []
    for start, end in sides(profile.vertices):
        ends = lift(*start[:2]), lift(*end[:2])
        edges.append(library.arc(ends[0], lift(*arc_middle(start, end)), ends[1]) if start[2] else library.line(*ends))
    return library.wire(edges)
