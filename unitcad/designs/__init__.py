"""Designs: from a spec to the named bodies of a unit."""

from __future__ import annotations

from unitcad.designs import common, embedded, encapsulating, own
from unitcad.shape.body import Body
from unitcad.spec import Dimensions, Spec, dimensions
from unitcad.spec.own import is_own

_LAYERS = {"embedded": embedded.layers, "encapsulating": encapsulating.layers}
_LAYER_COLOURS = (
    (0.38, 0.65, 1.00),
    (0.54, 0.87, 0.54),
    (0.98, 0.80, 0.40),
    (0.87, 0.56, 0.87),
    (0.55, 0.85, 0.85),
    (0.95, 0.60, 0.55),
)
_MOTOR_COLOUR, _CIRCUIT_COLOUR = (0.70, 0.70, 0.78), (0.93, 0.56, 0.15)


def layer_colour(index: int) -> tuple[float, float, float]:
    """The colour of layer `index` (from 0, inside out)."""
    return _LAYER_COLOURS[index % len(_LAYER_COLOURS)]


def unit_bodies(spec: Spec) -> tuple[Body, ...]:
    """The bodies of the unit as assembled on the skin z = 0: layers from the inside out, motor, circuit or wires."""
    dims = dimensions(spec)
    if is_own(spec.design):
        return _own_bodies(spec, dims)
    bodies = [
        Body(f"layer{i + 1}", "unit", shape, layer_colour(i), made="cast", step=i + 1)
        for i, shape in enumerate(_LAYERS[spec.design](dims))
    ]
    return (*bodies, *_inside(spec, dims))


def _own_bodies(spec: Spec, dims: Dimensions) -> tuple[Body, ...]:
    """The bodies of a design of one's own: "layer1" ... are cast, whatever else it names is printed; motor and circuit
    are added where it draws none.
    """
    bodies = []
    for i, (name, shape) in enumerate(own.shapes(spec).items()):
        number = name.removeprefix("layer")
        step = int(number) if name != number and number.isdigit() and 1 <= int(number) <= len(spec.layers) else None
        bodies.append(Body(name, "unit", shape, layer_colour(i), made="cast" if step else "printed", step=step))
    drawn = {body.name for body in bodies}
    return (*bodies, *(body for body in _inside(spec, dims) if body.name not in drawn))


def _inside(spec: Spec, dims: Dimensions) -> tuple[Body, ...]:
    """What is bought and goes into the silicone."""
    bodies = [Body("motor", "unit", common.motor(dims), _MOTOR_COLOUR, made="bought")]
    if spec.fpcb:
        bodies.append(Body("fpcb", "unit", common.circuit(spec, dims), _CIRCUIT_COLOUR, made="bought"))
    if spec.wires:
        bodies += [
            Body(f"wire{i + 1}", "unit", shape, _CIRCUIT_COLOUR, made="bought")
            for i, shape in enumerate(common.wires(spec, dims))
        ]
    return tuple(bodies)
