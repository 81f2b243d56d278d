"""From a spec to an attenuation estimate: the catalogue's values, with their ranges, into the estimate's own inputs."""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache
from typing import Any

from msgspec.structs import replace

from unitcad.attenuation.edge.answer import Answer, answer
from unitcad.attenuation.edge.contrast import place_of
from unitcad.attenuation.edge.estimates import Layered, estimate, rounded_layered
from unitcad.attenuation.edge.measured import merge_layers
from unitcad.attenuation.edge.ranges import LabFit
from unitcad.attenuation.inputs import (
    EstimateInput,
    Feature,
    Geometry,
    LayerShape,
    Pad,
    Quantity,
    SiliconeLayer,
    TissueLayer,
    tissue_medium,
)
from unitcad.attenuation.layered import FractionalKelvinVoigt, UniformDisc
from unitcad.catalogue import Material, Motor, Tissue, Value, choose, materials, measurements, motors, tissue
from unitcad.designs import design_of, dimensions
from unitcad.errors import Refusal
from unitcad.json_text import rounded
from unitcad.spec import Spec
from unitcad.spec.custom_code import is_custom
from unitcad.validation.defaults import lab_fit

_MOTOR_DENSITY = (4000.0, 5000.0, 6500.0)  # kg/m3: low, value, high
FEM = "fem"
"""The model by finite elements: a range, costly, and only made when it is asked for."""


def estimate_spec(
    spec: Spec,
    models: Sequence[str] | None = None,
    frequency_hz: float | None = None,
    layered: Layered = rounded_layered,
    say: Callable[[str], None] = lambda line: None,
) -> dict[str, Any]:
    """Return the estimate of a spec as JSON-ready data (`attenuation.edge.estimates`); same spec, same data.

    The model `fem` is a range for each drive and reading, under the key "fem"; it costs seconds and needs scikit-fem.
    `say` gets the progress.

    Raises `Refusal` if no frequency is known, for an unknown material or tissue, and for values no tissue has.
    """
    variant, asked = estimate_input(spec, frequency_hz), tuple(models or spec.estimate.models)
    data = estimate(variant, closed_forms(asked), layered, fit_of(spec))
    if "fit" in data:
        sha256 = hashlib.sha256((spec.estimate.fit_source or "").encode()).hexdigest()
        data["fit"] = {"file": spec.estimate.fit, "sha256": sha256, **data["fit"]}
    if FEM in asked:
        from unitcad.attenuation.fem.unit import fem_sensitivities, range_block

        block = range_block(variant, say=say)
        data[FEM] = rounded({**block, "sensitivities": fem_sensitivities(variant, say)})
    return data


def answer_spec(spec: Spec, frequency_hz: float | None = None) -> Answer:
    """Return the answer of a spec's estimate, without models, skin and scores. Raises `Refusal` as `estimate_spec`."""
    return answer(estimate_input(spec, frequency_hz), fit_of(spec))


def fit_of(spec: Spec) -> LabFit | None:
    """Return the lab's fit that a spec names."""
    return None if spec.estimate.fit_source is None else lab_fit(spec.estimate.fit_source)


def closed_forms(models: Sequence[str]) -> tuple[str, ...]:
    """Return the models of a list that are formulas: all but `fem`."""
    return tuple(model for model in models if model != FEM)


def estimate_input(spec: Spec, frequency_hz: float | None = None) -> EstimateInput:
    """Return a spec's unit on its tissue, in SI, neighbouring layers of one silicone as one layer.

    `frequency_hz` overrides the spec's and the motor's.
    """
    return merge_layers(drawn_input(spec, frequency_hz))


