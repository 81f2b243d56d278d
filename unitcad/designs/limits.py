"""The limits that concentric designs share: stretch, rib leaves, and all that no kernel would notice.

Each refusal names the field, its value, the limit and the nearest accepted value: that value, put in, meets this limit.

The leaves that carry the ribs of a cup printed in resin: how long they must be to bend and not to break.

Crushing would chip a rib of resin. So each is on a leaf of the skirt, cut free on three sides, which gives way: a
cantilever of thickness t, pushed aside by d at the arm a below its root. The strain at the root is 1.5 t d / a^2, the
most in it, if nothing but the leaf bends. No leaf has been printed yet.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from unitcad import catalogue
from unitcad.catalogue import Material, Printer, needed
from unitcad.designs.dimensions import MOTOR_CLEARANCE, WIRE_GAP, Dimensions, Exit
from unitcad.errors import Refusal
from unitcad.spec import Spec, printer_of
from unitcad.spec.layers import layers_of
from unitcad.spec.raw import LEAST_LEDGE, FpcbTable, WiresTable


def allowed_strain(spec: Spec, known: Mapping[str, Material]) -> float:
    """Return the margin's part of the least elongation at break among the layers (1 = 100 %).

    Raises Refusal for a layer whose elongation is not known.
    """
    by_layer = (needed(known[layer.material], "elongation_pct", "a limit of stretch") for layer in spec.layers)
    least = min(map(float, by_layer))
    return spec.casting.strain_margin * least / 100


def lip_strain(dims: Dimensions) -> float:
    """Return the strain of a lip's mouth as motor and pad are pushed through it: radius over radius, less one."""
    passing = max(dims.motor_radius, dims.pad.radius if dims.pad else 0.0)
    return passing / dims.mouth_radius - 1


def tail_strain(fpcb: FpcbTable, slot: Exit) -> float:
    """Return the strain of the slot's edge as the tail's free end passes: perimeter over perimeter, less one, or 0."""
    return max(0.0, 2 * (fpcb.tail_end_width_mm + fpcb.thickness_mm) / _round(slot) - 1)


def pad_strain(fpcb: FpcbTable, slot: Exit) -> float:
    """Return the strain of the slot's edge if a pad of the circuit had to pass, as in `tail = "both"`."""
    return max(0.0, 2 * (fpcb.pad_diameter_mm + fpcb.thickness_mm) / _round(slot) - 1)


def widest_tail_end(fpcb: FpcbTable, slot: Exit, strain: float) -> float:
    """Return the widest free end of a tail, mm, that stretches the slot by no more than `strain`."""
    return _round(slot) * (1 + strain) / 2 - fpcb.thickness_mm


def _round(slot: Exit) -> float:
    """Return the slot's perimeter, mm."""
    return 2 * (slot.width + slot.height)


MOST_STRAIN = 0.012
"""Largest strain at a leaf's root (assumed: about half of strength over modulus of standard resins)."""
LEAF_WIDTH = 2.5
CREST = 0.8
"""Distance from the skirt's lower end up to the contact of a rib on a leaf with the plinth, mm."""


def leaf_mm(printer: Printer) -> float:
    """Return how thick a leaf is, and how wide the slot round it, mm: the least wall; 0 for ribs that are crushed."""
    return float(printer.least_wall_mm) if printer.technology.value == "sla" else 0.0


def leaf_strain(thickness: float, pushed: float, arm: float) -> float:
    """Return the strain at the root of a leaf that is pushed aside by `pushed` at `arm` below it, mm."""
    return 1.5 * thickness * pushed / arm**2


def farthest_push(interference: float, play: float, clearance: float) -> float:
    """Return how far a rib is pushed back if the gap is printed narrower by the printer's play, mm."""
    return interference + min(play, clearance)


def least_skirt(thickness: float, pushed: float) -> float:
    """Return the height of a skirt, mm, whose leaves are strained by no more than `MOST_STRAIN`."""
    return math.sqrt(1.5 * thickness * pushed / MOST_STRAIN) + CREST


TAIL_SHARE = 0.7
"""Half the tail's width over the core's radius, at most: beyond it the ledge has no shoulders."""
LEDGE_SHARE = 0.95
"""Half the notch's width over the ledge's radius, at most: beyond it the tongue's round tip has prongs."""
SLOT_CLEARANCE = 0.2
"""Least height of the slot over the circuit's thickness, or a wire's on each side of it, mm."""
LEAST_SKIN = 0.3
"""No film over the skin side is thinner, mm: it tears as it is peeled out of its tray (assumed)."""
EPS = 1e-9


