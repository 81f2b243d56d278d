"""Custom units of many outlines with an open notch for the tail, as high as the cavity or higher.

The notch's end lies in an outer face that the kernel cut it from, so that rounding leaves films in that face.
"""

import math
from itertools import pairwise

import numpy as np
import pytest
from faulty_sets import broken, of_spec

from unitcad.errors import UnitcadError
from unitcad.kernels.mesh import arrays
from unitcad.moulds.complement import complement
from unitcad.moulds.plan import cast_layers
from unitcad.pipeline.write import build
from unitcad.shape.profile import mm
from unitcad.validation import load

SPEC = """
name = "d"
design = "d.py:unit"
diameter_mm = 14.0
[motor]
part = "LCM0720A3463F"
[fpcb]
[[layers]]
material = "ecoflex-00-10"
wall_mm = 1.5
cap_mm = 1.25
[[layers]]
material = "dragon-skin-30"
wall_mm = 1.5
cap_mm = 1.25
"""
CODE = """
import math
from unitcad.shape import Extrude, Profile, Revolve, box, cut, cylinder, polygon, rotated, rounded_rectangle, union


def regular(r, sides, z):
    angles = [2 * math.pi * (i + 0.5) / sides for i in range(sides)]
    return Extrude(polygon(*((r * math.cos(a), r * math.sin(a)) for a in angles)), 0, z)


def unit(spec):
    back, shape = spec.motor.thickness_mm + 0.11, lambda r, z: OUTLINE
    core = union((cylinder(4.0, -1, back), rotated(box(0, 30, -1.8, 1.8, -1, back + LIFT), "z", ANGLE)))
    first = shape(5.5, back + 1.25)
    return {"layer1": cut(first, [core]), "layer2": cut(shape(7.0, back + 2.5), [first, core])}
"""
OUTLINES = {
    "disc": "cylinder(r, 0, z)",
    "hexagon": "regular(r, 6, z)",
    "octagon": "regular(r, 8, z)",
    "pentagon": "rotated(regular(r, 5, z), 'z', 36)",
    "stadium": "Extrude(Profile(((-1.5, -r, 0), (1.5, -r, 1.0), (1.5, r, 0), (-1.5, r, 1.0))), 0, z)",
    "dee": "Extrude(Profile(((-4.6, -r, 0), (0, -r, 1.0), (0, r, 0), (-4.6, r, 0))), 0, z)",
    "triangle": "Extrude(polygon((-r, -1.3 * r), (1.6 * r, 0), (-r, 1.3 * r)), 0, z)",
    "turned square": "rotated(box(-r, r, -r, r, 0, z), 'z', 30)",
    "rounded square": "Extrude(rounded_rectangle(r, r, 2), 0, z)",
    "cone": "Revolve(polygon((0, 0), (r + 0.8, 0), (r, z), (0, z)))",
}


def written(folder, outline, lift=0.2, angle=0.0):
    """Write a design with a notch in a direction, and its spec: the circuit's tail leads along +x only."""
    code = CODE.replace("OUTLINE", OUTLINES[outline]).replace("LIFT", str(lift)).replace("ANGLE", str(angle))
    (folder / "d.py").write_text(code)
    (folder / "d.toml").write_text(SPEC.replace("[fpcb]\n", "") if angle else SPEC)
    return folder / "d.toml"


def upright_surface(solid):
    """Return the surface of a solid of level and upright faces that stands on one face, mm2, from its sections."""
    heights = sorted({float(z) for z in arrays(solid)[0][:, 2]})
    walls = 0.0
    for low, high in pairwise(heights):
        loops = solid.slice((low + high) / 2).to_polygons()
        walls += (high - low) * sum(np.hypot(*(np.roll(loop, -1, axis=0) - loop).T).sum() for loop in loops)
    return 2 * float(solid.project().area()) + walls


@pytest.mark.parametrize(
    ("outline", "lift", "angle"),
    [
        pytest.param(outline, lift, angle, marks=[] if (i + k) % 3 == 0 else [pytest.mark.long])
        for i, outline in enumerate(OUTLINES)
        for k, (lift, angle) in enumerate([(0.2, 0.0), (0.0, 23.0), (0.2, 200.0)])
    ],
)
def test_a_notch_keeps_every_check(outline, lift, angle, tmp_path):
    moulds = of_spec(load(written(tmp_path, outline, lift, angle)))
    assert broken(moulds) == set()
    assert moulds.plan.dimensions.core_height == mm(2.11 + lift)  # no film up to the top counts
    core = moulds.solids["base"].trim_by_plane((0, 0, 1), 1 / 64)  # over the plate
    assert len(core.decompose()) == 1
    assert core.volume() > 2.09 * math.pi * 4**2  # the cavity, and the notch
    if outline != "cone":
        # A film, or a crack inside, has surface and no volume.
        assert core.surface_area() == pytest.approx(upright_surface(core), abs=0.05)


@pytest.mark.long
@pytest.mark.parametrize("outline", OUTLINES)
def test_occt_draws_the_same_tools(outline, tmp_path):
    occt = pytest.importorskip("unitcad.kernels.occt", exc_type=UnitcadError)
    spec = load(written(tmp_path, outline))
    for tool in complement(spec, cast_layers(spec)).tools:
        (solid,) = occt.solids([tool.shape])
        occt.confirm(tool.shape, solid)


def test_a_notched_disc_is_built_whole(tmp_path):
    pytest.importorskip("unitcad.kernels.occt", exc_type=UnitcadError)
    done = build(
        load(written(tmp_path, "disc"), {"output.formats": ["stl", "step"]}), tmp_path / "out", only=("unit", "moulds")
    )
    assert done.ok
    assert done.manifest["check"]["errors"] == 0
