"""A rounded rectangle with two strap lugs, flush with its back. Lengths in mm, z = 0 at the skin.

y      .-----------.
|      |  =slot=   |   lug, upper 1.5 mm
|    .-'-----------'-.
|    |     motor     |== tail, through a notch that is open to the skin
|    '-.-----------.-'
'      |  =slot=   |
       '-----------'
"""

from unitcad.shape import Extrude, box, cut, cylinder, moved, rounded_rectangle, union


def unit(spec):
    """Draw Layer 1 round the motor, and Layer 2 round that with the lugs."""
    given, motor, circuit = spec.parameters, spec.motor, spec.fpcb
    inner, outer = spec.layers
    back = motor.thickness_mm + circuit.thickness_mm
    half_x = motor.diameter_mm / 2 + 0.5 + inner.wall_mm
    half_y = half_x - 1.0
    rim = back + inner.cap_mm
    top = rim + outer.cap_mm

    # Under the tail the notch is open to the skin, so the mould's core and the notch are one piece on the base.
    notch = box(0, 3 * half_x, -circuit.tail_width_mm / 2 - 0.3, circuit.tail_width_mm / 2 + 0.3, -1, back + 0.2)
    cavity = union((cylinder(motor.diameter_mm / 2 + 0.5, -1, back), notch))
    first = Extrude(rounded_rectangle(half_x, half_y, 2), 0, rim)

    body = Extrude(rounded_rectangle(half_x + outer.wall_mm, half_y + outer.wall_mm, 3), 0, top)
    strap, reach = given["strap_mm"], half_y + outer.wall_mm + given["lug_mm"]
    lugs = Extrude(rounded_rectangle(strap / 2 + 2, reach, 2), top - given["lug_thickness_mm"], top)
    slot = box(-strap / 2, strap / 2, -1, 1, -1, top + 1)
    slots = [moved(slot, y=side * (reach - 3)) for side in (1, -1)]
    return {"layer1": cut(first, [cavity]), "layer2": cut(union((body, lugs)), [first, cavity, *slots])}
