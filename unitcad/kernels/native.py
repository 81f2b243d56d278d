"""Groups of bodies as objects of build123d and CadQuery, in place (mm): a child a group, in it one a body.

Every child has its name, every body its colour.
"""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from typing import Any

from unitcad.errors import UnitcadError
from unitcad.extras import pip_install
from unitcad.kernels import occt
from unitcad.kernels.ocp import loading
from unitcad.shape.tree import Body

Groups = Mapping[str, Sequence[Body]]
"""Bodies by the name of their group."""


def build123d_compound(name: str, groups: Groups) -> Any:
    """Return an assembly as a build123d Compound. Raises Missing without build123d."""
    with loading("build123d"):
        import build123d as b3d
        from build123d.topology import Shape
    solids = _solids(groups)
    children = []
    for group, bodies in groups.items():
        parts = [Shape.cast(next(solids)) for _ in bodies]
        for part, body in zip(parts, bodies, strict=True):
            part.label = body.name
            part.color = b3d.Color(*body.colour)
        children.append(b3d.Compound(label=group, children=parts))
    return b3d.Compound(label=name, children=children)


def cadquery_assembly(name: str, groups: Groups) -> Any:
    """Return an assembly as a CadQuery Assembly. Raises Missing without CadQuery."""
    with loading("cadquery"):
        import cadquery as cq
    solids, whole = _solids(groups), cq.Assembly(name=name)
    for group, bodies in groups.items():
        part = cq.Assembly(name=group)
        for body in bodies:
            part.add(cq.Shape.cast(next(solids)), name=body.name, color=cq.Color(*body.colour))
        whole.add(part, name=group)
    return whole


def _solids(groups: Groups) -> Any:
    """Yield the solid of each body, group by group."""
    return iter(occt.solids(body.shape for bodies in groups.values() for body in bodies))


def show(assembly: Any) -> None:
    """Show a Compound with its names and colours in ocp-vscode's viewer, or on YACV's page if only that is installed.

    Raises UnitcadError without either.
    """
    if find_spec("ocp_vscode"):
        import ocp_vscode

        ocp_vscode.show(assembly)
    elif find_spec("yacv_server"):
        import yacv_server

        leaves = [leaf for group in assembly.children for leaf in group.children]
        yacv_server.show(*leaves, names=[leaf.label for leaf in leaves])
    else:
        raise UnitcadError(f"no viewer is installed: {shlex.join([*pip_install(), 'ocp-vscode'])} (or yacv-server)")
