"""Connected components of a graph."""

from __future__ import annotations

import numpy as np

from unitcad.geometry.arrays import Ints, by_appearance


def components(n: int, left: Ints, right: Ints) -> Ints:
    """Return the component of each of `n` nodes joined by pairs, numbered in the order of their first node."""
    root = np.arange(n, dtype=np.int32)
    while True:
        a, b = root.take(left), root.take(right)
        apart = np.flatnonzero(a != b)
        if not len(apart):
            break
        left, right, a, b = left.take(apart), right.take(apart), a.take(apart), b.take(apart)
        np.minimum.at(root, np.maximum(a, b), np.minimum(a, b))
        while True:
            above = root.take(root)
            if np.array_equal(above, root):
                break
            root = above
    return by_appearance(root, n)[1]  # each component's root is its first node
