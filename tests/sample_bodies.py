"""Bodies much like a unit and its tooling, drawn by hand: kernels and exports are tried on them, and on templates."""

import math
from pathlib import Path

from unitcad.shape import (
    Common,
    Extrude,
    Profile,
    Revolve,
    box,
    cut,
    cylinder,
    moved,
    polygon,
    ring,
    rounded_rectangle,
    turned,
    union,
)
from unitcad.shape.tree import Body

LEADLESS = str(Path(__file__).with_name("leadless.toml"))
"""A spec of a closed cavity without circuit and wires."""
QUARTER = math.tan(math.pi / 8)

LAYER1 = polygon((4.5, 0), (5.75, 0), (5.75, 3.36), (0, 3.36), (0, 2.11), (4.5, 2.11))
LAYER2 = polygon((5.75, 0), (7, 0), (7, 4.61), (0, 4.61), (0, 3.36), (5.75, 3.36))
SLOT = box(0, 20, -1.7, 1.7, 2.0, 2.5)
LETTER_O = Extrude(rounded_rectangle(1.5, 2.0, 1.0), 0, 0.4, holes=(rounded_rectangle(0.75, 1.25, 0.5),))
LETTER_L = Extrude(polygon((0, 0), (2, 0), (2, 0.8), (0.8, 0.8), (0.8, 4), (0, 4)), 0, 0.4)


def base():
    """A plate with a keyed, tapered plinth, a core, a hole, a bent groove below, and engraved characters."""
    body = union(
        [
            Extrude(rounded_rectangle(22, 22, 3), -8, -2),
            Extrude(rounded_rectangle(14, 14, 3, key=4), -2, 0, top=rounded_rectangle(13.825, 13.825, 3, key=4)),
            cylinder(4.5, 0, 2.11),
        ]
    )
    groove = box(-1, 30, -1, 1, -8, -6.5)
    labels = [moved(LETTER_O, -18, 0, -2.4), moved(LETTER_L, -19, -6, -2.4)]
    return Body("base", "tool", "base", cut(body, [cylinder(0.975, -9, 4), groove, *labels]), (0.55, 0.6, 0.65))


def cup():
    """A one-piece cup: bore, plinth recess with clearance, overflow groove, a window for the tongue."""
    block = Extrude(rounded_rectangle(17, 17, 3, key=4), -1.6, 4.61)
    tools = [
        cylinder(7, -1, 5),
        Extrude(rounded_rectangle(14.15, 14.15, 3, key=4), -1.6, 0, top=rounded_rectangle(13.975, 13.975, 3, key=4)),
        Revolve(polygon((8, 3.61), (9.5, 3.61), (9.5, 5), (8, 5))),
        box(0, 20, -1.6, 1.6, 1.96, 2.56),
    ]
    return Body("cup2", "tool", "cup", cut(block, tools), (0.85, 0.55, 0.2), upside_down=True)


def layers():
    """Two layers of an encapsulating unit, both slotted on one side."""
    return (
        Body(
            "layer1",
            "unit",
            "layer",
            cut(Revolve(LAYER1), [box(3.9, 20, -1.7, 1.7, 2.0, 2.5)]),
            (0.95, 0.85, 0.7),
            "cast",
            1,
        ),
        Body("layer2", "unit", "layer", cut(Revolve(LAYER2), [SLOT]), (0.4, 0.55, 0.75), "cast", 2),
    )


def tongue():
    """A strip, drawn upright and turned twice: a tree with placements."""
    strip = turned(turned(box(-1.5, 1.5, 0, 0.5, 4, 24), "y", 1), "x", 1)
    return Body("tongue", "tool", "tongue", moved(strip, 0, 0, 2), (0.2, 0.6, 0.5))


def filleted():
    """A revolved body with arcs in its profile, touching the axis, shared with a lens."""
    dome = Revolve(Profile(((0, 0, 0), (5, 0, 0), (5, 2, QUARTER), (4, 3, 0), (3, 3, -QUARTER), (2, 4, 0), (0, 4, 0))))
    return Body(
        "dome", "tool", "coupon", Common((dome, cylinder(4.5, -1, 9), box(-9, 4, -9, 9, -1, 9))), (0.7, 0.3, 0.3)
    )


def gang():
    """A plate with six cores that stand on it and six holes through them: many tools in one node."""
    places = [(18.0 * i, 18.0 * j) for i in range(3) for j in range(2)]
    cores = [moved(cylinder(4.5, 0, 2.11), x, y) for x, y in places]
    holes = [moved(cylinder(0.975, -9, 9), x, y) for x, y in places]
    return Body("gang", "tool", "base", cut(union([box(-12, 48, -12, 30, -6, 0), *cores]), holes), (0.5, 0.5, 0.5))


def tube():
    """A plain tube."""
    return Body("tube", "tool", "coupon", ring(3, 5, 0, 10), (0.1, 0.2, 0.3))


def all_bodies():
    """Every sample."""
    return [base(), cup(), *layers(), tongue(), filleted(), gang(), tube()]
