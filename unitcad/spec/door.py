"""The checks at the door: defaults written out, and everything refused that no kernel would notice.

Each refusal names the field, its value, the limit and the nearest accepted value: that value, put in, meets this limit.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from msgspec import structs

from unitcad import catalogue
from unitcad.errors import Refusal, unknown_name
from unitcad.spec.dimensions import MOTOR_CLEARANCE, WIRE_GAP, Dimensions, dimensions
from unitcad.spec.models import LEAST_TAIL, Spec
from unitcad.spec.own import is_own
from unitcad.spec.strain import allowed_strain, tail_strain, widest_tail_end

DESIGNS = ("embedded", "encapsulating")
TAIL_SHARE = 0.7
"""Half the tail's width over the core's radius, at most: beyond it the ledge has no shoulders."""
LEDGE_SHARE = 0.95
"""Half the notch's width over the ledge's radius, at most: beyond it the tongue's round tip has prongs."""
SLOT_CLEARANCE = 0.2
"""Least height of the slot over the circuit's thickness, or a wire's on each side of it, mm."""
UNKNOWN_MOTOR = {"frequency_hz": 125.0, "amplitude_um": 300.0}
"""What is assumed of a motor whose entry does not say: the paper's motor."""
CIRCUIT_STOCK = (0.05, 0.5)
"""Usual finished thickness of a flexible circuit, mm."""
_EPS = 1e-9


def checked(spec: Spec) -> Spec:
    """The effective spec, or a Refusal for the first thing that can't be."""
    if is_own(spec.design):
        return _checked_own(spec)
    if spec.design not in DESIGNS:
        raise unknown_name("design", spec.design, DESIGNS)
    for field in ("parameters", "design_source"):
        if getattr(spec, field):
            raise Refusal(field, "...", f"only a design of one's own takes it; {spec.design} does not")
    spec = _with_defaults(spec)
    dims = dimensions(spec)
    _check_layers(spec)
    _check_motor(spec, dims)
    if spec.fpcb:
        _check_circuit(spec, dims)
    if spec.wires:
        _check_wires(spec, dims)
    if dims.slot_z:
        _check_exit(spec, dims)
    _check_tooling(spec, dims)
    return spec


def _checked_own(spec: Spec) -> Spec:
    """A spec whose shapes a function of its own draws: what that function makes of its lengths is not for us to say."""
    if spec.design_source is None:
        raise Refusal("design_source", None, f"is required with design = {spec.design!r}")
    return _with_defaults(spec)


def warnings(spec: Spec) -> list[str]:
    """What is unwise but not refused: layers thinner than their silicone's casting floor, the ring of air."""
    found = []
    known = catalogue.materials(spec.materials)
    for i, layer in enumerate(spec.layers):
        floor = float(known[layer.material].casting_floor_mm)
        for field in ("wall_mm", "cap_mm"):
            value = getattr(layer, field)
            if value is not None and value < floor - _EPS:
                found.append(
                    f"layers.{i}.{field} = {value:g} mm is below the casting floor of {layer.material}, "
                    f"about {floor:g} mm"
                )
    if spec.fpcb and not CIRCUIT_STOCK[0] <= spec.fpcb.thickness_mm <= CIRCUIT_STOCK[1]:
        low, high = CIRCUIT_STOCK
        found.append(
            f"fpcb.thickness_mm = {spec.fpcb.thickness_mm:g} mm: flexible circuits are {low:g} to {high:g} mm thick"
        )
    play = spec.moulds.plinth_clearance_mm or 0.0
    thinnest = min(layer.wall_mm for layer in spec.layers)
    if (2 if len(spec.layers) > 1 else 1) * play > thinnest / 2:
        found.append(
            f"moulds.plinth_clearance_mm = {play:g} mm lets cups move by more than half of a wall of {thinnest:g} mm"
        )
    if spec.design == "embedded" and not spec.fpcb and not spec.motor.fill:
        found.append(
            "motor.fill = false: without a circuit's pad nothing holds the motor in an embedded unit; fill the ring of "
            "air round it, or set motor.fill = true"
        )
    dims = dimensions(spec)
    if (
        spec.design == "encapsulating"
        and dims.pad_radius
        and dims.pad_radius > dims.cavity_radius - MOTOR_CLEARANCE + _EPS
    ):
        found.append(
            f"fpcb.pad_diameter_mm = {2 * dims.pad_radius:g} mm leaves no clearance in the cavity "
            f"of {2 * dims.cavity_radius:g} mm"
        )
    return found


