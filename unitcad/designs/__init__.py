"""Designs: from a spec to the named bodies of a unit. Every file here that defines DESIGN is one."""

from __future__ import annotations

import pkgutil
import re
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from importlib import import_module

from unitcad.designs import design
from unitcad.designs.custom import custom
from unitcad.designs.design import Design, Tooling
from unitcad.designs.dimensions import Dimensions
from unitcad.errors import Refusal, UnitcadError, unknown_name
from unitcad.shape import cylinder
from unitcad.shape.tree import Body
from unitcad.spec import Spec
from unitcad.spec.custom_code import is_custom
from unitcad.spec.raw import RawSpec

__all__ = [
    "CIRCUIT_COLOUR",
    "Design",
    "Dimensions",
    "Tooling",
    "default_design",
    "design_of",
    "dimensions",
    "estimated_designs",
    "inserts",
    "layer_colour",
    "shipped",
    "unit_bodies",
    "widths",
]

_LAYER_COLOURS = (
    (0.38, 0.65, 1.00),
    (0.54, 0.87, 0.54),
    (0.98, 0.80, 0.40),
    (0.87, 0.56, 0.87),
    (0.55, 0.85, 0.85),
    (0.95, 0.60, 0.55),
)
_RESERVED = re.compile(r"(layer|wire)[0-9]+|fpcb")
"""Names of bodies that are not printed."""
_TABLES = {"layer": ("layers", "[[layers]] table"), "wire": ("wires", "wire"), None: ("fpcb", "[fpcb] table")}
_MOTOR_COLOUR, CIRCUIT_COLOUR = (0.70, 0.70, 0.78), (0.93, 0.56, 0.15)


@cache
def shipped() -> dict[str, Design]:
    """Return the designs of this package by name."""
    modules = (import_module(f"{__name__}.{file.name}") for file in pkgutil.iter_modules(__path__))
    return {module.DESIGN.name: module.DESIGN for module in modules if hasattr(module, "DESIGN")}


def design_of(spec: RawSpec) -> Design:
    """Return the design of a spec. Raises Refusal for an unknown one, UnitcadError for a custom one that fails."""
    if spec.body:
        from unitcad.designs.offset.layers import layered  # numpy and manifold3d: most specs do without

        return layered(spec.body)
    if is_custom(spec.design):
        return custom(spec.design, spec.design_source or "")
    if spec.design.endswith(".py"):
        raise Refusal("design", spec.design, f"name the function or Design in that file: {spec.design}:NAME")
    if spec.design not in shipped():
        raise unknown_name("design", spec.design, shipped())
    return shipped()[spec.design]


def dimensions(spec: Spec) -> Dimensions:
    """Return the lengths that follow from a spec, mm."""
    return design_of(spec).dimensions(spec)


def estimated_designs() -> dict[str, Design]:
    """Return the shipped designs that have an estimate by name."""
    return {name: design for name, design in shipped().items() if design.passes}


def default_design() -> Design:
    """Return the default design."""
    return next(design for design in shipped().values() if design.default)


def layer_colour(index: int) -> tuple[float, float, float]:
    """Return the colour of layer `index` (from 0, inside out)."""
    return _LAYER_COLOURS[index % len(_LAYER_COLOURS)]


def unit_bodies(spec: Spec) -> tuple[Body, ...]:
    """Return the bodies of the unit as assembled on the skin z = 0: layers inside out, motor, circuit or wires.

    "layer1" ... and "skin" are cast. Motor ("motor"), circuit ("fpcb") and wires ("wire1" ...) are bought, and added
    if the design draws none. Bodies of other names are printed.

    Raises Refusal for a layer, circuit or wire that the spec lacks.
    """
    design = design_of(spec)
    dims = design.dimensions(spec)
    drawn = design.layers(spec, dims)
    names = [f"layer{i + 1}" for i in range(len(spec.layers))]
    inside = {body.name: body for body in _inside(spec, dims)}
    for name in drawn:
        if (reserved := _RESERVED.fullmatch(name)) and name not in names and name not in inside:
            field, word = _TABLES[reserved[1]]
            limit = (
                f"design {spec.design} has the body {name}, and the spec has no {word} for it; "
                "add it, or name the body otherwise if it is a printed part"
            )
            raise Refusal(field, len(names) if field == "layers" else None, limit)
    bodies = []
    for i, (name, shape) in enumerate(drawn.items()):
        if name in inside:
            bodies.append(replace(inside[name], shape=shape))
            continue
        step = names.index(name) + 1 if name in names else None
        kind, made = ("layer", "cast") if step else ("printed", "printed")
        bodies.append(Body(name, "unit", kind, shape, layer_colour(i), made=made, step=step))
    if dims.skin:
        film = cylinder(dims.outer_radius, -dims.skin, 0.0)
        bodies.append(Body("skin", "unit", "film", film, layer_colour(len(names) - 1), made="cast"))
    return (*bodies, *(body for body in inside.values() if body.name not in drawn))


def widths(spec: Spec, boxes: Sequence[Sequence[float]]) -> tuple[float, ...]:
    """Return a unit's diameter, mm; of a custom design its width, or those along x and y if they differ.

    `boxes` are the bounding boxes of its bodies without motor, circuit and wires: x0, y0, z0, x1, y1, z1.
    """
    if not (is_custom(spec.design) and boxes):
        return (spec.diameter_mm,)
    x, y = (max(box[k + 3] for box in boxes) - min(box[k] for box in boxes) for k in (0, 1))
    return (x, y) if abs(x - y) > 0.005 * max(x, y) else (max(x, y),)


def inserts(spec: Spec) -> tuple[Body, ...]:
    """Return the bodies that are laid into the mould before the pour `Design.laid_in`, to stay; () if it is 0.

    Raises UnitcadError if the spec has fewer pours.
    """
    laid_in, pours = design_of(spec).laid_in, len(spec.layers)
    if laid_in > pours:
        raise UnitcadError(f"design {spec.design}: laid_in is {laid_in}, and there are {pours} pours")
    return tuple(body for body in unit_bodies(spec) if body.made != "cast") if laid_in else ()


def _inside(spec: Spec, dims: Dimensions) -> tuple[Body, ...]:
    """Return the bought bodies that go into the silicone."""
    bodies: list[Body] = []
    if not spec.motor.absent:
        bodies.append(Body("motor", "unit", "motor", design.motor(dims), _MOTOR_COLOUR, made="bought"))
    if spec.fpcb and dims.pad:
        drawn = design.circuit(spec.fpcb, dims.pad, dims)
        bodies.append(Body("fpcb", "unit", "circuit", drawn, CIRCUIT_COLOUR, made="bought"))
    if spec.wires and dims.exit:
        bodies += [
            Body(f"wire{i + 1}", "unit", "wire", shape, CIRCUIT_COLOUR, made="bought")
            for i, shape in enumerate(design.wires(spec.wires, dims.exit.wires_y, dims))
        ]
    return tuple(bodies)
