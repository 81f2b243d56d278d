"""What is unwise in a spec and not refused: one sentence each."""

from __future__ import annotations

from unitcad import catalogue
from unitcad.designs import design_of
from unitcad.designs.limits import EPS
from unitcad.spec import Spec

CIRCUIT_STOCK = (0.05, 0.5)
"""Usual finished thickness of a flexible circuit, mm."""


def warnings(spec: Spec) -> list[str]:
    """Return the warnings of a spec: layers thinner than their silicone's casting floor, leads, play, the design's."""
    return [*_thin_layers(spec), *_leads(spec), *_circuit_stock(spec), *_play(spec), *_design(spec)]


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
    if spec.fpcb or spec.wires or not design_of(spec).caps:
        return []
    return ["no way out for the motor's leads: they lie between unit and skin; add a table [wires] or [fpcb]"]


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