def printer_of(spec: Spec) -> catalogue.Printer:
    """The catalogue's printer with what the spec's moulds override."""
    printer = catalogue.printers(spec.printers)[spec.moulds.printer]
    own = {
        name: catalogue.Value(value, "spec", "moulds")
        for name, value in structs.asdict(spec.moulds).items()
        if hasattr(printer, name) and value is not None and float(getattr(printer, name)) != value
    }
    return structs.replace(printer, **own)


def _with_defaults(spec: Spec) -> Spec:
    """Every default written out: motor sizes, pad, mould values from the printer, frequency and amplitude."""
    motor = spec.motor
    catalogue_motor, motors = None, catalogue.motors(spec.motors)
    if motor.part is not None:
        catalogue_motor = catalogue.choose("motor.part", motor.part, motors)
        motor = structs.replace(
            motor,
            diameter_mm=motor.diameter_mm or float(catalogue_motor.diameter_mm),
            thickness_mm=motor.thickness_mm or float(catalogue_motor.thickness_mm),
        )
    for field in ("diameter_mm", "thickness_mm"):
        if getattr(motor, field) is None:
            raise Refusal(f"motor.{field}", None, "is required where no part is named")
    known = catalogue.materials(spec.materials)
    for i, layer in enumerate(spec.layers):
        catalogue.choose(f"layers.{i}.material", layer.material, known)
    printer = catalogue.choose("moulds.printer", spec.moulds.printer, catalogue.printers(spec.printers))
    filled = {
        name: float(getattr(printer, name))
        for name, value in structs.asdict(spec.moulds).items()
        if value is None and hasattr(printer, name)
    }
    if spec.moulds.slot_height_mm is None:
        filled["slot_height_mm"] = max(filled["slot_height_mm"], _least_slot(spec))
    moulds = structs.replace(spec.moulds, **filled)
    fpcb = spec.fpcb
    if fpcb and fpcb.pad_diameter_mm is None:
        inner = spec.diameter_mm / 2 - sum(layer.wall_mm for layer in spec.layers)
        cavity = (motor.diameter_mm or 0.0) / 2 if motor.fill else inner
        radius = (
            spec.diameter_mm / 2 - min(0.5, spec.layers[-1].wall_mm / 2) if spec.design == "embedded" else cavity - 0.3
        )
        if radius > 0:
            fpcb = structs.replace(fpcb, pad_diameter_mm=round(2 * radius, 9))
    unknown = dict(UNKNOWN_MOTOR)
    if catalogue_motor and catalogue_motor.rpm:
        unknown["frequency_hz"] = round(float(catalogue_motor.rpm) / 60, 3)
    motor_values = {
        field: getattr(spec.estimate, field) or float(getattr(catalogue_motor, field, None) or default)
        for field, default in unknown.items()
    }
    estimate = structs.replace(spec.estimate, **motor_values)
    for name in (spec.estimate.tissue, *spec.tissue):
        catalogue.tissue(name, spec.tissue)
    return structs.replace(spec, motor=motor, moulds=moulds, fpcb=fpcb, estimate=estimate)


def _check_layers(spec: Spec) -> None:
    for i, layer in enumerate(spec.layers):
        if spec.design == "embedded" and layer.cap_mm is not None:
            raise Refusal(
                f"layers.{i}.cap_mm", layer.cap_mm, "an embedded layer is an open ring and has no cap; leave it out"
            )
        if spec.design == "encapsulating" and layer.cap_mm is None:
            raise Refusal(f"layers.{i}.cap_mm", None, "every encapsulating layer has a cap", layer.wall_mm)


def _check_motor(spec: Spec, dims: Dimensions) -> None:
    clearance = 0.0 if spec.motor.fill else MOTOR_CLEARANCE
    walls = sum(layer.wall_mm for layer in spec.layers)
    least = 2 * (dims.motor_radius + clearance + walls)
    _at_least(
        "diameter_mm",
        spec.diameter_mm,
        least,
        f"the motor ({2 * dims.motor_radius:g}), {clearance:g} of clearance and walls of {walls:g} a side need",
    )