def check_motor(spec: Spec, dims: Dimensions) -> None:
    """Raise Refusal if motor, clearance and walls do not fit, and for a lip or a skin that can't be cast."""
    clearance = 0.0 if spec.motor.fill else MOTOR_CLEARANCE + dims.tapers[0] * dims.motor_height
    walls = sum(layer.wall_mm for layer in spec.layers)
    at_least(
        "diameter_mm",
        spec.diameter_mm,
        2 * (dims.motor_radius + clearance + walls),
        f"the motor ({2 * dims.motor_radius:g}), {clearance:.3g} of clearance and walls of {walls:g} a side need",
    )
    if spec.skin_mm:
        at_least("skin_mm", spec.skin_mm, LEAST_SKIN, "a film over the skin side, if any, has at least")
    if dims.mouth_radius or spec.motor.lip_mm:
        _check_lip(spec, dims)


def _check_lip(spec: Spec, dims: Dimensions) -> None:
    lip, neck = spec.motor.lip_mm, spec.moulds.filament_hole_mm / 2 + spec.moulds.least_wall_mm
    most = down(dims.motor_radius - neck)
    at_most("motor.lip_mm", lip, max(most, 0.0), "the core's neck in the lip carries the filament's hole, so at most")
    under = dims.exit.low if dims.exit else dims.motor_height
    if dims.core_outline[-2][1] > under:
        ring = f"a ring of air of {dims.air_ring:g} mm"
        limit = f"the core's cone over the lip is too wide for {ring}; motor.fill = true is accepted"
        raise Refusal("motor.lip_mm", lip, limit, 0.0)


def widest_exit(spec: Spec, dims: Dimensions) -> float:
    """Return the widest tail, or bundle of wires, whose ledge keeps its shoulders, mm."""
    return min(2 * TAIL_SHARE * dims.cavity_radius, 2 * LEDGE_SHARE * dims.ledge_radius - _beside(spec))


def core_for(spec: Spec, width: float) -> float:
    """Return the least radius of a core whose ledge has shoulders on both sides of a tail of this width, mm."""
    return max(width / (2 * TAIL_SHARE), (width + _beside(spec)) / (2 * LEDGE_SHARE) + spec.moulds.ledge_mm)


def _beside(spec: Spec) -> float:
    """Return how much wider than the tail its notch is, mm."""
    return spec.moulds.slot_width_clearance_mm + 2 * spec.moulds.window_clearance_mm


def check_wires(spec: Spec, dims: Dimensions) -> None:
    """Raise Refusal for wires together with a circuit, and for a bundle too wide for the motor or the ledge."""
    wires = spec.wires
    if not wires:
        return
    at_most("wires.diameter_mm", wires.diameter_mm, dims.motor_height / 2, "half the motor's thickness is")
    bundle = wires.count * (wires.diameter_mm + WIRE_GAP) - WIRE_GAP
    widest = widest_exit(spec, dims)
    if bundle > widest + EPS:
        raise Refusal(
            "wires.diameter_mm",
            wires.diameter_mm,
            f"{wires.count} side by side take {bundle:.4g} mm, and the ledge leaves {widest:.4g} mm",
            down((widest + WIRE_GAP) / wires.count - WIRE_GAP) if widest > wires.count * WIRE_GAP else None,
        )


def least_slot(fpcb: FpcbTable | None, wires: WiresTable | None, wire_sides: int) -> float:
    """Return the least height of the exit, mm; 0 if nothing leaves. `wire_sides`: see `Design`."""
    if wires:
        return wires.diameter_mm + SLOT_CLEARANCE * wire_sides
    return fpcb.thickness_mm + SLOT_CLEARANCE if fpcb else 0.0


def check_slot_height(spec: Spec, wire_sides: int) -> None:
    """Raise Refusal for a slot too low for its tail or wires."""
    at_least(
        "moulds.slot_height_mm",
        spec.moulds.slot_height_mm,
        least_slot(spec.fpcb, spec.wires, wire_sides),
        f"the slot takes the {'circuit' if spec.fpcb else 'wire'} with clearance, so at least",
    )


def check_under_window(spec: Spec, dims: Dimensions, exit: Exit) -> None:
    """Raise Refusal if the cup has no wall under the window of its tongue."""
    at_least(
        "motor.thickness_mm",
        dims.motor_height,
        spec.moulds.least_wall_mm + spec.moulds.window_clearance_mm + dims.motor_height - exit.low,
        f"with a {leaving(spec)}, the cup's wall under the window needs a motor of at least",
    )


def leaving(spec: Spec) -> str:
    """Return the part that leaves the body: "tail" or "wire"."""
    return "tail" if spec.fpcb else "wire"


def check_printer(spec: Spec) -> None:
    """Raise Refusal for walls and features that the printer can't make."""
    moulds = spec.moulds
    printer = catalogue.printers(spec.printers)[moulds.printer]
    wall, feature = moulds.least_wall_mm, float(printer.least_feature_mm)
    at_least(
        "moulds.least_wall_mm", wall, float(printer.least_wall_mm), f"{moulds.printer} prints no wall thinner than"
    )
    for field in ("skirt_wall_mm", "land_mm", "plate_mm"):
        at_least(f"moulds.{field}", getattr(moulds, field), wall, "the printer's least wall is")
    for field in ("engraving_stroke_mm", "groove_width_mm", "slot_height_mm"):
        at_least(f"moulds.{field}", getattr(moulds, field), feature, "the printer's least feature is")
    at_most(
        "moulds.bore_compensation_mm",
        moulds.bore_compensation_mm,
        max(moulds.land_mm - wall, 0.0),
        "the least wall stays between a wider bore and its groove, so at most",
    )


