"""Defaults and advice: from a raw spec to the resolved one, every limit checked; advice against the unwise."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import lru_cache
from importlib.util import find_spec
from itertools import pairwise
from typing import TYPE_CHECKING, Any, TypeVar

from msgspec import UNSET, structs

from unitcad import catalogue
from unitcad.catalogue.entries import Drive
from unitcad.designs import Design, design_of
from unitcad.designs.limits import EPS, check_ribs, farthest_push, leaf_mm, least_skirt, least_slot
from unitcad.documents import parse_toml
from unitcad.errors import Refusal, UnitcadError, UnknownKey
from unitcad.rooms import kind_of
from unitcad.spec import MOTOR_SIZES, Spec, convert, motor_of
from unitcad.spec.custom_code import is_body_file, is_custom
from unitcad.spec.layers import Layers
from unitcad.spec.raw import (
    DEFAULT_MOTOR,
    LEAST_LAYER,
    BodyTable,
    EstimateTable,
    FpcbTable,
    MotorTable,
    MouldsTable,
    RawSpec,
    WiresTable,
)
from unitcad.spec.resolved import CastLayer, MotorSize
from unitcad.text import number, with_article

if TYPE_CHECKING:
    from unitcad.attenuation.edge.ranges import LabFit

FIELD = "estimate.fit"
Lead = TypeVar("Lead", FpcbTable, WiresTable)
_NEXT = "name a lab-fit.toml, which `unitcad fit LAB` writes from measured units"
UNKNOWN_MOTOR = {"frequency_hz": 125.0, "amplitude_um": 300.0}
"""What is assumed of a motor whose entry does not say: the paper's motor."""
UNKNOWN_DRIVE: Drive = "flat"
"""A coin ERM's, as the paper's motor is."""
_BASE = {"plinth_height_mm": 2.0, "plate_mm": 4.0}
"""The base's heights, before they end whole layers, mm; a plinth is higher where the leaves of resin cups need it."""
_PRINTER_LENGTHS = tuple(f for f in MouldsTable.__struct_fields__ if f in catalogue.Printer.__struct_fields__)


def resolved(data: Mapping[str, Any]) -> Spec:
    """Return the resolved spec of plain data. Raises Refusal for the first value that is not valid."""
    return resolve(convert(_with_sizes(data), RawSpec))


_OF_BODY = ("design", "design_source", "diameter_mm", "skin_mm", "parameters")
"""Keys that a spec with [body] has no use for."""