def _check_circuit(spec: Spec, dims: Dimensions) -> None:
    fpcb = spec.fpcb
    assert fpcb is not None
    assert dims.pad_radius is not None
    tail, pad = fpcb.tail_width_mm, fpcb.pad_diameter_mm or 0.0
    if spec.design == "embedded":
        _at_most("fpcb.pad_diameter_mm", pad, spec.diameter_mm, "the pad stays on the body, whose diameter is")
        outermost = 2 * (dims.radii[-2] if len(dims.radii) > 1 else dims.cavity_radius)
        _at_least(
            "fpcb.pad_diameter_mm", pad, outermost + 0.2, "the embedded pad lies on every layer, so it reaches at least"
        )
        _at_most("fpcb.tail_width_mm", tail, pad, "the tail is no wider than the pad, which has")
        return
    widest = widest_exit(spec, dims)
    clearance = spec.moulds.window_clearance_mm or 0.0
    if widest < LEAST_TAIL and clearance > LEAST_TAIL:
        # No tail fits because of the clearance: the clearance is to blame, not the tail.
        most = _down(clearance - (tail - widest) / 2)
        limit = f"the ledge leaves room for a tail of {tail:g} mm up to a clearance of {most:g} mm"
        raise Refusal("moulds.window_clearance_mm", clearance, limit, most if most > 0 else None)
    _at_most(
        "fpcb.tail_width_mm",
        tail,
        widest,
        "half the tail is at most 0.7 of the core's radius and keeps off the ledge's ends, so the tail at most",
    )
    _at_most(
        "fpcb.pad_diameter_mm",
        pad,
        2 * dims.cavity_radius,
        "the encapsulated pad touches Layer 1 only, so it stays in the cavity of",
    )
    _at_least("fpcb.pad_diameter_mm", pad, tail, "the pad is no narrower than the tail, which has")
    if fpcb.tail_end_width_mm is not None:
        _at_least("fpcb.tail_end_width_mm", fpcb.tail_end_width_mm, tail, "the tail's end is no narrower than it,")
        allowed = allowed_strain(spec, catalogue.materials(spec.materials))
        _at_most(
            "fpcb.tail_end_width_mm",
            fpcb.tail_end_width_mm,
            widest_tail_end(spec, allowed),
            f"passing the slot would stretch it by {tail_strain(spec) or 0:.0%}, and the silicone takes "
            f"{allowed:.0%} with its margin: solder the end on after, widen moulds.slot_width_clearance_mm, "
            "or make the end at most",
        )


def widest_exit(spec: Spec, dims: Dimensions) -> float:
    """The widest tail, or bundle of wires, whose ledge keeps its shoulders, mm."""
    moulds = spec.moulds
    beside = (moulds.slot_width_clearance_mm or 0.0) + 2 * (moulds.window_clearance_mm or 0.0)
    return min(2 * TAIL_SHARE * dims.cavity_radius, 2 * LEDGE_SHARE * dims.ledge_radius - beside)


def _check_wires(spec: Spec, dims: Dimensions) -> None:
    wires = spec.wires
    assert wires is not None
    if spec.fpcb:
        raise Refusal("wires", "a table", "wires take the place of a circuit; leave out [fpcb] or [wires]")
    _at_most("wires.diameter_mm", wires.diameter_mm, dims.motor_height / 2, "half the motor's thickness is")
    bundle = wires.count * (wires.diameter_mm + WIRE_GAP) - WIRE_GAP
    widest = widest_exit(spec, dims)
    if bundle > widest + _EPS:
        raise Refusal(
            "wires.diameter_mm",
            wires.diameter_mm,
            f"{wires.count} side by side take {bundle:.4g} mm, and the ledge leaves {widest:.4g} mm",
            _down((widest + WIRE_GAP) / wires.count - WIRE_GAP) if widest > wires.count * WIRE_GAP else None,
        )


def _check_exit(spec: Spec, dims: Dimensions) -> None:
    """The slot's height, and a cup's walls over and under the window that its tongue goes through."""
    moulds = spec.moulds
    assert moulds.slot_height_mm is not None
    assert dims.slot_z is not None
    what = "circuit" if spec.fpcb else "wire"
    _at_least(
        "moulds.slot_height_mm",
        moulds.slot_height_mm,
        _least_slot(spec),
        f"the slot takes the {what} with clearance, so at least",
    )
    wall, clearance = moulds.least_wall_mm or 0.0, moulds.window_clearance_mm or 0.0
    if spec.design == "encapsulating":
        _at_least(
            "layers.0.cap_mm",
            spec.layers[0].cap_mm or 0.0,
            wall + clearance + dims.slot_z[1] - dims.core_height,
            f"with a {'tail' if spec.fpcb else 'wire'}, the cup's wall over the window needs a first cap of at least",
        )
    _at_least(
        "motor.thickness_mm",
        dims.motor_height,
        wall + clearance + dims.motor_height - dims.slot_z[0],
        f"with a {'tail' if spec.fpcb else 'wire'}, the cup's wall under the window needs a motor of at least",
    )