def drawn_input(spec: Spec, frequency_hz: float | None = None) -> EstimateInput:
    """Return the same with the spec's layers as they are."""
    known = motors(spec.motors)
    motor = choose("motor.part", spec.motor.part, known) if spec.motor.part else None
    asked = spec.estimate.frequency_hz if frequency_hz is None else frequency_hz
    frequency = Quantity(asked)
    if motor and motor.frequency_hz and frequency_hz is None and asked == float(motor.frequency_hz):
        frequency = _quantity(motor.frequency_hz)  # the motor's own value: keep its range
    silicones = materials(spec.materials)
    below = tuple(tissue_layer(layer) for layer in tissue(spec.estimate.tissue, spec.tissue))
    return EstimateInput(
        name=spec.name,
        design=spec.design,
        passes=design_of(spec).passes or math.nan,
        diameter=spec.diameter_mm * 1e-3,
        geometry=_geometry(spec, motor_mass(spec, motor)),
        layers=tuple(
            silicone_layer(
                choose(f"layers.{i}.material", layer.material, silicones),
                layer.wall_mm * 1e-3,
                frequency,
                spec.estimate.moduli == "quasi-static",
            )
            for i, layer in enumerate(spec.layers)
        ),
        tissue_name=spec.estimate.tissue,
        tissue=below,
        frequency=frequency,
        amplitude=spec.estimate.amplitude_um * 1e-6,
        drive=spec.motor.drive,
        moduli=spec.estimate.moduli,
        features=tuple(_features(spec, below)),
    )


def _features(spec: Spec, layers: tuple[TissueLayer, ...]) -> Iterator[Feature]:
    """Yield the features of a spec that no measured unit had and no model reads."""
    if is_custom(spec.design):
        yield Feature("shape of its own")
    if spec.motor.drive != "flat":
        yield Feature("axial drive")
    if softer := _other_tissue(layers, spec.diameter_mm * 1e-3, spec.motor.diameter_mm * 1e-3):
        yield Feature("tissue", softer)
    if spec.skin_mm:
        yield Feature("film on the skin side", spec.skin_mm)
    if spec.motor.fill:
        yield Feature("silicone round the motor")
    if spec.motor.lip_mm:
        yield Feature("lip", spec.motor.lip_mm)
    if spec.moulds.draft_deg:
        yield Feature("draft", spec.moulds.draft_deg)
    if spec.fpcb is None:
        yield Feature("wires in place of a circuit" if spec.wires else "missing circuit")


@lru_cache(maxsize=64)
def _other_tissue(layers: tuple[TissueLayer, ...], diameter: float, motor: float) -> float:
    """Return |ln| of a tissue's compliance at a unit's edge over that of the tissue that stands for the phantom.

    An error beyond rtol, if the solver does not reach it, is added.
    """
    usual = tuple(map(tissue_layer, tissue(measurements().unit.tissue)))
    if layers == usual:
        return 0.0
    moved = [
        tissue_medium(one).response(
            UniformDisc(motor / 2.0), 2.0 * math.pi * measurements().unit.frequency_hz, [diameter / 2.0], rtol=1e-3
        )
        for one in (layers, usual)
    ]
    here, there = (abs(one.u_z[0]) for one in moved)
    beyond = sum(max(one.error_z[0] / max(abs(one.u_z[0]), 1e-300) - one.rtol, 0.0) for one in moved if not one.reached)
    return abs(math.log(max(here, 1e-300) / there)) + float(beyond)


def _geometry(spec: Spec, motor_mass: Quantity) -> Geometry:
    # The estimate knows neither a lip nor draft.
    plain = replace(spec, motor=replace(spec.motor, lip_mm=0.0), moulds=replace(spec.moulds, draft_deg=0.0))
    dims = dimensions(plain)
    radius, height = dims.motor_radius * 1e-3, dims.motor_height * 1e-3
    tops = zip(dims.radii, dims.heights, spec.layers, strict=True)
    return Geometry(
        cavity_radius=dims.cavity_radius * 1e-3,
        core_height=dims.core_height * 1e-3,
        layers=tuple(LayerShape(r * 1e-3, top * 1e-3, (layer.cap_mm or 0.0) * 1e-3) for r, top, layer in tops),
        motor_radius=radius,
        motor_height=height,
        motor_mass=motor_mass,
        pad=Pad(dims.pad.radius * 1e-3, dims.pad.low * 1e-3, dims.pad.high * 1e-3) if dims.pad else None,
    )


def motor_mass(spec: Spec, motor: Motor | None) -> Quantity:
    """Return the motor's mass in kg: its entry's, or that of a can of its size."""
    if motor and motor.mass_g:
        return _quantity(motor.mass_g, 1e-3)
    volume = math.pi * (spec.motor.diameter_mm * 0.5e-3) ** 2 * spec.motor.thickness_mm * 1e-3
    low, mass, high = (density * volume for density in _MOTOR_DENSITY)
    return Quantity(mass, low, high, "assumed: the can's volume times 4 to 6.5 g/cm3")


