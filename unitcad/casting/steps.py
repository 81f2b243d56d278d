"""One step of a procedure: what to do, what it looks like, what it needs, how long it takes; and steps added up."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

from unitcad.text import listed, number


@dataclass(frozen=True)
class BenchStep:
    """What a person does at once.

    title     two or three words
    text      the whole instruction
    picture   path of the picture of this state in the result's folder; "" where nothing of the mould is to be seen
    kind      what the bench page adds to it: fields for grams, the pot life's or the cure's timer
    minutes   a person's time at the bench
    wait_min  what passes after it before the next step
    needs     tools and consumables that it takes, by their names in `NEEDS`
    """

    title: str
    text: str
    picture: str = ""
    kind: Literal["", "weigh", "mix", "pour", "rest", "cure"] = ""
    minutes: float = 0.0
    wait_min: float = 0.0
    needs: tuple[str, ...] = ()


NEEDS = {
    "sharp knife": ("piece", "tool", "for flash, sprues and filament"),
    "small scissors": ("piece", "tool", "to trim"),
    "pin": ("piece", "tool", "for bubbles"),
    "blunt spatula": ("piece", "tool", "loosens what sticks, from its edge"),
    "level": ("piece", "tool", "a phone shows it too"),
    "paper": ("sheet", "bought", "under corners, and to feel slits with"),
    "vice and two boards": ("set", "tool", "where the hand can't press a cup on"),
    "pen": ("piece", "tool", "marks the tongue"),
    "cotton buds": ("set", "bought", "dry, for grease in the bore"),
    "small brush": ("piece", "tool", "for the first coat of silicone"),
    "hand brush": ("piece", "tool", "for strings and loose bits"),
    "stiff card or plastic": ("strip", "cut", "strikes off where the blade can't pass"),
    "flat pliers": ("piece", "tool", "to pull cut tongues"),
    "narrow pliers": ("piece", "tool", "to pull filament out of its pocket"),
    "soldering iron and solder": ("set", "tool", "joins motors, circuits and wires"),
    "release agent": ("dab", "bought", "inside the last cup alone; may be left out"),
    "wide adhesive tape": ("roll", "bought", "under the seams of split tools"),
    "petroleum jelly": ("dab", "bought", "only where a step says so"),
    "isopropanol and lint-free wipes": ("set", "bought", "cleans cured layers and printed resin"),
    "rinsing syringe": ("piece", "tool", "for the windows; not used for silicone"),
    "oven": ("piece", "tool", "holds 60 degC; not one for food"),
    "curing lamp": ("piece", "tool", "as the resin's maker says"),
    "acrylic varnish": ("bottle", "bought", "only where the cure test is tacky"),
    "caliper": ("piece", "tool", "to measure with"),
}
"""Unit, how it is made, and a note, of each thing that steps need one of, in the bill's order; the last one always."""


@dataclass(frozen=True)
class Phase:
    """A stretch of work and the wait after it, minutes: `start_min` counts from the first step of all."""

    name: str
    start_min: float
    bench_min: float
    wait_min: float

    @property
    def end_min(self) -> float:
        """When it is over."""
        return self.start_min + self.bench_min + self.wait_min


def phases(stages: Iterable[tuple[str, Sequence[BenchStep]]]) -> tuple[Phase, ...]:
    """Return the phases of named stages: a cure ends one, since a person may leave meanwhile; shorter waits don't."""
    found: list[Phase] = []
    clock = 0.0
    for name, steps in stages:
        bench, wait, label = 0.0, 0.0, name
        for i, step in enumerate(steps, 1):
            bench, wait = bench + step.minutes, wait + step.wait_min
            if step.kind == "cure" or i == len(steps):
                found.append(Phase(label, clock, bench, wait))
                label = f"{name}: {'open' if any(step.kind == 'pour' for step in steps) else 'go on'}"
                clock, bench, wait = clock + bench + wait, 0.0, 0.0
    return tuple(found)


def duration(minutes: float) -> str:
    """Return minutes as "20 h 40 min", beyond two days as "3 days 20 h"."""
    hours, rest = divmod(round(minutes), 60)
    if 60 * hours + rest > 48 * 60:
        days, hours = divmod(round(minutes / 60), 24)
        return f"{days} days {hours} h" if hours else f"{days} days"
    return f"{hours} h {rest} min" if hours and rest else f"{hours} h" if hours else f"{rest} min"


def in_short(procedure: Mapping[str, Any]) -> Iterator[str]:
    """Yield a line each: pours and times, what to mix, and what goes wrong in a pour.

    `procedure` is a `Procedure` as plain data, as casting.json has it.
    """
    grams: dict[str, float] = defaultdict(float)
    for item in procedure["bill"]:  # the pours' own, and of an array with pockets those of the units
        if item["unit"] == "g":
            grams[item["item"].removesuffix(" part A").removesuffix(" part B")] += item["quantity"]
    total, bench = duration(procedure["earliest_finish_min"]), duration(procedure["bench_min"])
    pours = procedure["pours"]
    count = f"{len(pours)} pour{'s' if len(pours) > 1 else ''}"
    yield f"{count}, ready {total} after the print, of which {bench} at the bench"
    yield "to mix: " + ", ".join(f"{number(mass, 3)} g of {name}" for name, mass in grams.items())
    yield from (f"warning: {line}" for line in pour_warnings(pours))


def pour_warnings(pours: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Yield the faults of pours, as casting.json has them: bubbles that stay, a pot life that is too short."""
    for wrong, words in (
        ([pour for pour in pours if pour["bubbles_stay"]], "without a vacuum bubbles stay in"),
        ([pour for pour in pours if pour["over_pot_life_min"] > 0], "mixing and pouring outlast the pot life in"),
    ):
        if wrong:
            named = listed([f"pour {pour['index']} ({pour['material']})" for pour in wrong])
            yield f"{words} {named}; casting.md says what to do"
