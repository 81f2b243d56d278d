"""Unit and moulds as an assembly of the CAD libraries, and their mass, against kernels that share no code with them."""

import itertools

import numpy as np
import pytest

import unitcad
from unitcad.errors import WrongArgument
from unitcad.kernels.mesh import realise
from unitcad.pipeline.assembly import assembly

STATES = [{}, {"exploded": True}, {"step": 1}, {"step": 2}]


@pytest.fixture(scope="module")
def variant():
    return unitcad.Variant.of("encapsulating", "output.tolerance_mm=0.02")


@pytest.mark.parametrize("name", ["encapsulating", "embedded", "no-fpcb"])
def test_no_two_bodies_of_a_state_share_volume(name):
    made = unitcad.Variant.of(name, "output.tolerance_mm=0.05")
    for state in STATES:
        unit, moulds = assembly(made, **state)
        assert (unit.name, moulds.name) == ("unit", "moulds")
        bodies = [(body.name, realise(body.shape, made.segments)) for body in (*unit.bodies, *moulds.bodies)]
        for (one, a), (other, b) in itertools.combinations(bodies, 2):
            assert (a ^ b).volume() < 1e-9, (state, one, other)
    # As drawn, all in one place, they do: the cups, and motor and base.
    drawn = {name: made.mesh(name) for name in ("cup1", "cup2", "base", "motor")}
    assert (drawn["cup1"] ^ drawn["cup2"]).volume() > 100
    assert (drawn["motor"] ^ drawn["base"]).volume() > 10


def test_a_pour_has_its_tools_and_silicone_and_no_other(variant):
    for step in variant.plan.steps:
        unit, moulds = assembly(variant, step=step.index)
        assert tuple(body.name for body in moulds.bodies) == step.tools
        assert [body.name for body in unit.bodies] == [f"layer{i}" for i in range(1, step.index + 1)]
    every = {body.name for body in assembly(variant)[1].bodies}
    assert every == {tool.name for tool in variant.plan.tools}


@pytest.mark.parametrize(("given", "words"), [
    ({"step": 3}, "step = 3: takes the number of a pour, 1 to 2; nearest accepted: 2"),
    ({"step": "1"}, "step = '1': takes the number of a pour"),
    ({"step": 1, "exploded": True}, "exploded = true: shows no pour"),
])  # fmt: skip
def test_a_state_that_there_is_not_is_refused(variant, given, words):
    with pytest.raises(WrongArgument) as refused:
        assembly(variant, **given)
    assert str(refused.value).startswith(words)


def test_mass_is_that_of_the_kernel_and_of_the_formulas(variant):
    """The B-rep kernel's volume integrals over curved faces, and a cylinder's formula; meshes have facets of 0.02 mm."""
    pytest.importorskip("OCP")
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    from unitcad.kernels import occt

    whole = variant.mass_properties()
    densities = {"layer1": 1.04e-3, "layer2": 1.08e-3}
    solids = occt.solids(body.shape for body in variant.unit)
    total, moment, about_origin = 0.0, np.zeros(3), np.zeros((3, 3))
    for body, solid in zip(variant.unit, solids, strict=True):
        exact = GProp_GProps()
        BRepGProp.VolumeProperties_s(solid, exact)
        one = whole.parts[body.name]
        density = densities.get(body.name, one.mass_g / one.volume_mm3)
        at, matrix = exact.CentreOfMass(), exact.MatrixOfInertia()
        centre = np.array([at.X(), at.Y(), at.Z()])
        inertia = density * np.array([[matrix.Value(i, j) for j in (1, 2, 3)] for i in (1, 2, 3)])
        mass = density * exact.Mass()
        assert one.mass_g == pytest.approx(mass, rel=2e-3)
        assert one.centre_mm == pytest.approx(centre, abs=2e-2)
        assert one.inertia_g_mm2 == pytest.approx(inertia, rel=1e-2, abs=1e-3 * np.trace(inertia))
        total += mass
        moment += mass * centre
        about_origin += inertia + mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    middle = moment / total
    about_middle = about_origin - total * (middle @ middle * np.eye(3) - np.outer(middle, middle))
    assert whole.mass_g == pytest.approx(total, rel=1e-3)
    assert whole.centre_mm == pytest.approx(middle, abs=1e-2)
    assert whole.inertia_g_mm2 == pytest.approx(about_middle, rel=1e-2, abs=1e-3 * np.trace(about_middle))
    motor, r, h = whole.parts["motor"], 3.5, 2.0
    flat, axial = motor.mass_g * (3 * r**2 + h**2) / 12, motor.mass_g * r**2 / 2
    assert np.diag(motor.inertia_g_mm2) == pytest.approx([flat, flat, axial], rel=2e-3)
    assert "assumed" in motor.density_source


def test_a_denser_silicone_weighs_more_and_a_known_motor_weighs_what_its_entry_says():
    entry = {"like": "ecoflex-00-10", "density_g_cm3": 2.08}
    plain = unitcad.Variant.of("embedded").mass_properties()
    double = unitcad.Variant(
        unitcad.load("embedded", set={"materials": {"heavy": entry}, "layers.0.material": "heavy"})
    ).mass_properties()
    assert double.parts["layer1"].mass_g == pytest.approx(2 * plain.parts["layer1"].mass_g)
    assert double.mass_g == pytest.approx(plain.mass_g + plain.parts["layer1"].mass_g)


@pytest.mark.parametrize("library", ["build123d", "cadquery"])
def test_the_libraries_get_two_named_children_with_coloured_bodies(library, variant):
    pytest.importorskip(library)
    made = variant.to_build123d(step=1) if library == "build123d" else variant.to_cadquery(step=1)
    name = "label" if library == "build123d" else "name"
    groups = {getattr(group, name): group.children for group in made.children}
    assert getattr(made, name) == "encapsulating"
    assert {group: [getattr(body, name) for body in bodies] for group, bodies in groups.items()} == {
        "unit": ["layer1"], "moulds": ["base", "cup1", "tongue", "filament"],
    }  # fmt: skip
    assert all(body.color for bodies in groups.values() for body in bodies)
    if library == "build123d":
        volumes = [body.volume for bodies in groups.values() for body in bodies]
        parts = [realise(body.shape, 720) for group in assembly(variant, step=1) for body in group.bodies]
        assert volumes == pytest.approx([part.volume() for part in parts], rel=2e-3)
