"""One step of a procedure: what to do, what it looks like, how long it takes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Kind = Literal["", "weigh", "mix", "pour", "rest", "cure"]


@dataclass(frozen=True)
class BenchStep:
    """What a person does at once.

    title     two or three words
    text      the whole instruction
    picture   path of the picture of this state in the result's folder; "" where nothing of the mould is to be seen
    kind      what the bench page adds to it: fields for grams, the pot life's or the cure's timer
    minutes   a person's time at the bench
    wait_min  what passes after it before the next step
    """

    title: str
    text: str
    picture: str = ""
    kind: Kind = ""
    minutes: float = 0.0
    wait_min: float = 0.0
