"""One step of a procedure: instruction, picture, required tools, time; and steps added up."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

from unitcad.text import join_words, number


@dataclass(frozen=True)
class BenchStep:
    """One action of a person.

    title     two or three words
    text      the whole instruction
    picture   path of the picture of this state in the result's folder; "" if it shows nothing of the mould
    kind      addition of the bench page: fields for grams, the pot life's or the cure's timer
    minutes   a person's time at the bench
    wait_min  waiting time before the next step
    required_tools
              tools and consumables, by their names in `REQUIRED_TOOLS`
    short     the text if an earlier pour had the step too: its number and the differences; filled in by `number_steps`
    """

    title: str
    text: str
    picture: str = ""
    kind: Literal["", "weigh", "mix", "pour", "rest", "cure"] = ""
    minutes: float = 0.0
    wait_min: float = 0.0
    required_tools: tuple[str, ...] = ()
    short: str = ""


_SENTENCES = re.compile(r"(?<=[.!?]) (?=[A-Z])")
_COUNTED = re.compile(r"\b(cup|lid|layer|pour) \d+", re.IGNORECASE)
_MOST_NEW = 0.8
"""A step refers to an earlier one if its own words are a smaller share of its text."""


def number_steps(steps: Iterable[BenchStep]) -> list[BenchStep]:
    """Return the steps of a whole procedure, numbered from 1; repeated steps have a short text."""
    found: list[BenchStep] = []
    earlier: dict[str, list[tuple[int, set[str]]]] = {}

    def alike(text: str) -> str:
        return _COUNTED.sub(r"\1", text)

    for i, step in enumerate(steps, 1):
        sentences = _SENTENCES.split(step.text)
        before = earlier.setdefault(alike(step.title), [])
        rests = [(" ".join(each for each in sentences if alike(each) not in said), number) for number, said in before]
        own, first = min(rests, key=lambda rest: len(rest[0]), default=(step.text, 0))
        short = f"As step {first}{f', but: {own}' if own else '.'}" if len(own) < _MOST_NEW * len(step.text) else ""
        found.append(replace(step, short=short))
        before.append((i, {alike(each) for each in sentences}))
    return found


REQUIRED_TOOLS = {
    "sharp knife": ("piece", "tool", ""),
    "small scissors": ("piece", "tool", ""),
    "pin": ("piece", "tool", ""),
    "blunt spatula": ("piece", "tool", ""),
    "level": ("piece", "tool", ""),
    "spirit level": ("piece", "tool", "0.5 mm/m"),
    "paper": ("sheet", "tool", ""),
    "vice and two boards": ("set", "tool", ""),
    "pen": ("piece", "tool", ""),
    "cotton buds": ("set", "bought", ""),
    "small brush": ("piece", "tool", "for silicone"),
    "hand brush": ("piece", "tool", ""),
    "stiff card or plastic": ("strip", "cut", "strikes off where the blade can't pass"),
    "flat pliers": ("piece", "tool", ""),
    "narrow pliers": ("piece", "tool", "for filament in its pocket"),
    "soldering iron and solder": ("set", "tool", ""),
    "silicone adhesive": ("tube", "bought", "neutral-curing; or a primer and a smear of silicone"),
    "release agent": ("dab", "bought", "optional"),
    "adhesive tape": ("roll", "bought", ""),
    "wide adhesive tape": ("roll", "bought", "under the seams of split tools"),
    "petroleum jelly": ("dab", "bought", ""),
    "isopropanol and lint-free wipes": ("set", "bought", ""),
    "rinsing syringe": ("piece", "tool", ""),
    "oven": ("piece", "tool", "holds 60 degC; not one for food"),
    "curing lamp": ("piece", "tool", ""),
    "acrylic varnish": ("bottle", "bought", ""),
    "caliper": ("piece", "tool", ""),
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


def grams_of(procedure: Mapping[str, Any]) -> dict[str, float]:
    """Return the grams of each silicone to mix, of an array with pockets those of its units too."""
    grams: dict[str, float] = defaultdict(float)
    for item in procedure["bill"]:
        if item["unit"] == "g":
            grams[item["item"].removesuffix(" part A").removesuffix(" part B")] += item["quantity"]
    return dict(grams)


def casting_summary(procedure: Mapping[str, Any], files: Iterable[str] = ()) -> Iterator[str]:
    """Yield a line each: what to print and mix, when which part is ready, and warnings about a pour.

    `procedure` is a `Procedure` as plain data, as casting.json has it; `files` are the paths of the result, if they are
    known: pieces that have an STL and no plate in 3MF are printed from it.
    """
    total, bench = duration(procedure["earliest_finish_min"]), duration(procedure["bench_min"])
    pours, castings, mixes = procedure["pours"], procedure["castings"], procedure["later_mixes"]
    count = f"{len(pours)} pour{'s' if len(pours) > 1 else ''}"
    if castings:
        count = f"{castings} casting{'s' if castings > 1 else ''} of units and {count} of the sheet"
    then, after = "", procedure["assembly"]
    if after:
        mixed = f", with {mixes} more mix{'es' if mixes > 1 else ''}" if mixes else ""
        waits = ((each["wait_min"], each["title"]) for each in after if each["wait_min"])
        cures = [f"{duration(wait)} to {title[0].lower()}{title[1:]}" for wait, title in waits]
        later = duration(sum(each["minutes"] for each in after))
        then = (
            f" {procedure['last']}{mixed}: {later} more at the bench{f', then {join_words(cures)}' if cures else ''}."
        )
    printing = procedure["printing"]
    time, volume = duration(printing["minutes"]), number(printing["cm3"], 2)
    layers = f"layers {number(printing['layer_mm'], 3)}, first layer {number(printing['first_layer_mm'], 3)} mm"
    mix = ", ".join(f"{number(mass, 3)} g of {name}" for name, mass in grams_of(procedure).items())
    filament = f"about {time}, at most {volume} cm3 of {printing['of']}"
    plates, paths = printing["plates"], set(files)
    if any(path.endswith(".stl") for path in paths) and not paths.intersection(plates):
        plates = ["each STL of moulds/ (no 3MF was asked for)"]
    yield f"print {join_words(plates)}: {layers}; {filament}. Mix {mix}."
    yield f"{count}, {bench} at the bench. Out of the mould {total} after the print.{then}"
    yield from (f"warning: {line}" for line in pour_warnings(pours))


def pour_warnings(pours: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Yield the faults of pours, as casting.json has them: bubbles that stay, a pot life too short, values unknown."""
    for wrong, words in (
        ([pour for pour in pours if pour["bubbles_stay"]], "without a vacuum bubbles stay in"),
        ([pour for pour in pours if pour["over_pot_life_min"] > 0], "mixing and pouring outlast the pot life in"),
    ):
        if wrong:
            named = join_words([f"pour {pour['index']} ({pour['material']})" for pour in wrong])
            yield f"{words} {named}; casting.md says what to do"
    for pour in pours:
        if pour["unknown"]:
            lacks = join_words(pour["unknown"])
            yield f"no source gives the {lacks} of {pour['material']}, pour {pour['index']}: read its data sheet"
