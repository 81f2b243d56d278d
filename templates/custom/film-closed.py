"""A washable unit: a film closes it at the skin, and the body is poured round motor and circuit. Lengths in mm.

  .-------------------.
  |     .-------.     |   layer 2, round the motor
  |     | motor |     |
  |   --------------------------- circuit: its pad under the motor, its tail out over the film
  |       film        |   layer 1
==========================  skin, z = 0
"""

from dataclasses import replace

from unitcad.designs import Design
from unitcad.designs.design import Fitting, circuit, motor
from unitcad.designs.dimensions import concentric
from unitcad.errors import Refusal
from unitcad.shape import cut, cylinder, moved


def layers(spec, dims):
    """Draw the film, the body, and what lies between them: the circuit, and the motor on it."""
    film, top = dims.heights
    laid = moved(circuit(spec.fpcb, dims.pad, dims), z=film - dims.pad.low)
    can = moved(motor(dims), z=film + spec.fpcb.thickness_mm)
    body = cut(cylinder(dims.outer_radius, film, top), [laid, can])
    return {"layer1": cylinder(dims.outer_radius, 0, film), "layer2": body, "motor": can, "fpcb": laid}


def dimensions(spec):
    """Return the dimensions: the film is as thick as layer 1's cap, and layer 2's cap lies over the motor."""
    film, cap = spec.layers[0].cap_mm, spec.layers[-1].cap_mm
    inside = spec.motor.thickness_mm + (spec.fpcb.thickness_mm if spec.fpcb else 0.0)
    found = concentric(spec, 0.0, None)
    outer = spec.diameter_mm / 2
    return replace(found, radii=(outer,) * len(spec.layers), heights=(film, film + inside + cap)[: len(spec.layers)])


def limits(spec, dims):
    """Refuse what is no film-closed unit."""
    if len(spec.layers) != 2:
        raise Refusal("layers", len(spec.layers), "a film-closed unit has two, the film and the body")
    if not spec.fpcb:
        raise Refusal("fpcb", None, "is required: the circuit lies on the film")
    if not spec.motor.fill:
        raise Refusal("motor.fill", False, "the body is poured round the motor", True)
    for i, layer in enumerate(spec.layers):
        if layer.cap_mm < 0.4:
            raise Refusal(f"layers.{i}.cap_mm", layer.cap_mm, "film and body are at least 0.4 mm thick", 0.4)


def assembly(spec, dims):
    """Write how motor and circuit are laid into the mould."""
    return [
        Fitting(
            "Solder the motor to the circuit's pad, and try the motor: nothing of it can be reached later.",
            required_tools=("soldering iron and solder",),
        ),
        Fitting(
            "Brush a thin coat of the mix onto the middle of the film. Lay the circuit on it, its pad in the middle, "
            "the motor up, the tail on the base's rib. Press the pad down from its middle, so that no air stays under "
            "it.",
            required_tools=("small brush",),
            mix=True,
            place="in",
        ),
    ]


DESIGN = Design(
    name="film-closed",
    about="closed at the skin by a film, the motor cast in",
    layers=layers,
    dimensions=dimensions,
    limits=limits,
    laid_in=2,
    assembly=assembly,
)
