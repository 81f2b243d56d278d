"""The bill of an array whose units are cast apart: what units and sheet use up is added, what is reused counts once."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace

from unitcad.arrays.array import Array
from unitcad.arrays.hidden_tails import hidden_tails
from unitcad.arrays.patch_moulds import PatchMoulds
from unitcad.casting.bill import Item, consumed, motor_name
from unitcad.casting.figures import Batch
from unitcad.casting.procedure import Procedure
from unitcad.casting.steps import NEEDS, BenchStep
from unitcad.text import number

ONCE = frozenset(NEEDS)
"""What one piece, dab or roll of is enough for every casting."""


def pocket_bill(
    moulds: PatchMoulds, batch: Batch, steps: Iterable[BenchStep], units: Mapping[str, Procedure]
) -> tuple[Item, ...]:
    """Return the bill of units and sheet. `batch` and `steps`: of the sheet; `units` by their folder."""
    silicone, mix = batch.silicone, batch.mix
    net = f"sheet: {number(mix.net_g, 3)} g net"
    own = [
        *_pieces(moulds),
        Item(f"{silicone.name} part A", mix.part_a_g, "g", "bought", net),
        Item(f"{silicone.name} part B", mix.part_b_g, "g", "bought", net),
        *_wires(moulds.arranged),
        *consumed(moulds, [batch], steps),
    ]
    return tuple(_added([*_scaled(moulds.arranged, units), *own]))


def counts(array: Array) -> list[int]:
    """Return how many places hold each distinct unit, in the order of `Array.units`."""
    held = Counter(array.units.index(place.unit) for place in array.places)
    return [held[i] for i in range(len(array.units))]


def castings(count: int, unit: Procedure) -> int:
    """Return how often a unit's mould has to be filled for so many units."""
    return math.ceil(count / unit.cells)


def _pieces(moulds: PatchMoulds) -> Iterator[Item]:
    lengths = moulds.spec.moulds
    note = f"for the sheet: {lengths.printer}, layers of {number(lengths.layer_mm, 3)} mm"
    for tool in moulds.plan.pieces:
        attitude = "upside down" if tool.upside_down else "as drawn"
        yield Item(moulds.plan.called(tool.name), 1, "piece", f"printed {attitude}", note)


def _wires(array: Array) -> Iterator[Item]:
    """List the wires of the tails that end under the sheet, two for each: a motor has two poles."""
    if hidden := hidden_tails(array):
        longest = number(max(tail.short_mm for tail in hidden), 2)
        note = f"thin and insulated, two for each tail that ends under the sheet, at least {longest} mm and a connector"
        yield Item("lead wire", 2 * len(hidden), "piece", "bought", note)


def _scaled(array: Array, units: Mapping[str, Procedure]) -> Iterator[Item]:
    """Yield the lines of the units' bills for all units: their pieces once, what is used up as often as it is."""
    for spec, count, (folder, unit) in zip(array.units, counts(array), units.items(), strict=True):
        times = castings(count, unit)
        inside = {motor_name(spec), "flexible circuit", "wire"}
        for item in unit.bill:
            if item.made.startswith(("printed", "cut")):
                yield replace(item, note=f"for {folder}{f': {item.note}' if item.note else ''}")
            elif item.unit == "g":
                often = "1 casting" if times == 1 else f"{times} castings"
                yield replace(item, quantity=times * item.quantity, note=f"{folder}, {often}: {item.note}")
            elif item.item in inside:
                yield replace(item, quantity=count * item.quantity / unit.cells)
            elif item.made == "bought" and item.item not in ONCE:
                yield replace(item, quantity=times * item.quantity)
            else:
                yield item


def _added(items: Iterable[Item]) -> list[Item]:
    """Return a bill in which each thing stands once: what is used up is added, of what is reused the most is taken.

    A thing that is used up in two sizes has a line for each; of a tool in two sizes the larger one does.
    """
    found: dict[tuple[str, str, str], Item] = {}
    for item in items:
        once = item.item in ONCE or item.made == "tool"
        key = item.item, item.unit, "" if item.unit == "g" or once else item.note
        there = found.get(key)
        if there is None:
            found[key] = item
        elif item.unit == "g":
            quantity, note = there.quantity + item.quantity, f"{there.note}; {item.note}"
            found[key] = replace(there, quantity=quantity, note=note)
        elif item.made == "bought" and not once:
            found[key] = replace(there, quantity=there.quantity + item.quantity)
        else:
            larger = max(there, item, key=lambda each: each.least_ml or 0.0)
            found[key] = replace(larger, quantity=max(there.quantity, item.quantity))
    return list(found.values())
