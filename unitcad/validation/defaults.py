"""From a raw spec to the resolved one: defaults written out, then every limit checked."""

from __future__ import annotations

import math
from importlib.util import find_spec
from typing import Any

from msgspec import structs

from unitcad import catalogue
from unitcad.catalogue.entries import Drive
from unitcad.designs import Design, design_of
from unitcad.designs.limits import check_ribs, least_slot
from unitcad.designs.rib_leaves import farthest_push, leaf_mm, least_skirt
from unitcad.errors import Refusal
from unitcad.spec import Spec
from unitcad.spec.custom_code import is_body_file, is_custom
from unitcad.spec.raw import DEFAULT_MOTOR, Format, RawSpec
from unitcad.spec.resolved import CastLayer, Circuit, Estimate, MotorSize, Moulds, Output
from unitcad.validation.fit_text import check_fit

UNKNOWN_MOTOR = {"frequency_hz": 125.0, "amplitude_um": 300.0}
"""What is assumed of a motor whose entry does not say: the paper's motor."""
UNKNOWN_DRIVE: Drive = "flat"
"""A coin ERM's, as the paper's motor is."""
_BASE = {"plinth_height_mm": 2.0, "plate_mm": 4.0}
"""The base's heights, before they end whole layers, mm; a plinth is higher where the leaves of resin cups need it."""
_PRINTER_LENGTHS = tuple(f for f in Moulds.__struct_fields__ if f in catalogue.Printer.__struct_fields__)


def resolve(raw: RawSpec) -> Spec:
    """Return the resolved spec. Raises Refusal for the first value that is not valid."""
    if is_custom(raw.design):
        if raw.design_source is None:
            raise Refusal("design_source", None, f"is required with design = {raw.design!r}")
        if is_body_file(raw.design) and raw.parameters:
            raise Refusal("parameters", "...", f"nothing reads them: {raw.design} is a file of bodies")
        if raw.skin_mm:
            raise Refusal("skin_mm", raw.skin_mm, "a custom design draws its own skin side", 0.0)
    else:
        for field in ("parameters", "design_source"):
            if getattr(raw, field):
                raise Refusal(field, "...", f"only a custom design takes it; {raw.design} does not")
    design = design_of(raw)
    spec = _with_defaults(raw, design)
    design.limits(spec, design.dimensions(spec))
    check_ribs(spec)
    return spec


def _with_defaults(raw: RawSpec, design: Design) -> Spec:
    part, motor = _motor(raw)
    known = catalogue.materials(raw.materials)
    for i, layer in enumerate(raw.layers):
        catalogue.choose(f"layers.{i}.material", layer.material, known)
    moulds = _moulds(raw, design)
    fpcb = _circuit(raw, design, motor)
    estimate = _estimate(raw, part)
    for name in (raw.estimate.tissue, *raw.tissue):
        catalogue.tissue(name, raw.tissue)
    return Spec.settled(
        name=raw.name,
        design=raw.design,
        diameter_mm=raw.diameter_mm,
        skin_mm=raw.skin_mm,
        motor=motor,
        fpcb=fpcb,
        wires=raw.wires,
        layers=tuple(
            CastLayer(material=layer.material, wall_mm=layer.wall_mm, cap_mm=layer.cap_mm or 0.0)
            for layer in raw.layers
        ),
        moulds=moulds,
        casting=raw.casting,
        estimate=estimate,
        output=Output(formats=_formats(raw), tolerance_mm=raw.output.tolerance_mm),
        materials=raw.materials,
        motors=raw.motors,
        printers=raw.printers,
        tissue=raw.tissue,
        parameters=raw.parameters,
        design_source=raw.design_source,
    )


def _motor(raw: RawSpec) -> tuple[catalogue.Motor | None, MotorSize]:
    """Return the motor's catalogue entry, and its size and drive; what is given beside a part overrides the entry's."""
    if isinstance(raw.motor, bool):
        return None, _no_motor(raw)
    given, part = raw.motor, None
    sizes = {"diameter_mm": given.diameter_mm, "thickness_mm": given.thickness_mm}
    name = DEFAULT_MOTOR if given.part is None and set(sizes.values()) == {None} else given.part
    if name is not None:
        part = catalogue.choose("motor.part", name, catalogue.motors(raw.motors))
        sizes = {field: float(getattr(part, field)) if size is None else size for field, size in sizes.items()}
    for field, size in sizes.items():
        if size is None:
            raise Refusal(f"motor.{field}", None, "is required where no part is named")
    known: dict[str, Any] = {field: size for field, size in sizes.items() if size is not None}
    drive = given.drive or (part.drive.value if part and part.drive else UNKNOWN_DRIVE)
    return part, MotorSize(part=name, drive=drive, fill=given.fill, lip_mm=given.lip_mm, **known)


