"""The bill of materials: items to print, cut, buy and weigh for one set of moulds and one casting of it."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

from unitcad.casting.drawings import tape_places, tongue_prop
from unitcad.casting.figures import CONTAINER, VACUUM_INHG, AfterPours, Batch, for_casting
from unitcad.casting.plates import SPARE_TONGUE, made_pieces
from unitcad.casting.steps import REQUIRED_TOOLS, BenchStep
from unitcad.catalogue import Motor
from unitcad.moulds.base import PRY_HALF_WIDTH
from unitcad.moulds.mould_set import MouldSet
from unitcad.shape.tree import Body
from unitcad.spec import Spec, motor_of
from unitcad.text import cell, number


@dataclass(frozen=True)
class Item:
    """One line: number and item, how it is made or placed on the printer, and a remark; `least_ml`: of a container."""

    item: str
    quantity: float
    unit: str
    made: str
    note: str
    least_ml: float | None = None


def bill(
    moulds: MouldSet, batches: Sequence[Batch], steps: Sequence[BenchStep], after: Sequence[AfterPours] = ()
) -> tuple[Item, ...]:
    """List pieces, silicone, motor, circuit or wires, tools and consumables.

    Silicone is every pour's mix, and the batches mixed `after` the pours.
    """
    items = [*list_pieces(moulds)]
    for material in dict.fromkeys([*(batch.silicone for batch in batches), *(more.silicone for more in after)]):
        own = [batch.mix for batch in batches if batch.silicone == material]
        ratio, later = float(for_casting(material, "mix_ratio")), [more for more in after if more.silicone == material]
        uses = [f"{len(own)} pour{'' if len(own) == 1 else 's'}"] if own else []
        uses += [f"{number(more.grams, 3)} g for the {more.use}" for more in later]
        note = f"{' and '.join(uses)}, mix ratio {number(ratio, 3)} A to 1 B"
        note += f", Shore {material.shore.value}" if material.shore else ""
        part_b = sum(more.grams for more in later) / (1 + ratio)
        part_a, part_b = sum(m.part_a_g for m in own) + ratio * part_b, sum(m.part_b_g for m in own) + part_b
        items += [
            Item(f"{material.name} part {part}", g, "g", "bought", note) for part, g in (("A", part_a), ("B", part_b))
        ]
    return (*items, *_inside(moulds), *list_consumables(moulds, batches, steps, len(after)))


def in_words(items: Iterable[Item]) -> tuple[Item, ...]:
    """Return a bill as it is read: 1 piece, 9 pieces."""
    return tuple(
        item if item.unit == "g" or item.quantity == 1 else replace(item, unit=f"{item.unit}s") for item in items
    )


_COUNTED = "flexible circuit", "filament", "pad", "wire", "lead wire", "syringe", "own motor"


def plural(item: str) -> str:
    """Return the name of several of an item; parts keep their number, and sets and pairs their words."""
    noun = next((noun for noun in _COUNTED if re.match(rf"{noun}\b", item)), "")
    return f"{noun}s{item.removeprefix(noun)}" if noun else item


def group_bill(items: Iterable[Item]) -> dict[str, list[Item]]:
    """Return a bill by activity: print, buy, have."""
    groups: dict[str, list[Item]] = {"print": [], "buy": [], "have": []}
    for item in items:
        groups["print" if item.made.startswith("printed") else "buy" if item.made == "bought" else "have"].append(item)
    return {name: items for name, items in groups.items() if items}


def to_csv(items: Iterable[Item]) -> str:
    """Return the bill as CSV with a header; quantities to four significant digits."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["item", "quantity", "unit", "made", "note"])
    writer.writerows([cell(i.item), f"{i.quantity:.4g}", i.unit, i.made, cell(i.note)] for i in items)
    return text.getvalue()


def list_pieces(moulds: MouldSet) -> Iterator[Item]:
    """List the pieces of the tools, printed or cut."""
    lengths, plan = moulds.spec.moulds, moulds.plan
    dims, kinds = plan.dimensions, dict[str, list[Body]]()
    for tool in made_pieces(moulds):
        # Tongues and filaments are numbered by cell and otherwise alike; cups and lids are not.
        kinds.setdefault(tool.kind if tool.kind in ("tongue", "filament") else tool.name, []).append(tool)
    for name, (tool, *more) in kinds.items():
        count, made, item = 1 + len(more), "cut", name
        if tool.kind == "filament":
            length = f"{dims.core_height - moulds.plate[0] + plan.layout.plate[1] + 10:.0f} mm each"
            item = "filament"
            note = f"{number(lengths.filament_mm, 3)} mm printer filament, {length}"
        elif tool.kind == "blade" and tool.made == "cut":
            made = "tool"
            note = f"a straight bar of metal, {plan.layout.plate[1] * 2:.0f} mm long or longer: the bed takes no blade"
        elif tool.made == "cut":
            note = f"from film or steel strip of {number(dims.exit.height if dims.exit else 0.0, 3)} mm"
        else:
            item, made = plan.called(name), "printed upside down" if tool.upside_down else "printed as drawn"
            first = number(lengths.first_layer_mm, 3)
            note = f"{lengths.printer}, layers {number(lengths.layer_mm, 3)}, first layer {first} mm"
            note += "; one is a spare" if any(piece.name == SPARE_TONGUE for piece in more) else ""
        yield Item(item, count, "piece", made, note)


