"""Ending a long computation from outside."""

from __future__ import annotations

from collections.abc import Callable

Tick = Callable[[], object]
"""A function that a long computation calls now and then; it may raise `Interrupted`."""


class Interrupted(Exception):
    """A computation that a tick has ended; what it has computed may still be of use."""
