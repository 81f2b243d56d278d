"""Functions that the tests of `unitcad.workers` call in a worker."""

import ctypes
import os
import signal
import sys
import time

from unitcad import workers
from unitcad.errors import Refusal


def pid():
    return os.getpid()


def die():
    os.kill(os.getpid(), signal.SIGSEGV)


def sleep(seconds):
    time.sleep(seconds)
    return os.getpid()


def hold_lock(seconds):
    """Sleep in C, and hold the interpreter's lock."""
    ctypes.PyDLL(None).sleep(int(seconds))


def limited(seconds):
    with workers.limit(seconds):
        hold_lock(60)


def fill(size):
    return len(bytearray(size))


def boom():
    raise ValueError("boom")


def refuse():
    raise Refusal("wall_mm", 9, "is too thick", 2)


def leave():
    sys.exit(3)


def chatter(count):
    for i in range(count):
        workers.tell(i)
    return count


def nested():
    with workers.Pool(2) as pool:
        calls = [pool.submit(hold_lock, 100) for _ in range(2)]
        calls[0].result()


class Local(Exception):
    """An exception that pickles and does not come back."""

    def __init__(self, first, second):
        super().__init__(first)


def unpicklable():
    raise Local("a", "b")