def _with_sizes(data: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return data with the sizes that follow from a [body]: design, diameter, and each layer's wall."""
    body, layers = data.get("body"), data.get("layers")
    if not isinstance(body, Mapping):
        return data
    table = convert(body, BodyTable, "body")
    for key in _OF_BODY:
        if data.get(key):
            raise Refusal(key, data[key], "a spec with [body] takes it from the body: leave it out")
    if not isinstance(body.get("file_source"), str):
        raise Refusal("body.file_source", None, "is required beside file")
    from unitcad.designs.offset.layers import size_of  # numpy and manifold3d: most specs do without

    across = size_of(table)[:2]
    sized = {**data, "design": body["file"], "diameter_mm": max(across)}
    if isinstance(layers, list | tuple) and all(isinstance(layer, Mapping) for layer in layers):
        sized["layers"] = [_walled(layers, i, min(across)) for i in range(len(layers))]
    return sized


def _walled(layers: Sequence[Mapping[str, Any]], i: int, across: float) -> dict[str, Any]:
    """Return a layer of a body with its thickness as wall and cap; one without fills the inside."""
    for key in ("wall_mm", "cap_mm"):
        if layers[i].get(key) is not None:
            limit = "a layer of a [body] has thickness_mm in its place; without it the innermost layer fills the body"
            raise Refusal(f"layers.{i}.{key}", layers[i][key], limit)
    thick = layers[i].get("thickness_mm")
    if not isinstance(thick, int | float):
        others = [each.get("thickness_mm") for each in layers]
        taken = sum(float(each) for each in others if isinstance(each, int | float))
        thick = max(round(across / 2 - taken, 3), LEAST_LAYER)
    return {**layers[i], "wall_mm": thick, "cap_mm": thick}


def resolve(raw: RawSpec) -> Spec:
    """Return the resolved spec. Raises Refusal for the first value that is not valid."""
    _check_body_keys(raw)
    if raw.body:
        pass
    elif is_custom(raw.design):
        if raw.design_source is None:
            raise Refusal("design_source", None, f"is required with design = {raw.design!r}")
        if is_body_file(raw.design) and raw.parameters:
            raise Refusal("parameters", None, f"nothing reads them: {raw.design} is a file of bodies")
        if raw.skin_mm:
            raise Refusal("skin_mm", raw.skin_mm, "a custom design draws its own skin side", 0.0)
    else:
        for field in ("parameters", "design_source"):
            if getattr(raw, field):
                raise Refusal(field, None, f"only a custom design takes it; {raw.design} does not")
    if raw.moulds.parting is not UNSET and (raw.body or not is_custom(raw.design) or len(raw.layers) > 1):
        limit = "names the parting of a custom design or a file of bodies with one layer; leave it out"
        raise Refusal("moulds.parting", raw.moulds.parting, limit)
    design = design_of(raw)
    spec = _with_defaults(raw, design)
    if design.tooling == "complement":
        for field, value in (("motor.lip_mm", spec.motor.lip_mm), ("moulds.draft_deg", spec.moulds.draft_deg)):
            if value:
                raise Refusal(field, value, "moulds by complement follow the bodies that a custom design draws", 0.0)
    design.limits(spec, design.dimensions(spec))
    check_ribs(spec)
    return spec


def _check_body_keys(raw: RawSpec) -> None:
    """Raise Refusal for a key of layers by offset in a spec without [body], and for a layer without thickness there."""
    if not raw.body:
        at = raw.motor.at if isinstance(raw.motor, MotorTable) else UNSET
        found = [
            ("motor.at", at),
            *((f"layers.{i}.thickness_mm", one.thickness_mm) for i, one in enumerate(raw.layers)),
        ]
        for field, value in found:
            if value is not UNSET:
                given = list(value) if isinstance(value, tuple) else value
                raise Refusal(field, given, "is for a spec with [body], whose layers are offset from a file")
        return
    inmost = 1 if raw.body.bottom == "floor" else 0
    for i, layer in enumerate(raw.layers):
        if layer.thickness_mm is UNSET and i != inmost:
            limit = "is required: only the innermost layer by offset does without, and fills the body"
            limit = 'is required with bottom = "floor": that of the floor' if inmost > i else limit
            raise Refusal(f"layers.{i}.thickness_mm", None, limit)


def check_fit(table: EstimateTable) -> None:
    """Raise Refusal for a fit that can't be used: no name or no text, damaged, by other moduli than the estimate's."""
    if table.fit is None or table.fit_source is None:
        key = "fit" if table.fit is None else "fit_source"
        raise Refusal(f"estimate.{key}", None, "is required beside the other of fit and fit_source")
    try:
        fit = lab_fit(table.fit_source)
    except Refusal as refusal:
        if refusal.field != FIELD:
            raise
        raise Refusal(FIELD, table.fit, refusal.limit) from None
    if fit.moduli != table.moduli:
        limit = f"{table.fit} has its constants by {fit.moduli} moduli"
        raise Refusal("estimate.moduli", table.moduli, limit, fit.moduli)


@lru_cache(maxsize=16)
def lab_fit(text: str) -> LabFit:
    """Return the fit of a lab-fit.toml's text. Raises Refusal, at `estimate.fit`, for the first fault."""
    from unitcad.attenuation.edge.ranges import LabFit, fault

    try:
        data = parse_toml(text, "its text")
    except UnitcadError as error:
        raise Refusal(FIELD, None, str(error)) from None
    if kind := kind_of(data):
        raise Refusal(FIELD, None, f"is {with_article(kind.name)}, not a fit; {_NEXT}")
    try:
        fit = convert(data, LabFit)
    except Refusal as refusal:
        limit = f"unknown key; {_NEXT}" if isinstance(refusal, UnknownKey) else refusal.limit
        raise Refusal(f"{FIELD}: {refusal.field}", refusal.value, limit) from None
    wrong = fault(fit)
    if wrong:
        field, value, limit = wrong
        raise Refusal(f"{FIELD}: {field}", value, limit)
    return fit


def _with_defaults(raw: RawSpec, design: Design) -> Spec:
    part, motor = _motor(raw)
    known = catalogue.materials(raw.materials)
    for i, layer in enumerate(raw.layers):
        catalogue.choose(f"layers.{i}.material", layer.material, known)
    fpcb, wires = _lead("fpcb", raw.fpcb), _lead("wires", raw.wires)
    if fpcb and wires:
        limit = "they take the place of a circuit; leave out one of the two, or set it to false"
        raise Refusal("wires", None, limit)
    moulds = _moulds(raw, design, least_slot(fpcb, wires, design.wire_sides))
    fpcb = _circuit(fpcb, raw, design, motor)
    estimate = _estimate(raw, part)
    for name in (raw.estimate.tissue, *raw.tissue):
        catalogue.tissue(name, raw.tissue)
    formats = raw.output.formats
    if formats is None:  # without STEP if no B-rep kernel is installed
        formats = ("step", "stl", "3mf") if find_spec("OCP") else ("stl", "3mf")
    return Spec.settled(
        **{
            **structs.asdict(raw),
            "motor": motor,
            "fpcb": fpcb,
            "wires": wires,
            "layers": tuple(
                CastLayer(
                    material=layer.material,
                    wall_mm=layer.wall_mm,
                    cap_mm=layer.cap_mm or 0.0,
                    thickness_mm=layer.thickness_mm,
                )
                for layer in raw.layers
            ),
            "moulds": moulds,
            "estimate": estimate,
            "output": structs.replace(raw.output, formats=formats),
        }
    )


def _motor(raw: RawSpec) -> tuple[catalogue.Motor | None, MotorSize]:
    """Return the motor's catalogue entry, and its size and drive; what is given beside a part overrides the entry's."""
    if isinstance(raw.motor, bool):
        return None, _no_motor(raw)
    given, part = raw.motor, None
    sizes: dict[str, Any] = {size: getattr(given, size) for size in MOTOR_SIZES}
    name = DEFAULT_MOTOR if given.part is None and set(sizes.values()) == {None} else given.part
    if name is not None:
        part = catalogue.choose("motor.part", name, catalogue.motors(raw.motors))
        if part.square and (sizes["diameter_mm"] or 0.0) < (corners := math.sqrt(2) * float(part.diameter_mm)):
            outline = f"the outline of {name} is a square of {number(part.diameter_mm, 3)} mm"
            limit = f"must be at least {corners:.1f}: {outline}, and a cavity is round"
            raise Refusal("motor.diameter_mm", sizes["diameter_mm"], limit, math.ceil(10 * corners) / 10)
        sizes = {field: float(getattr(part, field)) if size is None else size for field, size in sizes.items()}
    for field, size in sizes.items():
        if size is None:
            raise Refusal(f"motor.{field}", None, "is required where no part is named")
    drive = given.drive or (part.drive.value if part and part.drive else UNKNOWN_DRIVE)
    return part, MotorSize(**{**structs.asdict(given), **sizes, "part": name, "drive": drive})


def _no_motor(raw: RawSpec) -> MotorSize:
    """Return the motor of a spec without one. Raises Refusal if its design or its circuit needs one."""
    if raw.motor:
        raise Refusal("motor", raw.motor, "takes a table, or false for none", False)
    if not is_custom(raw.design):
        raise Refusal("motor", False, f"the design {raw.design} is drawn round one; a custom design may have none")
    for field in ("fpcb", "wires"):
        if getattr(raw, field):
            raise Refusal(field, None, "leads to a motor, and motor = false: leave one of them out")
    sizes: dict[str, Any] = {size: float(getattr(catalogue.motors()[DEFAULT_MOTOR], size)) for size in MOTOR_SIZES}
    return MotorSize(drive=UNKNOWN_DRIVE, absent=True, **sizes)


def _lead(field: str, given: Lead | bool | None) -> Lead | None:
    """Return the circuit or the wires of a spec; None without. Raises Refusal for true."""
    if given is True:
        raise Refusal(field, given, "takes a table, or false for none", False)
    return given or None


def _moulds(raw: RawSpec, design: Design, least: float) -> MouldsTable:
    """Return the tooling's lengths: the printer's by default, the slot at least as high as the lead in it (`least`).

    Heights that the spec does not give end whole layers of the printer.
    """
    printer = catalogue.choose("moulds.printer", raw.moulds.printer, catalogue.printers(raw.printers))
    given = structs.asdict(raw.moulds)
    lengths = {name: float(getattr(printer, name) or 0.0) for name in _PRINTER_LENGTHS if given[name] is None}
    if "slot_height_mm" in lengths:
        lengths["slot_height_mm"] = max(lengths["slot_height_mm"], least)
    layer = raw.moulds.layer_mm or lengths["layer_mm"]
    layers = Layers(raw.moulds.first_layer_mm or lengths["first_layer_mm"] or layer, layer)
    lengths |= {name: least for name, least in _BASE.items() if given[name] is None}
    if "plinth_height_mm" in lengths:
        lengths["plinth_height_mm"] = max(lengths["plinth_height_mm"], _for_leaves(printer, {**given, **lengths}))
    if given["shrinkage_percent"] is None:
        known = catalogue.materials(raw.materials)
        lengths["shrinkage_percent"] = max(float(known[one.material].shrinkage_percent or 0.0) for one in raw.layers)
    heights = {"first_layer_mm": layers.first}
    if "plate_mm" in lengths:
        heights["plate_mm"] = layers.up(lengths["plate_mm"])
    if "plinth_height_mm" in lengths:
        heights["plinth_height_mm"] = round(layers.steps(lengths["plinth_height_mm"]), 9)
    if "slot_height_mm" in lengths:  # a tongue is printed flat, and as high as its slot
        nearest = layers.nearest(lengths["slot_height_mm"])
        thinnest = max(least, float(printer.least_feature_mm))
        heights["slot_height_mm"] = nearest if nearest >= thinnest - 1e-9 else layers.up(thinnest)
    convert(heights, MouldsTable, "moulds")  # they may exceed their limits; the other lengths were checked before
    return structs.replace(raw.moulds, **{**lengths, **heights})


def _for_leaves(printer: catalogue.Printer, lengths: dict[str, Any]) -> float:
    """Return the plinth that leaves of resin need to bend as far as they must, mm; 0 without any."""
    leaf, depth = leaf_mm(printer) and lengths["least_wall_mm"], lengths["rib_interference_mm"]
    if not leaf or not depth:
        return 0.0
    pushed = farthest_push(depth, lengths["xy_play_mm"], lengths["plinth_clearance_mm"])
    return least_skirt(leaf, pushed) + lengths["seat_relief_mm"]


def _circuit(fpcb: FpcbTable | None, raw: RawSpec, design: Design, motor: MotorSize) -> FpcbTable | None:
    """Return the circuit with its pad, which the design sizes, and its tail's end, as wide as the tail."""
    if fpcb is None:
        return None
    pad = fpcb.pad_diameter_mm
    if pad is None:
        inner = raw.diameter_mm / 2 - sum(layer.wall_mm for layer in raw.layers)
        radius = design.pad_radius(raw, motor.diameter_mm / 2 if motor.fill else inner)
        # Where no pad fits, the limits refuse the diameter; until then it is as large as the motor.
        pad = round(2 * radius, 9) if radius > 0 else motor.diameter_mm
    end = fpcb.tail_width_mm if fpcb.tail_end_width_mm is None else fpcb.tail_end_width_mm
    return structs.replace(fpcb, pad_diameter_mm=pad, tail_end_width_mm=end)


def _estimate(raw: RawSpec, part: catalogue.Motor | None) -> EstimateTable:
    """Return what the estimate reads: the motor's frequency and amplitude where the spec gives none."""
    unknown = dict(UNKNOWN_MOTOR)
    if part and part.rpm:
        unknown["frequency_hz"] = round(float(part.rpm) / 60, 3)
    if part and part.kind and part.kind.value in ("piezo", "voice-coil"):
        for field in unknown:
            if not (getattr(raw.estimate, field) or getattr(part, field)):
                limit = f"is required: no source gives it for {part.name} ({part.kind.value}), and it is no coin motor"
                raise Refusal(f"estimate.{field}", None, limit)
    values = {
        field: getattr(raw.estimate, field) or float(getattr(part, field, None) or default)
        for field, default in unknown.items()
    }
    chosen = raw.estimate
    if chosen.fit is not None or chosen.fit_source is not None:
        check_fit(chosen)
    return structs.replace(chosen, **values)


CIRCUIT_STOCK = (0.05, 0.5)
"""Usual finished thickness of a flexible circuit, mm."""
MOST_RING_MM = 2.0
"""Of the ring of air round a motor: twice that of the measured units."""
GRAVITY, MOTOR_G_CM3 = 9.80665, 5.0
"""Density of a motor whose mass no one states (assumed: coin motors have 4 to 6.5)."""


def warnings(spec: Spec) -> list[str]:
    """Return the warnings of a spec: layers thinner than their silicone's casting floor, leads, play, the design's."""
    design, found = design_of(spec), [*_thin_layers(spec), *_bonds(spec), *_leads(spec), *_roof(spec)]
    found += _of_another_motor(spec)
    low, high = CIRCUIT_STOCK
    if spec.fpcb and not low <= spec.fpcb.thickness_mm <= high:
        stock = f"flexible circuits are {low:g} to {high:g} mm thick"
        found.append(f"fpcb.thickness_mm = {spec.fpcb.thickness_mm:g} mm: {stock}")
    return [*found, *_play(spec), *design.advice(spec, design.dimensions(spec))]


def _of_another_motor(spec: Spec) -> list[str]:
    """Warn of a frequency or an amplitude that is the article's motor's, since no source gives the part's own."""
    part = motor_of(spec)
    if part is None:
        return []
    values = {"frequency_hz": ("frequency", "Hz"), "amplitude_um": ("amplitude", "um")}
    lacking = [
        (word, f"{default:g} {unit}")
        for key, (word, unit) in values.items()
        if getattr(spec.estimate, key) == (default := UNKNOWN_MOTOR[key])
        and getattr(part, key) is None
        and not (key == "frequency_hz" and part.rpm)
    ]
    if not lacking:
        return []
    words, assumed = (" and ".join(each) for each in zip(*lacking, strict=True))
    return [f"no source gives the {words} of {part.name}: the {assumed} of {DEFAULT_MOTOR} stand in"]


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


def _bonds(spec: Spec) -> list[str]:
    """Warn of a layer that won't cure on the layer that it is poured on, or of which no source says that it bonds."""
    known, sentences = catalogue.materials(spec.materials), []
    for i, (on, poured) in enumerate(pairwise(layer.material for layer in spec.layers), 1):
        fresh, cured = known[poured], known[on]
        if poured == on or fresh.chemistry is None or cured.chemistry is None:
            continue
        found, chemistries = catalogue.contact(fresh, cured), f"{fresh.chemistry.value} on {cured.chemistry.value}"
        if found is None:
            sentences.append(
                f"layers.{i}.material = {poured!r}: no source says whether it bonds to {on} ({chemistries}); cast a "
                "test piece first"
            )
        elif found.result == "inhibited":
            sentences.append(
                f"layers.{i}.material = {poured!r} won't cure on {on} ({chemistries}; {found.source}); take both of "
                "one chemistry"
            )
    return sentences


def _leads(spec: Spec) -> list[str]:
    drawn = is_body_file(spec.design) and not spec.body
    if spec.body and spec.layers[0].thickness_mm is not UNSET and spec.body.bottom == "open":
        return []  # by the mouth of the hollow
    if spec.fpcb or spec.wires or spec.motor.absent or not (design_of(spec).caps or drawn or spec.body):
        return []
    offer = "draw a notch for them" if drawn else "add a table [wires] with diameter_mm, or [fpcb]"
    return [f"no way out for the motor's leads: they run between unit and skin; {offer}"]


def _roof(spec: Spec) -> list[str]:
    """Warn of a roof that spans too much air, and of too wide a ring of it round the motor."""
    if not design_of(spec).caps or spec.motor.fill or spec.motor.absent:
        return []
    dims, close, found = design_of(spec).dimensions(spec), "motor.fill = true closes the ring", list[str]()
    sag, hertz = roof(spec) or (0.0, math.inf)
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


def roof(spec: Spec) -> tuple[float, float] | None:
    """Return how far a unit's caps sag (mm), and the resonance of the motor that hangs on them (Hz).

    None if no modulus of a layer is known.

    A laminated plate is clamped at the cavity's wall. Its own weight and a stiff disc of the motor's size pull it down.
    Source: Timoshenko and Woinowsky-Krieger, Theory of Plates and Shells, 1959, chapter 3. Moduli are static.
    """
    dims, known = design_of(spec).dimensions(spec), catalogue.materials(spec.materials)
    silicones = [known[layer.material] for layer in spec.layers]
    thick = [layer.cap_mm / 1000 for layer in spec.layers]
    moduli = [each.quasistatic_modulus_kpa or each.modulus_100pct_kpa or each.youngs_modulus_kpa for each in silicones]
    known_moduli = [float(modulus) for modulus in moduli if modulus]
    if len(known_moduli) < len(silicones):
        return None
    stiff = [
        1000 * modulus / (1 - float(each.poisson_ratio) ** 2)
        for modulus, each in zip(known_moduli, silicones, strict=True)
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


def _play(spec: Spec) -> list[str]:
    play, thinnest = spec.moulds.plinth_clearance_mm, min(layer.wall_mm for layer in spec.layers)
    if spec.moulds.rib_interference_mm or (2 if len(spec.layers) > 1 else 1) * play <= thinnest / 2:
        return []
    return [f"moulds.plinth_clearance_mm = {play:g} mm lets cups move by more than half of a wall of {thinnest:g} mm"]
