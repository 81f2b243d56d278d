"""What is unwise in a spec and not refused: one sentence each."""

from __future__ import annotations

import math

from unitcad import catalogue
from unitcad.designs import design_of
from unitcad.designs.limits import EPS
from unitcad.spec import Spec, motor_of
from unitcad.spec.custom_code import is_body_file
from unitcad.text import number

CIRCUIT_STOCK = (0.05, 0.5)
"""Usual finished thickness of a flexible circuit, mm."""
MOST_RING_MM = 2.0
"""Of the ring of air round a motor: twice that of the measured units."""
GRAVITY, MOTOR_G_CM3 = 9.80665, 5.0
"""Density of a motor whose mass no one states (assumed: coin motors have 4 to 6.5)."""


def warnings(spec: Spec, estimate: bool = True) -> list[str]:
    """Return the warnings of a spec: layers thinner than their silicone's casting floor, leads, play, the design's.

    Without `estimate` those are left out that concern only the estimate.
    """
    leads = [*_leads(spec), *_roof(spec), *(_not_estimated(spec) if estimate else ()), *_circuit_stock(spec)]
    return [*_thin_layers(spec), *leads, *_play(spec), *_design(spec)]


def _thin_layers(spec: Spec) -> list[str]:
    known = catalogue.materials(spec.materials)
    sentences = []
    for i, layer in enumerate(spec.layers):
        floor = float(known[layer.material].casting_floor_mm)
        sentences += [
            f"layers.{i}.{field} = {value:g} mm is below the casting floor of {layer.material}, about {floor:g} mm"
            for field, value in (("wall_mm", layer.wall_mm), ("cap_mm", layer.cap_mm))
            if 0 < value < floor - EPS
        ]
    return sentences


def _leads(spec: Spec) -> list[str]:
    drawn = is_body_file(spec.design)
    if spec.fpcb or spec.wires or spec.motor.absent or not (design_of(spec).caps or drawn):
        return []
    offer = "draw a notch for them" if drawn else "add a table [wires] with diameter_mm, or [fpcb]"
    return [f"no way out for the motor's leads: they lie between unit and skin; {offer}"]


def _not_estimated(spec: Spec) -> list[str]:
    """Say that no measured unit has the features that the estimate does not read."""
    found = {"motor.lip_mm": ("a lip", spec.motor.lip_mm), "skin_mm": ("a closed skin side", spec.skin_mm)}
    without = "; the estimate is that of the unit without it"
    return [f"{key} = {mm:g} mm: no measured unit has {what}{without}" for key, (what, mm) in found.items() if mm]


def _roof(spec: Spec) -> list[str]:
    """Warn of a roof that spans too much air, and of too wide a ring of it round the motor."""
    if not design_of(spec).caps or spec.motor.fill or spec.motor.absent:
        return []
    dims, close, found = design_of(spec).dimensions(spec), "motor.fill = true closes the ring", list[str]()
    sag, hertz = roof(spec)
    if hertz < spec.estimate.frequency_hz:
        spans = f"caps of {sum(layer.cap_mm for layer in spec.layers):g} mm span {2 * dims.cavity_radius:g} mm of air"
        tuned = f"the motor on them resonates near {number(hertz, 2)} Hz, below its {spec.estimate.frequency_hz:g} Hz"
        found.append(f"{spans} and sag by {number(sag, 2)} mm; {tuned} (computed); {close}")
    if dims.air_ring > MOST_RING_MM:
        limit = f"{MOST_RING_MM:g} mm is twice that of any measured unit"
        found.append(
            f"the motor hangs in a ring of air of {dims.air_ring:g} mm; {limit}; {close}, thicker walls narrow it"
        )
    return found


def roof(spec: Spec) -> tuple[float, float]:
    """Return how far a unit's caps sag (mm), and the resonance of the motor that hangs on them (Hz).

    A laminated plate is clamped at the cavity's wall. Its own weight and a stiff disc of the motor's size pull it down.
    Source: Timoshenko and Woinowsky-Krieger, Theory of Plates and Shells, 1959, chapter 3. Moduli are static.
    """
    dims, known = design_of(spec).dimensions(spec), catalogue.materials(spec.materials)
    silicones = [known[layer.material] for layer in spec.layers]
    thick = [layer.cap_mm / 1000 for layer in spec.layers]
    stiff = [
        1000 * float(each.quasistatic_modulus_kpa or each.modulus_100pct_kpa) / (1 - float(each.poisson_ratio) ** 2)
        for each in silicones
    ]
    middles = [sum(thick[:i]) + thick[i] / 2 for i in range(len(thick))]
    plies = list(zip(stiff, thick, middles, strict=True))
    neutral = sum(e * t * z for e, t, z in plies) / sum(e * t for e, t, _ in plies)
    rigidity = sum(e * (t**3 / 12 + t * (z - neutral) ** 2) for e, t, z in plies)
    pressure = GRAVITY * sum(1000 * float(each.density_g_cm3) * t for each, t in zip(silicones, thick, strict=True))
    motor = motor_of(spec)
    can = math.pi * dims.motor_radius**2 * spec.motor.thickness_mm / 1000
    kg = float(motor.mass_g if motor and motor.mass_g else MOTOR_G_CM3 * can) / 1000
    span, share = dims.cavity_radius / 1000, dims.motor_radius / dims.cavity_radius
    hung = 1 - share**2 - 4 * (share * math.log(share)) ** 2 / (1 - share**2)
    stiffness = 16 * math.pi * rigidity / (span**2 * hung)
    sag = GRAVITY * kg / stiffness + pressure * span**4 / (64 * rigidity)
    return 1000 * sag, math.sqrt(stiffness / kg) / math.tau


def _circuit_stock(spec: Spec) -> list[str]:
    low, high = CIRCUIT_STOCK
    if not spec.fpcb or low <= spec.fpcb.thickness_mm <= high:
        return []
    return [f"fpcb.thickness_mm = {spec.fpcb.thickness_mm:g} mm: flexible circuits are {low:g} to {high:g} mm thick"]


def _play(spec: Spec) -> list[str]:
    play, thinnest = spec.moulds.plinth_clearance_mm, min(layer.wall_mm for layer in spec.layers)
    if spec.moulds.rib_interference_mm or (2 if len(spec.layers) > 1 else 1) * play <= thinnest / 2:
        return []
    return [f"moulds.plinth_clearance_mm = {play:g} mm lets cups move by more than half of a wall of {thinnest:g} mm"]


def _design(spec: Spec) -> list[str]:
    design = design_of(spec)
    return design.advice(spec, design.dimensions(spec))
