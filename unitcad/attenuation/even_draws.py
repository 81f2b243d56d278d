"""Uniform numbers that are spread evenly, the same on any machine for the same seed, name and count."""

from __future__ import annotations

import zlib
from functools import lru_cache

import numpy as np


@lru_cache(maxsize=1024)
def positions(seed: int, name: str, count: int) -> np.ndarray:
    """Return `count` numbers between 0 and 1, shape (count,), not to be written to.

    Those of even and those of odd index are a Latin hypercube each: one number in each of as many equal intervals, so
    that two groups which alternate are spread evenly by themselves. Every name has a stream of its own: a new name
    changes no other.
    """
    rng = np.random.default_rng([seed, zlib.crc32(name.encode()), count])
    found = rng.random(count)
    for group in range(min(2, count)):
        own = found[group::2]
        own[:] = (rng.permutation(len(own)) + own) / len(own)
    found.flags.writeable = False
    return found


def position(seed: int, name: str, index: int) -> float:
    """Return a number between 0 and 1 that is independent of those of any other index, name or seed."""
    return float(np.random.default_rng([seed, index, zlib.crc32(name.encode())]).random())
