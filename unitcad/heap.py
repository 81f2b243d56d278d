"""Memory of a process that loads much and lives shortly: freed memory is kept, cycles of objects are sought seldom."""

from __future__ import annotations

import gc
import sys

_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3  # of mallopt(3)
_MOST = 1 << 30
_ALLOCATIONS = 200_000  # by Python's default of 700, modules that load are searched ninety times


def seek_cycles_seldom() -> None:
    """Have Python seek cycles of objects that nothing refers to after more allocations; before modules are loaded."""
    gc.set_threshold(_ALLOCATIONS)


def keep_freed_memory() -> None:
    """Keep freed memory for the next arrays, pieces up to 1 GiB each; with glibc only.

    The library returns large pieces as soon as they are free. The system clears each page that comes anew, and arrays
    of a megabyte that come and go cost more in cleared pages than in sums. The process's peak is what it was.
    """
    if sys.platform == "linux":
        import ctypes  # which a command without arrays does without

        mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
        if mallopt:  # musl has none
            mallopt(_MMAP_THRESHOLD, _MOST)
            mallopt(_TRIM_THRESHOLD, _MOST)
