"""The bill of materials: what to print, cut, buy and weigh for one set of moulds and one casting of it."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

from unitcad.casting.figures import CONTAINER, VACUUM_INHG, Mix
from unitcad.casting.needs import Need
from unitcad.casting.tape import side_places, tape_places
from unitcad.casting.tongue_prop import grip_of, tongue_prop
from unitcad.catalogue import Material, motors
from unitcad.moulds.base import PRY_HALF_WIDTH
from unitcad.moulds.mould_set import MouldSet
from unitcad.shape.body import Body
from unitcad.spec import Spec
from unitcad.text import cell, number


@dataclass(frozen=True)
class Item:
    """One line: how many of what, how it is made or lies on the printer, and a remark; `least_ml`: of a container."""

    item: str
    quantity: float
    unit: str
    made: str
    note: str
    least_ml: float | None = None


def bill(
    moulds: MouldSet, mixes: list[tuple[Material, Mix]], named: Sequence[Need], smears: Sequence[Material] = ()
) -> tuple[Item, ...]:
    """List pieces, silicone, motor, circuit or wires, tools and consumables (`named`: by steps).

    Silicone is every pour's mix, and the least batch for each of `smears`, which are mixed after the pours.
    """
    consumables = consumed(moulds, [mix for _, mix in mixes], named, len(smears))
    silicone = _silicone(mixes, smears, moulds.spec.casting.minimum_mix_g)
    return (*_pieces(moulds), *silicone, *_inside(moulds), *consumables)


def in_words(items: Iterable[Item]) -> tuple[Item, ...]:
    """Return a bill as it is read: 1 piece, 9 pieces."""
    return tuple(
        item if item.unit == "g" or item.quantity == 1 else replace(item, unit=f"{item.unit}s") for item in items
    )


def to_csv(items: tuple[Item, ...]) -> str:
    """Return the bill as CSV with a header; quantities to four significant digits."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["item", "quantity", "unit", "made", "note"])
    writer.writerows([cell(i.item), f"{i.quantity:.4g}", i.unit, i.made, cell(i.note)] for i in items)
    return text.getvalue()


def _pieces(moulds: MouldSet) -> Iterator[Item]:
    spec, plan = moulds.spec, moulds.plan
    dims = plan.dimensions
    kinds: dict[str, list[Body]] = {}
    for tool in plan.pieces:
        # Tongues and stubs are numbered by cell and otherwise alike; cups and lids are not.
        kinds.setdefault(tool.kind if tool.kind in ("tongue", "stub") else tool.name, []).append(tool)
    for name, (tool, *more) in kinds.items():
        count = 1 + len(more)
        if tool.kind == "stub":
            height = dims.core_height - moulds.plate[0]
            length = f"{height + plan.layout.plate[1] + 10:.0f} mm each, the end bent by a right angle"
            note = f"{number(spec.moulds.filament_mm, 3)} mm printer filament, {length}"
            yield Item("filament stub", count, "piece", "cut", note)
        elif tool.kind == "blade" and tool.made == "cut":
            note = f"a straight bar of metal, {plan.layout.plate[1] * 2:.0f} mm long or longer: the bed takes no blade"
            yield Item("blade", 1, "piece", "tool", note)
        elif tool.made == "cut":
            height = dims.exit.height if dims.exit else 0.0
            yield Item(name, count, "piece", "cut", f"from film or steel strip of {number(height, 3)} mm")
        else:
            attitude = "printed upside down" if tool.upside_down else "printed as drawn"
            note = f"{spec.moulds.printer}, layers of {number(spec.moulds.layer_mm, 3)} mm"
            yield Item(plan.called(name), count, "piece", attitude, note)


def _silicone(mixes: list[tuple[Material, Mix]], smears: Sequence[Material], least_g: float) -> Iterator[Item]:
    for material in dict.fromkeys([*(material for material, _ in mixes), *smears]):
        own = [mix for other, mix in mixes if other == material]
        ratio, smeared = float(material.mix_ratio), smears.count(material) * least_g
        uses = [f"{len(own)} pour{'' if len(own) == 1 else 's'}"] if own else []
        uses += [f"{number(smeared, 3)} g for the smear"] if smeared else []
        note = f"{' and '.join(uses)}, mix ratio {number(ratio, 3)} A to 1 B, Shore {material.shore.value}"
        part_b = smeared / (1 + ratio)
        yield Item(f"{material.name} part A", sum(m.part_a_g for m in own) + ratio * part_b, "g", "bought", note)
        yield Item(f"{material.name} part B", sum(m.part_b_g for m in own) + part_b, "g", "bought", note)


