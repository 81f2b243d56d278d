"""Connected components of a graph. Only large ones need scipy, which takes longer to load than others take."""

from __future__ import annotations

import sys

import numpy as np

from unitcad.geometry.arrays import Ints, by_appearance
from unitcad.lean_import import postpone_tools

_SMALL = 6_000_000


def scipy_pays(n: int) -> bool:
    """Return whether scipy pays for `n` rows: to load it takes 0.2 s, what it saves 0.1 s a million rows."""
    return n > _SMALL or "scipy.sparse.csgraph" in sys.modules


def components(n: int, left: Ints, right: Ints) -> Ints:
    """Return the component of each of `n` nodes joined by pairs, numbered in the order of their first node."""
    if scipy_pays(n):
        postpone_tools()
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components

        graph = coo_array((np.ones(len(left)), (left, right)), shape=(n, n))
        return connected_components(graph, directed=False)[1]
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
