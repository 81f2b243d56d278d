"""A shape as a piece of tooling: its name, colour, attitude on the printer, and the way that it is taken away."""

from __future__ import annotations

from collections.abc import Sequence

from unitcad.designs.tooling import Layout
from unitcad.moulds.layout import BLADE_HEIGHT
from unitcad.shape import Extrude, Shape, moved, polygon, turned
from unitcad.shape.body import Body

_BASE, _CUP, _CUP2, _TONGUE = (0.76, 0.76, 0.76), (0.96, 0.83, 0.66), (0.73, 0.83, 0.93), (0.90, 0.30, 0.30)
_BLADE, _FILAMENT, _LID = (0.87, 0.87, 0.55), (0.22, 0.22, 0.22), (0.80, 0.72, 0.90)
_UP, _DOWN = (0, 0, 1), (0, 0, -1)


def base_piece(shape: Shape) -> Body:
    """Return the base, which stays for all pours."""
    return Body("base", "tool", "base", shape, _BASE)


def cup_piece(pour: int, shape: Shape, file: Shape | None = None) -> Body:
    """Return the cup of a pour (from 1), printed upside down and lifted off upwards; `file`: its shape in files."""
    colour = _CUP if pour % 2 else _CUP2
    return Body(f"cup{pour}", "tool", "cup", shape, colour, step=pour, upside_down=True, removal=_UP, file=file)


def lid_piece(pour: int, shape: Shape) -> Body:
    """Return the lid of a pour (from 1), printed upside down and lifted off upwards."""
    return Body(f"lid{pour}", "tool", "lid", shape, _LID, step=pour, upside_down=True, removal=_UP)


def tongue_pieces(strips: Sequence[tuple[int, Shape]], brittle: bool) -> list[Body]:
    """Return tongues, each pulled out to its side (+1, -1 along x).

    A printed resin is too `brittle` for a strip this thin: it is cut from film or steel.
    """
    made = "cut" if brittle else "printed"
    return [
        Body(_numbered("tongue", i, strips), "tool", "tongue", shape, _TONGUE, made=made, removal=(side, 0, 0))
        for i, (side, shape) in enumerate(strips)
    ]


def filament_pieces(filaments: Sequence[Shape]) -> list[Body]:
    """Return filaments, pulled out downwards."""
    return [
        Body(_numbered("filament", i, filaments), "tool", "filament", piece, _FILAMENT, made="cut", removal=_DOWN)
        for i, piece in enumerate(filaments)
    ]


def tray_piece(shape: Shape) -> Body:
    """Return the tray of a skin's film; it takes part in no pour."""
    return Body("skin-tray", "tool", "tray", shape, _CUP)


def blade_piece(shape: Shape, *, too_long: bool = False) -> Body:
    """Return the blade, printed upside down; it is part of no pour.

    One too long for the bed is cut, without a joint.
    """
    return Body("blade", "tool", "blade", shape, _BLADE, made="cut" if too_long else "printed", upside_down=True)


def _numbered(name: str, index: int, among: Sequence[object]) -> str:
    return name if len(among) == 1 else f"{name}{index + 1}"


BLADE_THICKNESS, BLADE_EDGE = 3.0, 0.8


def blade(lay: Layout, rim: float) -> Shape:
    """Draw the strike-off blade, edge down on the rim: a bar as long as the plate, bevelled to a flat edge."""
    return bar(lay.plate[1], rim)


def bar(half: float, rim: float) -> Shape:
    """Draw a bevelled bar of the length 2 `half` along y, its edge at the height `rim`."""
    t, e, h = BLADE_THICKNESS, BLADE_EDGE, BLADE_HEIGHT
    section = polygon((0, 0), (e, 0), (t, 2 * (t - e)), (t, h), (0, h))
    # Drawn in (x, z) and stood up: x to x, y to z, extrusion to -y.
    return moved(turned(Extrude(section, -half, half), "x", 1), 0, 0, rim)
