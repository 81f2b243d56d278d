"""Functions that the tests of `unitcad.workers` call in a worker."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import time

from unitcad import workers
from unitcad.errors import Refusal


def pid() -> int:
    return os.getpid()


def die() -> None:
    os.kill(os.getpid(), signal.SIGSEGV)


def sleep(seconds: float) -> int:
    time.sleep(seconds)
    return os.getpid()


def hold_lock(seconds: float) -> None:
    """Sleep in C, and hold the interpreter's lock."""
    ctypes.PyDLL(None).sleep(int(seconds))


def limited(seconds: float) -> None:
    with workers.limit(seconds):
        hold_lock(60)


def fill(size: int) -> int:
    return len(bytearray(size))


def boom() -> None:
    raise ValueError("boom")


def refuse() -> None:
    raise Refusal("wall_mm", 9, "is too thick", 2)


def leave() -> None:
    sys.exit(3)


def chatter(count: int) -> int:
    for i in range(count):
        workers.tell(i)
    return count


def nested() -> None:
    with workers.Pool(2) as pool:
        calls = [pool.submit(hold_lock, 100) for _ in range(2)]
        calls[0].result()


class Local(Exception):
    """An exception that pickles and does not come back."""

    def __init__(self, first: str, second: str) -> None:
        super().__init__(first)


def unpicklable() -> None:
    raise Local("a", "b")
