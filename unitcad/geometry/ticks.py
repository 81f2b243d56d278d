"""Ending a long computation from outside."""

from __future__ import annotations

from collections.abc import Callable

Tick = Callable[[], object]
"""A function that a long computation calls now and then; it may raise `Interrupted`."""


class Interrupted(Exception):
    """A computation that a tick has ended; its results so far may still be of use."""


class TooMany(Interrupted):
    """A computation that would have to look at more pairs than there is time or memory for."""

    def __init__(self, most: int, noun: str) -> None:
        super().__init__(f"more than {most} pairs of {noun} lie at each other; not all are compared")