def motor_name(spec: Spec) -> str:
    """Return the motor's name on the bill: its part number, or "own motor" if the sizes are not that part's."""
    return motor.name if (motor := motor_of(spec)) else "own motor"


def _inside(moulds: MouldSet) -> Iterator[Item]:
    cells, spec = len(moulds.plan.layout.cells), moulds.spec
    note = f"{number(spec.motor.diameter_mm, 3)} x {number(spec.motor.thickness_mm, 3)} mm"
    if any(key.startswith("motor.") for key in moulds.assumed):
        note += " (assumed)"
    if motor := motor_of(spec):
        note += "".join(f", {words}" for words in _ratings(motor))
    if not spec.motor.absent:
        yield Item(motor_name(spec), cells, "piece", "bought", note)
    if any(body.kind == "circuit" for body in moulds.plan.laid_later):
        yield Item("flexible circuit", 1, "piece", "bought", "for all motors, as circuit.dxf and circuit-pads.csv say")
    if fpcb := spec.fpcb:
        sides = {"one": "one side", "both": "both sides"}.get(fpcb.tail, fpcb.tail)
        tail = f"tail {number(fpcb.tail_width_mm, 3)} wide to {sides}, {number(fpcb.thickness_mm, 3)} thick"
        yield Item("flexible circuit", cells, "piece", "bought", f"pad {number(fpcb.pad_diameter_mm, 3)} mm, {tail}")
    if wires := spec.wires:
        note = f"{number(wires.diameter_mm, 3)} mm over the insulation"
        yield Item("wire", cells * wires.count, "piece", "bought", note)


def _ratings(motor: Motor) -> Iterator[str]:
    """Yield what tells a motor from another one at the shop, in words."""
    if motor.kind:
        yield {"erm": "ERM", "lra": "LRA", "voice-coil": "voice coil", "piezo": "piezo disc"}[motor.kind.value]
    if motor.square:
        yield f"a square can of {number(motor.diameter_mm, 3)} mm"
    for unit, value in (("V", motor.voltage_v), ("mA", motor.current_ma)):
        if value:
            yield f"{number(value, 3)} {unit}"
    if motor.acceleration_g:
        mass = f" on {number(motor.test_mass_g, 3)} g" if motor.test_mass_g else ""
        yield f"{number(motor.acceleration_g, 3)} g{mass}"
    if motor.mass_g:
        yield f"mass {number(motor.mass_g, 3)} g"
    if motor.leads:
        yield motor.leads.value


def list_consumables(
    moulds: MouldSet, batches: Sequence[Batch], steps: Sequence[BenchStep], after: int = 0
) -> Iterator[Item]:
    """List the items for pours and steps; `after`: mixes after the pours."""
    pours, cups = len(moulds.plan.steps), moulds.plan.of_kind("cup")
    yield Item("mixing cups and sticks", pours + after, "set", "bought", "no latex, no sulphur clay")
    yield Item("gloves", pours, "pair", "bought", "nitrile or vinyl")
    yield Item("scale", 1, "piece", "tool", f"shows {number(moulds.spec.casting.scale_resolution_g, 3)} g")
    if cups:
        note = f"up to {number(2 * PRY_HALF_WIDTH, 3)} mm wide"
        yield Item("flat screwdrivers", 2, "piece", "tool", note)
    named = {"caliper", *(tool for step in steps for tool in step.required_tools)}
    lidded = [batch for batch in batches if batch.step.injected]
    strips = 2 * (len(tape_places(moulds)) if cups else 0) * sum(not step.lid for step in moulds.plan.steps)
    if strips:
        named.discard("adhesive tape")  # its strips are on the list
    for tool in sorted(named, key=[*REQUIRED_TOOLS].index):
        unit, made, note = REQUIRED_TOOLS[tool]
        yield Item(tool, 1, unit, made, note)
    if prop := tongue_prop(moulds):
        note = f"{number(prop.width_mm, 2)} x {number(prop.length_mm, 2)} mm, {number(prop.thickness_mm, 3)} mm thick"
        yield Item("pad of stacked card", len(prop.pads), "piece", "cut", note)
    if moulds.spec.casting.vacuum:
        least = CONTAINER * max(batch.mix.millilitres for batch in batches)  # one mix after the other
        chamber = f"a chamber that reaches {number(VACUUM_INHG, 3)} inHg"
        note = f"at least {number(least, 2)} ml; {chamber}"
        yield Item("degassing container", 1, "piece", "tool", note, least)
    if strips:
        yield Item("adhesive tape", strips, "strip", "bought", "8 mm wide, 30 mm long")
    if lidded:
        size, tip = max(batch.mix.syringe_size_ml for batch in lidded), moulds.spec.moulds.sprue_mm
        note = f"{number(size, 3)} ml, tip up to {number(tip, 3)} mm"
        yield Item("syringe", len(lidded), "piece", "bought", note)
        yield Item("rubber bands or a clamp", 2, "piece", "tool", "round lid and base")
