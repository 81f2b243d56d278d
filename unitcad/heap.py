"""The C library's heap, which keeps what arrays leave instead of giving it back to the system."""

from __future__ import annotations

import ctypes
import sys

_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3  # of mallopt(3)
_MOST = 1 << 30


def keep_freed_memory() -> None:
    """Keep freed memory for the next arrays, pieces up to 1 GiB each; with glibc only.

    The library returns large pieces as soon as they are free. The system clears each page that comes anew, and arrays
    of a megabyte that come and go cost more in cleared pages than in sums. The process's peak is what it was.
    """
    if sys.platform == "linux":
        mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
        if mallopt:  # musl has none
            mallopt(_MMAP_THRESHOLD, _MOST)
            mallopt(_TRIM_THRESHOLD, _MOST)
