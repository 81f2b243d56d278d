"""Lengths of plane sections of meshes: the widest circle in one, the gap between two."""

from __future__ import annotations

from manifold3d import CrossSection, JoinType

from unitcad.geometry.outline_gaps import between_outlines
from unitcad.shape.profile import FACETS

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
    # Any corner of the last offset is that deep; the mean of its corners would not, were it a ring.
    corner = min(tuple(map(float, point)) for loop in kept.to_polygons() for point in loop)
    return 2 * low, (corner[0], corner[1])


def thick_parts(section: CrossSection, least: float = FACETS) -> list[CrossSection]:
    """Return the connected parts of a section that are wider than the films of facets or rounding between two faces."""
    return [part for part in section.decompose() if not part.offset(-least / 2, JoinType.Miter).is_empty()]


def gap(one: CrossSection, other: CrossSection, most: float) -> float:
    """Return the least distance between two sections, neither empty, mm: 0 if they overlap, `most` at most."""
    if not (one ^ other).is_empty():
        return 0.0
    return between_outlines(one.to_polygons(), other.to_polygons(), most)