def _inside(moulds: MouldSet) -> Iterator[Item]:
    cells, spec = len(moulds.plan.layout.cells), moulds.spec
    size = f"{number(spec.motor.diameter_mm, 3)} x {number(spec.motor.thickness_mm, 3)} mm"
    yield Item(spec.motor.part or "motor", cells, "piece", "bought", ", ".join([size, *_ratings(spec)]))
    if any(body.kind == "circuit" for body in moulds.laid_later):
        yield Item("flexible circuit", 1, "piece", "bought", "for all motors, as circuit.dxf and circuit-pads.csv say")
    if fpcb := spec.fpcb:
        sides = {"one": "one side", "both": "both sides"}.get(fpcb.tail, fpcb.tail)
        tail = f"tail {number(fpcb.tail_width_mm, 3)} wide to {sides}, {number(fpcb.thickness_mm, 3)} thick"
        yield Item("flexible circuit", cells, "piece", "bought", f"pad {number(fpcb.pad_diameter_mm, 3)} mm, {tail}")
    if wires := spec.wires:
        yield Item(
            "wire", cells * wires.count, "piece", "bought", f"{number(wires.diameter_mm, 3)} mm over the insulation"
        )


def _ratings(spec: Spec) -> Iterator[str]:
    """Yield what the catalogue knows of the motor's rating and mass."""
    if spec.motor.part:
        motor = motors(spec.motors)[spec.motor.part]
        ratings = {"V": motor.voltage_v, "mA": motor.current_ma, "g": motor.acceleration_g}
        yield from (f"{number(value, 3)} {unit}" for unit, value in ratings.items() if value)
        if motor.mass_g:
            yield f"mass {number(motor.mass_g, 3)} g"


def injecting(spec: Spec, mixes: Sequence[Mix]) -> Iterator[Item]:
    """List what pours under a lid take, each with its mix."""
    size, tip = max(mix.syringe_size_ml for mix in mixes), number(spec.moulds.sprue_mm, 3)
    yield Item("syringe", len(mixes), "piece", "bought", f"{number(size, 3)} ml, tip up to {tip} mm")
    yield Item("rubber bands or a clamp", 2, "piece", "tool", "round lid and base")


def consumed(moulds: MouldSet, mixes: list[Mix], named: Sequence[Need], smears: int = 0) -> Iterator[Item]:
    """List what the steps name, then what only its numbers make an item of this set's; `smears`: mixes beside pours."""
    pours, lengths = len(moulds.plan.steps), moulds.spec.moulds
    yield Item("mixing cups and sticks", pours + smears, "set", "bought", "no latex, no sulphur clay: they inhibit")
    yield Item("gloves", pours, "pair", "bought", "nitrile or vinyl; latex inhibits")
    resolution = number(moulds.spec.casting.scale_resolution_g, 3)
    yield Item("scale", 1, "piece", "tool", f"shows {resolution} g")
    if cups := moulds.plan.of_kind("cup"):
        wide = number(2 * PRY_HALF_WIDTH, 3)
        yield Item("flat screwdrivers", 2, "piece", "tool", f"up to {wide} mm wide, for the pry slots")
    yield from (Item(need.item, need.quantity, need.unit, need.made, need.note) for need in named)
    if prop := tongue_prop(moulds):
        size = f"{number(prop.width_mm, 2)} x {number(prop.length_mm, 2)} mm, {number(prop.thickness_mm, 3)} mm thick"
        yield Item(
            "pad of stacked card", len(prop.pads), "piece", "cut", f"{size}: bears the tongues' {grip_of(moulds)}s"
        )
    if moulds.spec.casting.vacuum:
        least = CONTAINER * max(mix.millilitres for mix in mixes)  # one mix after the other
        chamber = f"a chamber that reaches {number(VACUUM_INHG, 3)} inHg"
        note = f"at least {number(least, 2)} ml, since silicone foams up; {chamber}; used again for every mix"
        yield Item("degassing container", 1, "piece", "tool", note, least)
    if lengths.pour == "injected":
        yield from injecting(moulds.spec, mixes)
    elif cups:
        strips = 2 * (len(tape_places(moulds)) + len(side_places(moulds))) * pours
        yield Item("adhesive tape", strips, "strip", "bought", "holds each cup down; 8 mm wide, 30 mm long")