def _least_slot(spec: Spec) -> float:
    """Least height of the slot, mm: wires under a cap have clearance on both sides; 0 where nothing leaves."""
    if spec.wires:
        return spec.wires.diameter_mm + SLOT_CLEARANCE * (2 if spec.design == "encapsulating" else 1)
    return spec.fpcb.thickness_mm + SLOT_CLEARANCE if spec.fpcb else 0.0


def _check_tooling(spec: Spec, dims: Dimensions) -> None:
    moulds = spec.moulds
    printer = catalogue.printers(spec.printers)[moulds.printer]
    wall = moulds.least_wall_mm or 0.0
    feature = float(printer.least_feature_mm)
    _at_least(
        "moulds.least_wall_mm", wall, float(printer.least_wall_mm), f"{moulds.printer} prints no wall thinner than"
    )
    for field in ("skirt_wall_mm", "land_mm", "plate_mm"):
        _at_least(f"moulds.{field}", getattr(moulds, field), wall, "the printer's least wall is")
    for field in ("engraving_stroke_mm", "groove_width_mm", "slot_height_mm"):
        _at_least(f"moulds.{field}", getattr(moulds, field), feature, "the printer's least feature is")
    _check_engraving(spec, dims, printer)
    relief = moulds.seat_relief_mm or 0.0
    _at_most(
        "moulds.seat_relief_mm",
        relief,
        moulds.plinth_height_mm - 0.5,
        "half a millimetre of skirt must stay to centre the cup, so at most",
    )
    if spec.design == "encapsulating":
        hole = moulds.filament_hole_mm or 0.0
        _at_least("moulds.filament_hole_mm", hole, moulds.filament_mm, "the hole takes the filament of")
        _at_least(
            "moulds.plate_mm",
            moulds.plate_mm,
            groove_depth(spec) + wall,
            "the plate holds the filament's groove and a wall over it, so at least",
        )
        inside = dims.ledge_radius if dims.sides else dims.cavity_radius
        if inside < hole / 2 + wall - _EPS:
            more = 2 * (hole / 2 + wall - inside)
            raise Refusal(
                "diameter_mm",
                spec.diameter_mm,
                "the core must hold the filament's hole with a wall round it, and the ledge",
                _up(spec.diameter_mm + more) if not spec.motor.fill else None,
            )


def _check_engraving(spec: Spec, dims: Dimensions, printer: catalogue.Printer) -> None:
    """A floor stays under the lettering on the first cup and on the plate."""
    depth, floor = spec.moulds.engraving_depth_mm or 0.0, float(printer.least_flat_wall_mm)
    if spec.design == "embedded":
        _at_least(
            "motor.thickness_mm",
            dims.motor_height,
            min(depth, float(printer.engraving_depth_mm)) + floor,
            f"the first cup is as high as the motor, and its lettering leaves a floor of {floor:g} from",
        )
    _at_most(
        "moulds.engraving_depth_mm",
        depth,
        min(dims.heights[0], spec.moulds.plate_mm) - floor,
        f"a floor of {floor:g} must stay under the lettering, so at most",
    )


def groove_depth(spec: Spec) -> float:
    """Depth and width of the groove that takes the bent filament under the plate, mm."""
    return spec.moulds.filament_mm + 0.5


def _at_least(field: str, value: float, limit: float, why: str) -> None:
    _bound(field, value, limit, why, value < limit - _EPS, _up)


def _at_most(field: str, value: float, limit: float, why: str) -> None:
    _bound(field, value, limit, why, value > limit + _EPS, _down)


def _bound(field: str, value: float, limit: float, why: str, broken: bool, nearest: Callable[[float], float]) -> None:
    if broken:
        accepted = nearest(limit)
        raise Refusal(field, value, f"{why} {accepted:g} mm", accepted)


def _up(limit: float) -> float:
    """The least typed value (three decimals) that is not below `limit`."""
    return round(math.ceil(limit * 1000 - 1e-6) / 1000, 3)


def _down(limit: float) -> float:
    return round(math.floor(limit * 1000 + 1e-6) / 1000, 3)
