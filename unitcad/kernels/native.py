"""Bodies as objects of build123d and CadQuery, as assembled (mm): one child a body, with its name and colour."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from importlib.util import find_spec
from typing import Any

from unitcad.errors import UnitcadError
from unitcad.extras import pip_install
from unitcad.kernels import occt
from unitcad.kernels.ocp import loading
from unitcad.shape.tree import Body


def build123d_compound(bodies: Sequence[Body]) -> Any:
    """Return an assembly as a build123d Compound. Raises Missing without build123d."""
    with loading("build123d"):
        import build123d as b3d
        from build123d.topology import Shape
    children = [Shape.cast(solid) for solid in occt.solids(body.shape for body in bodies)]
    for child, body in zip(children, bodies, strict=True):
        child.label = body.name
        child.color = b3d.Color(*body.colour)
    return b3d.Compound(label="unitcad", children=children)


def cadquery_assembly(bodies: Sequence[Body]) -> Any:
    """Return an assembly as a CadQuery Assembly. Raises Missing without CadQuery."""
    with loading("cadquery"):
        import cadquery as cq
    whole = cq.Assembly(name="unitcad")
    for body, solid in zip(bodies, occt.solids(body.shape for body in bodies), strict=True):
        whole.add(cq.Shape.cast(solid), name=body.name, color=cq.Color(*body.colour))
    return whole


def show(assembly: Any) -> None:
    """Show a Compound with its names and colours in ocp-vscode's viewer, or on YACV's page if only that is installed.

    Raises UnitcadError without either.
    """
    if find_spec("ocp_vscode"):
        import ocp_vscode

        ocp_vscode.show(assembly)
    elif find_spec("yacv_server"):
        import yacv_server

        yacv_server.show(*assembly.children, names=[child.label for child in assembly.children])
    else:
        raise UnitcadError(f"no viewer is installed: {shlex.join([*pip_install(), 'ocp-vscode'])} (or yacv-server)")