def check_engraving(spec: Spec, dims: Dimensions) -> None:
    """Raise Refusal if the lettering on the first cup or on the plate has no floor under it."""
    floor = float(catalogue.printers(spec.printers)[spec.moulds.printer].least_flat_wall_mm)
    at_most(
        "moulds.engraving_depth_mm",
        spec.moulds.engraving_depth_mm,
        min(dims.heights[0], spec.moulds.plate_mm) - floor,
        f"a floor of {floor:g} must stay under the lettering, so at most",
    )


def check_seat(spec: Spec) -> None:
    """Raise Refusal for a relief that leaves the cup nothing to be centred by."""
    at_most(
        "moulds.seat_relief_mm",
        spec.moulds.seat_relief_mm,
        spec.moulds.plinth_height_mm - 0.5,
        "half a millimetre of skirt must stay to centre the cup, so at most",
    )


def check_ribs(spec: Spec) -> None:
    """Raise Refusal for ribs that would lift the cup off its seat, and for leaves under them too short to bend."""
    moulds, printer = spec.moulds, printer_of(spec)
    line, leaf = float(printer.least_feature_mm), leaf_mm(printer)
    at_most(
        "moulds.rib_interference_mm",
        spec.moulds.rib_interference_mm,
        line / 2,
        f"a rib is as wide as a printed line of {line:g} mm and reaches into the plinth by half of that",
    )
    if leaf and moulds.rib_interference_mm:
        pushed = farthest_push(moulds.rib_interference_mm, moulds.xy_play_mm, moulds.plinth_clearance_mm)
        at_least(
            "moulds.plinth_height_mm",
            moulds.plinth_height_mm,
            least_skirt(leaf, pushed) + moulds.seat_relief_mm,
            f"leaves of resin {leaf:g} thick, pushed aside by up to {pushed:.3g} mm by ribs, need a plinth of",
        )


def check_filament(spec: Spec, dims: Dimensions) -> None:
    """Raise Refusal if plate and core have no room for the filament that lets air under a closed unit."""
    moulds = spec.moulds
    hole, wall = moulds.filament_hole_mm, moulds.least_wall_mm
    at_least("moulds.filament_hole_mm", hole, moulds.filament_mm, "the hole takes the filament of")
    at_least(
        "moulds.plate_mm",
        moulds.plate_mm,
        filament_groove(spec) + wall,
        "the plate contains the filament's groove and a wall over it, so at least",
    )
    inside = dims.ledge_radius if dims.sides else dims.cavity_radius
    if inside < hole / 2 + wall - EPS:
        limit = "the core must have room for the filament's hole with a wall round it, and the ledge"
        ledge = down(dims.cavity_radius - hole / 2 - wall)
        if dims.sides and ledge >= LEAST_LEDGE:
            limit += f"; moulds.ledge_mm = {ledge:g} would do too"
        raise wider_core(spec, hole / 2 + wall - inside, limit)


def wider_core(spec: Spec, more: float, limit: str) -> Refusal:
    """Return the refusal of a core whose radius needs `more` mm: a filled one is as wide as the motor."""
    if spec.motor.fill:
        return Refusal("motor.diameter_mm", spec.motor.diameter_mm, limit, up(spec.motor.diameter_mm + 2 * more))
    return Refusal("diameter_mm", spec.diameter_mm, limit, up(spec.diameter_mm + 2 * more))


def filament_groove(spec: Spec) -> float:
    """Return depth and width of the groove that takes the bent filament under the plate, mm: a whole layer ends it."""
    return layers_of(spec).up(spec.moulds.filament_mm + 0.5)


def at_least(field: str, value: float, limit: float, why: str) -> None:
    """Raise Refusal if `value` is below `limit`."""
    _bound(field, value, limit, why, value < limit - EPS, up)


def at_most(field: str, value: float, limit: float, why: str) -> None:
    """Raise Refusal if `value` is above `limit`."""
    _bound(field, value, limit, why, value > limit + EPS, down)


def _bound(field: str, value: float, limit: float, why: str, broken: bool, nearest: Callable[[float], float]) -> None:
    if broken:
        accepted = nearest(limit)
        raise Refusal(field, value, f"{why} {accepted:g} mm", accepted)


def up(limit: float) -> float:
    """Return the least typed value (three decimals) that is not below `limit`."""
    return round(math.ceil(limit * 1000 - 1e-6) / 1000, 3)


def down(limit: float) -> float:
    """Return the largest typed value (three decimals) that is not above `limit`."""
    return round(math.floor(limit * 1000 + 1e-6) / 1000, 3)