def _quantity(value: Value, factor: float = 1.0) -> Quantity:
    low, high = (None if end is None else end * factor for end in (value.low, value.high))
    return Quantity(float(value) * factor, low, high)


def silicone_layer(material: Material, wall: float, frequency: Quantity, slow: bool) -> SiliconeLayer:
    """Return a layer of a silicone, its wall in m, at a frequency in Hz; `slow`: by its quasi-static modulus."""
    place = place_of(material)
    return SiliconeLayer(
        material=material.name,
        thickness=wall,
        density=float(material.density_g_cm3) * 1e3,
        youngs_modulus=_quasistatic(material) if slow else _youngs_modulus(material, frequency),
        poisson_ratio=_quantity(material.poisson_ratio),
        tan_delta=_quantity(material.loss_factor),
        place=place.at,
        doubt=place.doubt,
        other=(material.like or material.name) not in materials(),
    )


def _youngs_modulus(material: Material, frequency: Quantity) -> Quantity:
    """Return the catalogue's small-strain modulus in Pa, or a fractional law's range, static to dynamic, or none."""
    if material.youngs_modulus_kpa:
        return _quantity(material.youngs_modulus_kpa, 1e3)
    mu0, tau, n = material.fractional_mu0_kpa, material.fractional_tau_us, material.fractional_n
    if not (mu0 and tau and n):
        return Quantity(None, note=_no_modulus(material))
    static = float(mu0) * 1e3 * 2.0 * (1.0 + float(material.poisson_ratio))
    law = FractionalKelvinVoigt(float(tau) * 1e-6, float(n))
    dynamic = abs(law.complex_shear(static, 2.0 * math.pi * frequency.ends[1]))
    note = (
        f"{_no_modulus(material)}; range from a fractional Kelvin-Voigt law, static to {frequency.ends[1]:g} Hz "
        f"({mu0.source})"
    )
    return Quantity(None, static, dynamic, note)


def _quasistatic(material: Material) -> Quantity:
    """Return the modulus of a slow pull in Pa, with its source; unknown if nobody pulled the silicone."""
    value = material.quasistatic_modulus_kpa
    if value is None:
        return Quantity(None, note="no quasistatic_modulus_kpa is known, which estimate.moduli asks for")
    how = f" ({value.method})" if value.method else ""
    return replace(_quantity(value, 1e3), note=f"quasi-static{how}; {value.source}")


def _no_modulus(material: Material) -> str:
    static = material.modulus_100pct_kpa
    if static is None:
        return "no small-strain modulus at the motor's frequency is known, nor a static one"
    whose = "the data sheet's 100 % modulus" if static.status == "datasheet" else "the 100 % modulus"
    source = "" if static.status == "datasheet" else f"; {static.status}: {static.source}"
    return (
        f"no small-strain modulus at the motor's frequency is known; {whose} is static ({float(static):g} kPa{source})"
    )


def tissue_layer(layer: Tissue) -> TissueLayer:
    """Return a tissue's layer in SI. Raises `Refusal` for one without a modulus."""
    nu = float(layer.poisson_ratio)
    if layer.shear_modulus_kpa:
        shear = _quantity(layer.shear_modulus_kpa, 1e3)
    elif layer.youngs_modulus_kpa:
        shear = _quantity(layer.youngs_modulus_kpa, 1e3 / (2.0 * (1.0 + nu)))
    else:
        raise Refusal(f"tissue.{layer.name}", layer.name, "lacks youngs_modulus_kpa or shear_modulus_kpa")
    if layer.viscosity_pa_s:
        law, damping = "kelvin_voigt", _quantity(layer.viscosity_pa_s)
    elif layer.loss_factor:
        law, damping = "loss_factor", _quantity(layer.loss_factor)
    else:
        law, damping = None, Quantity(0.0)
    return TissueLayer(
        name=layer.name,
        thickness=_quantity(layer.thickness_mm, 1e-3) if layer.thickness_mm else None,
        density=float(layer.density_kg_m3),
        shear_modulus=shear,
        poisson_ratio=nu,
        damping_law=law,
        damping=damping,
    )
