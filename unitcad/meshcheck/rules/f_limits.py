"""What a check may spend: bytes, faces, seconds. Reaching a limit is finding F011, never a pass."""

from __future__ import annotations

import contextlib
import os
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

from unitcad.geometry.ticks import TooMany
from unitcad.meshcheck.findings import Facts, Finding, Unreadable, counted
from unitcad.meshcheck.rules.rule import Rule

F011 = Rule("""
    F011 error: resource limit reached
    The file asks for more bytes, faces, time or memory than the limits allow, or has too many pairs of faces that lie
    at each other, so it was not checked to its end. It never passes. What was found by then is reported.
    Example: A mesh has 12 million faces, and --max-faces is 10 million.
    Fix: If the file is meant to be so large, raise the limit that the message names: --timeout, --max-faces or
    --memory, of which a file may take a quarter. Limits without an option, such as 4 GB a file and 100,000 instances of
    a 3MF, are fixed.
""")


_FILE_SHARE = 0.25  # of the memory: what is made of a file on the way takes several times its size


@dataclass(frozen=True)
class Limits:
    """Bounds on one file.

    `seconds` is wall time. `ratio` is inflated over packed size of a zip entry. `max_instances` is what a 3MF or GLB
    may place, counted before it is expanded.
    """

    max_faces: int = 10_000_000
    max_bytes: int = 4_000_000_000
    max_package_bytes: int = 2_000_000_000
    max_entries: int = 10_000
    max_instances: int = 100_000
    max_depth: int = 64
    ratio: float = 1000.0
    seconds: float = 600.0

    def check_bytes(self, n: int) -> None:
        """Raise `Unreadable` (F011) for a file of more bytes than `max_bytes`, or than a part of the memory."""
        memory = _memory()
        if n > self.max_bytes:
            raise F011.unreadable(f"{n} bytes, more than the limit of {self.max_bytes}")
        if memory is not None and n > memory * _FILE_SHARE:
            raise F011.unreadable(
                f"{n} bytes, more than a quarter of the {memory // 1_000_000} MB of memory (--memory)"
            )

    def check_faces(self, n: int) -> None:
        """Raise `Unreadable` (F011) for more faces than `max_faces`."""
        if n > self.max_faces:
            raise F011.unreadable(f"{counted(n, 'face')}, more than --max-faces {self.max_faces}")


def _memory() -> int | None:
    """Return the bytes of memory that this process may have, or None if that is not known (Windows)."""
    try:
        import resource

        limit, there = (
            resource.getrlimit(resource.RLIMIT_AS)[0],
            os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"),
        )
    except (ImportError, ValueError, OSError):
        return None
    return there if limit < 0 else min(limit, there)


class OutOfTime(Unreadable):
    """The time is up: no fault of the part that was being read, so nothing is concluded from it."""

    def __init__(self, seconds: float) -> None:
        super().__init__(F011.finding(f"not finished within --timeout {seconds:g} s"))
        self.seconds = seconds

    def __reduce__(self) -> tuple[type[OutOfTime], tuple[float]]:
        return OutOfTime, (self.seconds,)


class Deadline:
    """A clock that ends a check."""

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds
        self._end = time.monotonic() + seconds

    def tick(self) -> None:
        """Raise `OutOfTime` (F011) after the last second."""
        if time.monotonic() > self._end:
            raise OutOfTime(self.seconds)


@contextlib.contextmanager
def keeping(
    findings: Sequence[Finding] = (),
    facts: Facts | None = None,
    change: Callable[[Iterable[Finding]], Iterable[Finding]] = iter,
) -> Iterator[None]:
    """Put the findings by then, and the facts, beside what ends the check inside; `change` all of them.

    Raises `Unreadable`, with F011 where memory runs out, pairs are too many or calls nest too deeply.
    """
    try:
        yield
    except (Unreadable, TooMany, MemoryError, RecursionError) as error:
        if isinstance(error, Unreadable):
            stop = error
        elif isinstance(error, TooMany):
            stop = F011.unreadable(str(error))
        else:
            why = "out of memory (--memory)" if isinstance(error, MemoryError) else "nested too deeply"
            stop = F011.unreadable(why)
        stop.findings = tuple(change((*findings, *stop.findings)))
        if facts is not None and stop.facts == Facts():
            stop.facts = facts
        raise stop from None
