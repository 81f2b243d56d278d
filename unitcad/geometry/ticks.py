"""How a long computation is ended from outside."""

from __future__ import annotations

from collections.abc import Callable

Tick = Callable[[], object]
"""Called now and then by what may take long; it may raise `Interrupted`."""


class Interrupted(Exception):
    """A computation that a tick has ended; what it had worked out by then may still be of use."""