def _no_motor(raw: RawSpec) -> MotorSize:
    """Return the motor of a spec without one. Raises Refusal if its design or its circuit needs one."""
    if raw.motor:
        raise Refusal("motor", raw.motor, "takes a table, or false for none", False)
    if not is_custom(raw.design):
        raise Refusal("motor", False, f"the design {raw.design} is drawn round one; a custom design may have none")
    for field in ("fpcb", "wires"):
        if getattr(raw, field):
            raise Refusal(field, None, "leads to a motor, and motor = false: leave one of them out")
    entry = catalogue.motors()[DEFAULT_MOTOR]
    diameter, thickness = float(entry.diameter_mm), float(entry.thickness_mm)
    return MotorSize(
        part=None,
        diameter_mm=diameter,
        thickness_mm=thickness,
        drive=UNKNOWN_DRIVE,
        fill=False,
        lip_mm=0.0,
        absent=True,
    )


def _moulds(raw: RawSpec, design: Design) -> Moulds:
    """Return the tooling's lengths: the printer's where the spec gives none, the slot as high as what it takes.

    Heights that the spec does not give end whole layers of the printer.
    """
    printer = catalogue.choose("moulds.printer", raw.moulds.printer, catalogue.printers(raw.printers))
    given = structs.asdict(raw.moulds)
    lengths = {name: float(getattr(printer, name) or 0.0) for name in _PRINTER_LENGTHS if given[name] is None}
    if "slot_height_mm" in lengths:
        least = least_slot(raw.fpcb, raw.wires, design.wire_sides)
        lengths["slot_height_mm"] = max(lengths["slot_height_mm"], least)
    layer = raw.moulds.layer_mm or lengths["layer_mm"]
    lengths |= {name: least for name, least in _BASE.items() if given[name] is None}
    if "plinth_height_mm" in lengths:
        lengths["plinth_height_mm"] = max(lengths["plinth_height_mm"], _for_leaves(printer, {**given, **lengths}))
    if given["shrinkage_percent"] is None:
        known = catalogue.materials(raw.materials)
        lengths["shrinkage_percent"] = max(float(known[one.material].shrinkage_percent or 0.0) for one in raw.layers)
    for name in {"slot_height_mm", *_BASE} & lengths.keys():
        lengths[name] = round(math.ceil(lengths[name] / layer - 1e-6) * layer, 9)
    return Moulds(**{**given, **lengths})


def _for_leaves(printer: catalogue.Printer, lengths: dict[str, Any]) -> float:
    """Return the plinth that leaves of resin need to bend as far as they must, mm; 0 without any."""
    leaf, depth = leaf_mm(printer) and lengths["least_wall_mm"], lengths["rib_interference_mm"]
    if not leaf or not depth:
        return 0.0
    pushed = farthest_push(depth, lengths["xy_play_mm"], lengths["plinth_clearance_mm"])
    return least_skirt(leaf, pushed) + lengths["seat_relief_mm"]


def _circuit(raw: RawSpec, design: Design, motor: MotorSize) -> Circuit | None:
    """Return the circuit with its pad, which the design sizes, and its tail's end, as wide as the tail."""
    fpcb = raw.fpcb
    if fpcb is None:
        return None
    pad = fpcb.pad_diameter_mm
    if pad is None:
        inner = raw.diameter_mm / 2 - sum(layer.wall_mm for layer in raw.layers)
        radius = design.pad_radius(raw, motor.diameter_mm / 2 if motor.fill else inner)
        # Where no pad fits, the limits refuse the diameter; until then it is as large as the motor.
        pad = round(2 * radius, 9) if radius > 0 else motor.diameter_mm
    end = fpcb.tail_width_mm if fpcb.tail_end_width_mm is None else fpcb.tail_end_width_mm
    return Circuit(**{**structs.asdict(fpcb), "pad_diameter_mm": pad, "tail_end_width_mm": end})


def _formats(raw: RawSpec) -> tuple[Format, ...]:
    """Return the formats asked for; by default without STEP where no B-rep kernel is installed."""
    if raw.output.formats is not None:
        return raw.output.formats
    return ("step", "stl", "3mf") if find_spec("OCP") else ("stl", "3mf")


def _estimate(raw: RawSpec, part: catalogue.Motor | None) -> Estimate:
    """Return what the estimate reads: the motor's frequency and amplitude where the spec gives none."""
    unknown = dict(UNKNOWN_MOTOR)
    if part and part.rpm:
        unknown["frequency_hz"] = round(float(part.rpm) / 60, 3)
    values = {
        field: getattr(raw.estimate, field) or float(getattr(part, field, None) or default)
        for field, default in unknown.items()
    }
    chosen = raw.estimate
    if chosen.fit is not None or chosen.fit_source is not None:
        check_fit(chosen)
    return Estimate(
        tissue=chosen.tissue,
        models=chosen.models,
        moduli=chosen.moduli,
        fit=chosen.fit,
        fit_source=chosen.fit_source,
        **values,
    )
