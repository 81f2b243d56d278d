"""Work in parts that a copy of this process shares.

A copy (fork) has all that this process has, so only results are sent. Threads gain little here: calls on small arrays
wait for the one interpreter, those on large ones for the one table of memory. Copies are made where the program says
so, the command line's `check`: a copy of a process with unknown threads could wait for what one of them held.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import signal
import sys
import warnings
from collections.abc import Callable, Iterator
from contextvars import ContextVar
from typing import TypeVar

from unitcad.children import cores, end_with_parent

T = TypeVar("T")
MOST_PARTS = 256
_ALLOWED: ContextVar[bool] = ContextVar("two_cores", default=False)


@contextlib.contextmanager
def two_cores() -> Iterator[None]:
    """Let `shared` use a second core, where there is one, within the block."""
    before = _ALLOWED.set(cores() > 1)
    try:
        yield
    finally:
        _ALLOWED.reset(before)


def shared(
    work: Callable[[int], T], n: int, *, large: bool = True, first: Callable[[], object] = lambda: None
) -> list[T]:
    """Return `work` of 0 to n - 1 (at most MOST_PARTS), in that order; raises what it raises.

    On Linux, within `two_cores`, a copy of this process does what it gets to before this one, if the work is `large`.
    What it did not bring back, since it failed or was killed, is done here, and so is what comes `first`.
    """
    assert n <= MOST_PARTS
    if sys.platform != "linux" or n < 2 or not large or not _ALLOWED.get():
        first()
        return [work(k) for k in range(n)]
    places, filling = os.pipe()
    os.write(filling, bytes(range(n)))  # a byte a part: who reads it does it
    os.close(filling)
    answers, sending = os.pipe()
    copy = 0
    done: dict[int, T] = {}
    try:
        # No memory or no process left for a copy: this one reads all places.
        with warnings.catch_warnings(), contextlib.suppress(OSError):
            warnings.simplefilter("ignore", DeprecationWarning)  # of numpy's BLAS threads: nothing here waits for them
            copy = os.fork()
            if copy == 0:
                _answer(work, places, sending)
        os.close(sending)
        first()
        for k in _claimed(places):
            done[k] = work(k)
        with open(answers, "rb", closefd=False) as sent, contextlib.suppress(EOFError, pickle.UnpicklingError):
            done |= pickle.load(sent)
        return [done[k] if k in done else work(k) for k in range(n)]
    finally:
        os.close(places)
        os.close(answers)
        if copy:
            os.kill(copy, signal.SIGKILL)  # it holds nothing that must be written
            os.waitpid(copy, 0)


def _claimed(places: int) -> Iterator[int]:
    """Yield parts that nobody else does."""
    while claim := os.read(places, 1):
        yield claim[0]


def _answer(work: Callable[[int], object], places: int, sending: int) -> None:
    """Do parts in the copy, send their results together once none is left, and end."""
    try:
        end_with_parent()
        done = {}
        with contextlib.suppress(Exception):
            for k in _claimed(places):
                done[k] = work(k)
        with open(sending, "wb") as pipe:
            pickle.dump(done, pipe, pickle.HIGHEST_PROTOCOL)
    finally:
        os._exit(0)
