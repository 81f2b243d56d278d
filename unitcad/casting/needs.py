"""The tools and consumables that the steps' words name: what the bill must list."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache

from unitcad.casting.bench_step import BenchStep


@dataclass(frozen=True)
class Need:
    """A line of the bill, there where a step's words match `words` (a regular expression, in lower case)."""

    words: str
    item: str
    quantity: float
    unit: str
    made: str
    note: str


NEEDS = (
    Need(r"\bknife", "sharp knife", 1, "piece", "tool", "for flash, sprues and filament"),
    Need(r"\bscissors", "small scissors", 1, "piece", "tool", "to trim"),
    Need(r"\bpin\b", "pin", 1, "piece", "tool", "for bubbles"),
    Need(r"\bspatula", "blunt spatula", 1, "piece", "tool", "loosens what sticks, from its edge"),
    Need(r"\blevel, or a small spirit level", "level", 1, "piece", "tool", "a phone shows it too"),
    Need(r"\bpaper\b", "paper", 1, "sheet", "bought", "under corners, and to feel slits with"),
    Need(r"\bvice\b", "vice and two boards", 1, "set", "tool", "where the hand can't press a cup on"),
    Need(r"\bpen\b", "pen", 1, "piece", "tool", "marks the tongue"),
    Need(r"\bcotton bud", "cotton buds", 1, "set", "bought", "dry, for grease in the bore"),
    Need(r"\bbrush a thin coat", "small brush", 1, "piece", "tool", "for the first coat of silicone"),
    Need(r"\bbrush off", "hand brush", 1, "piece", "tool", "for strings and loose bits"),
    Need(r"strip of stiff card", "stiff card or plastic", 1, "strip", "cut", "strikes off where the blade can't pass"),
    Need(r"\bflat pliers", "flat pliers", 1, "piece", "tool", "to pull cut tongues"),
    Need(r"\bwith pliers", "narrow pliers", 1, "piece", "tool", "to pull filament out of its pocket"),
    Need(r"\bsolder (the|on|wires)", "soldering iron and solder", 1, "set", "tool", "joins motors, circuits and wires"),
    Need(r"release agent, if any", "release agent", 1, "dab", "bought", "inside the last cup alone; may be left out"),
    Need(r"tape over the underside", "wide adhesive tape", 1, "roll", "bought", "under the seams of split tools"),
    Need(r"petroleum jelly|\bgrease the", "petroleum jelly", 1, "dab", "bought", "only where a step says so"),
    Need(
        r"isopropanol", "isopropanol and lint-free wipes", 1, "set", "bought", "cleans cured layers and printed resin"
    ),
    Need(r"syringe of isopropanol", "rinsing syringe", 1, "piece", "tool", "for the windows; not used for silicone"),
    Need(r"\boven\b", "oven", 1, "piece", "tool", "holds 60 degC; not one for food"),
    Need(r"post-cure", "curing lamp", 1, "piece", "tool", "as the resin's maker says"),
    Need(r"varnish", "acrylic varnish", 1, "bottle", "bought", "only where the cure test is tacky"),
)


def needs(steps: Iterable[BenchStep]) -> list[Need]:
    """Return what the steps name, in the table's order."""
    named = frozenset().union(*(_named(step.text) for step in steps))
    return [need for need in NEEDS if need in named] + [CALIPER]


@lru_cache(maxsize=512)
def _named(text: str) -> frozenset[Need]:
    """Return what a step's words name: in a batch most steps are said again and again."""
    return frozenset(need for need in NEEDS if re.search(need.words, text.lower()))


CALIPER = Need("", "caliper", 1, "piece", "tool", "to measure with")
