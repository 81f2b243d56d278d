"""The width of plane sections of meshes."""

from __future__ import annotations

from manifold3d import CrossSection, JoinType

FINENESS = 1e-3
"""Accuracy of the widest circle's diameter, mm."""


def widest(section: CrossSection) -> tuple[float, tuple[float, float]]:
    """Return the diameter of the largest circle that fits into a section, and a centre for it (mm).

    By bisection over inward offsets, mitred, so that a corner does not count as a rounded one. 0 for an empty section.
    """
    if section.is_empty():
        return 0.0, (0.0, 0.0)
    x0, y0, x1, y1 = section.bounds()
    low, high, kept = 0.0, min(x1 - x0, y1 - y0) / 2, section
    while high - low > FINENESS / 4:
        middle = (low + high) / 2
        inner = section.offset(-middle, JoinType.Miter)
        if inner.is_empty():
            high = middle
        else:
            low, kept = middle, inner
    # Any corner of the last offset lies that deep; the mean of its corners would not, were it a ring.
    corner = min(tuple(map(float, point)) for loop in kept.to_polygons() for point in loop)
    return 2 * low, (corner[0], corner[1])
