"""What must be true of every unit: no overlap, contact as the design says, closed-form volumes, all within D."""

import math

import pytest
from msgspec.structs import replace

from unitcad.api.variant import Variant
from unitcad.designs.limits import SLOT_CLEARANCE
from unitcad.validation import templates

NAMES = sorted(templates())
ROUND = [name for name in NAMES if Variant.of(name).spec.design in ("embedded", "encapsulating")]


def _solids(variant):
    return {body.name: variant.mesh(body) for body in variant.unit}


def _contact_area(a, b, hair=1 / 1024):
    """Area of the horizontal contact of a over b: what a, let down by a hair, shares with b, over the hair."""
    return (a.translate((0, 0, -hair)) ^ b).volume() / hair


@pytest.mark.parametrize("name", NAMES)
def test_bodies_do_not_overlap_and_fit_the_diameter(name):
    variant = Variant.of(name)
    solids = _solids(variant)
    bodies = list(solids)
    for i, a in enumerate(bodies):
        for b in bodies[i + 1 :]:
            assert (solids[a] ^ solids[b]).volume() < 1e-9, (a, b)
    for body in variant.unit:
        if body.made == "cast":
            box = solids[body.name].bounding_box()
            # The corner of an area-true polygon stands outside its circle by no more than the tolerance.
            radius = variant.spec.diameter_mm / 2 if name in ROUND else variant.plan.dimensions.outer_radius
            assert max(map(abs, (*box[:2], *box[3:5]))) <= radius + variant.spec.output.tolerance_mm
            assert box[2] == 0


@pytest.mark.parametrize("name", ROUND)
def test_layer_volumes_have_their_closed_form(name):
    """Where no slot cuts them: rings, or a cylinder over a smaller one."""
    data = Variant.of(name).spec
    variant = Variant(replace(data, fpcb=None, wires=None))
    dims = variant.dimensions
    radius, height = dims.cavity_radius, dims.core_height
    for body, r, h in zip(variant.unit, dims.radii, dims.heights, strict=False):
        if data.design == "embedded":
            exact = math.pi * (r**2 - radius**2) * h
        else:
            exact = math.pi * (r**2 * h - radius**2 * height)
        # Lengths on the 1/1024 grid: half a step on the radius and on each height.
        bound = 2 * math.pi * r * h / 2048 + math.pi * r**2 / 1024
        assert variant.mesh(body).volume() == pytest.approx(exact, abs=bound)
        radius, height = r, h


@pytest.mark.parametrize("name", [n for n in ROUND if Variant.of(n).spec.fpcb])
def test_the_circuit_touches_what_the_design_says(name):
    variant = Variant.of(name)
    solids = _solids(variant)
    circuit = solids["fpcb"]
    layers = [body.name for body in variant.unit if body.made == "cast"]
    if variant.spec.design == "embedded":
        assert all(_contact_area(circuit, solids[layer]) > 1 for layer in layers)
    else:
        cap = _contact_area(solids[layers[0]], circuit)
        pad = math.pi * (variant.dimensions.pad.radius if variant.dimensions.pad else 0) ** 2
        assert 0.85 * pad < cap <= pad
        for layer in layers[1:]:
            assert _contact_area(solids[layer], circuit) == 0
            # The slot's floor ends a whole layer, so the circuit need not lie in its middle.
            assert circuit.min_gap(solids[layer], 1) >= SLOT_CLEARANCE / 4
    assert _contact_area(circuit, solids["motor"]) == pytest.approx(
        math.pi * variant.dimensions.motor_radius**2, rel=1e-6
    )


def test_fill_closes_the_ring_of_air():
    loose, filled = Variant.of("embedded"), Variant.of("embedded", "motor.fill=true")
    assert loose.dimensions.air_ring == pytest.approx(1.0)
    assert filled.dimensions.air_ring == 0
    gap = _solids(loose)["motor"].min_gap(_solids(loose)["layer1"], 3)
    assert gap == pytest.approx(1.0, abs=0.02)
    shared_wall = _solids(filled)["motor"].min_gap(_solids(filled)["layer1"], 3)
    assert shared_wall == pytest.approx(0, abs=1e-9)
    assert _solids(filled)["layer1"].volume() > _solids(loose)["layer1"].volume()
    # The outer layers stay as they are.
    assert filled.dimensions.radii == loose.dimensions.radii


def test_a_chain_is_symmetric_and_one_tail_is_not():
    chain, one = (
        _solids(Variant.of("pass-through"))["fpcb"].bounding_box(),
        _solids(Variant.of("encapsulating"))["fpcb"].bounding_box(),
    )
    assert chain[0] == -chain[3] == -17
    assert one[3] == 17
    assert one[0] == pytest.approx(-4.2, abs=0.02)
