"""The bill of materials: what to print, cut, buy and weigh for one set of moulds and one casting of it."""

from __future__ import annotations

import csv
import io
from dataclasses import dataclass

from unitcad.casting.figures import Mix
from unitcad.catalogue import Material
from unitcad.designs import Dimensions
from unitcad.moulds.plan import Plan
from unitcad.spec import Spec
from unitcad.text import cell


@dataclass(frozen=True)
class Item:
    """One line: how many of what, how it is made or lies on the printer, and a remark."""

    item: str
    quantity: float
    unit: str
    made: str
    note: str


def bill(spec: Spec, dims: Dimensions, plan: Plan, mixes: list[tuple[Material, Mix]]) -> tuple[Item, ...]:
    """Printed pieces, silicone (every pour's mix), filament, film, motor, circuit or wires, consumables."""
    return (*_pieces(spec, dims, plan), *_silicone(mixes), *_inside(spec, plan), *_consumables(spec, plan))


def to_csv(items: tuple[Item, ...]) -> str:
    """The bill as CSV with a header; quantities to four significant digits."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["item", "quantity", "unit", "made", "note"])
    writer.writerows([cell(i.item), f"{i.quantity:.4g}", i.unit, i.made, cell(i.note)] for i in items)
    return text.getvalue()


def _pieces(spec: Spec, dims: Dimensions, plan: Plan) -> list[Item]:
    kinds: dict[str, list[str]] = {}
    for tool in plan.tools:
        # Tongues and stubs are numbered by cell and otherwise alike; cups and lids are not.
        kind = tool.kind if tool.kind in ("tongue", "stub") else tool.name
        kinds.setdefault(kind, []).append(tool.name)
    found = []
    for kind, names in kinds.items():
        tool = plan.tool(names[0])
        if kind == "stub":
            height = dims.core_height + spec.moulds.plinth_height_mm + spec.moulds.plate_mm
            length = height + plan.layout.plate[1] + 10
            note = (
                f"{spec.moulds.filament_mm:g} mm printer filament, {length:.0f} mm each, the end bent by a right angle"
            )
            found.append(Item("filament stub", len(names), "piece", "cut", note))
            continue
        if tool.made == "cut":
            height = dims.exit.height if dims.exit else 0.0
            found.append(Item(kind, len(names), "piece", "cut", f"from film or steel strip of {height:.3g} mm"))
            continue
        attitude = "printed upside down" if tool.upside_down else "printed as drawn"
        note = f"{spec.moulds.printer}, layers of {spec.moulds.layer_mm:g} mm"
        found.append(Item(kind, len(names), "piece", attitude, note))
    return found


def _silicone(mixes: list[tuple[Material, Mix]]) -> list[Item]:
    found = []
    for material in dict.fromkeys(material for material, _ in mixes):
        own = [mix for other, mix in mixes if other == material]
        note = f"{len(own)} pour{'' if len(own) == 1 else 's'}, mix ratio {float(material.mix_ratio):g} A to 1 B"
        found.append(Item(f"{material.name} part A", sum(m.part_a_g for m in own), "g", "bought", note))
        found.append(Item(f"{material.name} part B", sum(m.part_b_g for m in own), "g", "bought", note))
    return found


def _inside(spec: Spec, plan: Plan) -> list[Item]:
    cells, motor = len(plan.layout.cells), spec.motor
    size = f"{motor.diameter_mm:g} x {motor.thickness_mm:g} mm"
    found = [Item(motor.part or "motor", cells, "piece", "bought", size)]
    if spec.fpcb:
        fpcb = spec.fpcb
        tail = f"tail {fpcb.tail_width_mm:g} wide to {fpcb.tail}, {fpcb.thickness_mm:g} thick"
        note = f"pad {fpcb.pad_diameter_mm:g}, {tail}"
        found.append(Item("flexible circuit", cells, "piece", "bought", note))
    if spec.wires:
        note = f"{spec.wires.diameter_mm:g} mm over the insulation"
        found.append(Item("wire", cells * spec.wires.count, "piece", "bought", note))
    return found


def _consumables(spec: Spec, plan: Plan) -> list[Item]:
    found = [
        Item("mixing cups and sticks", len(spec.layers), "set", "bought", "no latex, no sulphur clay: they inhibit")
    ]
    if plan.of_kind("tongue"):
        found.append(Item("petroleum jelly", 1, "dab", "bought", "for tongues and windows only"))
    if len(spec.layers) > 1:
        found.append(
            Item("isopropanol and lint-free wipes", 1, "set", "bought", "to wipe a cured layer before the next")
        )
    if spec.moulds.pour == "injected":
        found.append(Item("syringe", len(spec.layers), "piece", "bought", f"tip up to {spec.moulds.sprue_mm:g} mm"))
    return found
