"""A dome over the motor: an arc from the rim to the top, a point or a disc. Lengths in mm, z = 0 at the skin."""

from unitcad.shape import Profile, Revolve


def unit(spec):
    """Draw silicone from the motor outwards; a flat top of `flat_mm` is an opening to pour into from above."""
    outer, motor, flat = spec.diameter_mm / 2, spec.motor, spec.parameters["flat_mm"] / 2
    inner, roof = motor.diameter_mm / 2, motor.thickness_mm
    top = roof + spec.layers[0].cap_mm
    # (x, y, bulge): the bulge of a side is the tangent of a quarter of its arc's angle, as in DXF.
    arc = [(outer, 0, spec.parameters["bulge"]), *([(flat, top, 0)] if flat else []), (0, top, 0)]
    return Revolve(Profile(((inner, 0, 0), *arc, (0, roof, 0), (inner, roof, 0))))
