"""Signs of determinants that are never wrong: a float filter with an error bound, exact arithmetic for what it leaves.

orient3d(a, b, c, d) is the sign of det(a - d, b - d, c - d): positive where d lies below the plane through a, b, c
(seen so that a, b, c turn anticlockwise), zero where all four are coplanar. The filter's bound is Shewchuk's (1997),
for differences that are rounded themselves.

What the filter leaves is small beside its terms. In whole numbers, 64-bit arithmetic gives it modulo 2**64; where the
bound says that it is less than half of that, it is known. Elsewhere pairs of floats (Dekker, 1971) narrow the bound.
Python's integers decide the rest: coordinates of very different size.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from unitcad.geometry.arrays import Bools, Floats, Ints

_EPS = np.finfo(np.float64).eps / 2
_BOUND = {2: (3.0 + 16.0 * _EPS) * _EPS, 3: (7.0 + 56.0 * _EPS) * _EPS}  # of the sum of the terms' sizes, by axes
_PAIR_BOUND = 64 * _EPS * _EPS  # the same for pairs: at most five operations in a row, each off by 8 EPS**2 at most
_TINY = 1e-270  # more than underflow takes from a determinant of coordinates that fit single precision
_HALF = 2.0**62
_ZERO = 10_000  # stands for the exponent of the lowest bit of 0
_BLOCK = 1 << 13  # rows whose intermediate values stay in the processor's cache


def orient3d(a: Floats, b: Floats, c: Floats, d: Floats) -> Ints:
    """Return the sign of orient3d for each row of four (n, 3) arrays, int8."""
    return _signs(a, b, c, d)


def orient2d(a: Floats, b: Floats, c: Floats) -> Ints:
    """Return the sign of the area of each triangle a, b, c in the plane, (n, 2) arrays: positive anticlockwise."""
    return _signs(a, b, c)


def orient2d_columns(a: Floats, b: Floats, c: Floats) -> Ints:
    """Return what `orient2d` does, for points by axis: (2, n) arrays."""
    (ax, ay), (bx, by) = a - c, b - c
    left, right = ax * by, ay * bx
    value = left - right
    size = np.abs(left, out=left)
    size += np.abs(right, out=right)
    return _sure((a, b, c), value, size)


def sides(a: Floats, b: Floats) -> Ints:
    """Return the side of the plane of each triangle `a` that each corner of `b` lies on: int8 (corner, n).

    Both are (corner, axis, n). Positive where `a` is seen anticlockwise; zero for all corners where `a` has no area.
    """
    one, two = a[1] - a[0], a[2] - a[0]
    normal, size = np.empty_like(one), np.empty_like(one)
    for axis in range(3):
        y, z = (axis + 1) % 3, (axis + 2) % 3
        left, right = one[y] * two[z], one[z] * two[y]
        np.subtract(left, right, out=normal[axis])
        np.add(np.abs(left, out=left), np.abs(right, out=right), out=size[axis])
    sign = np.empty((3, a.shape[2]), np.int8)
    for k in range(3):
        offset = b[k] - a[0]
        value = offset[0] * normal[0] + offset[1] * normal[1] + offset[2] * normal[2]
        np.abs(offset, out=offset)
        terms = offset[0] * size[0] + offset[1] * size[1] + offset[2] * size[2]
        sign[k] = _sure((b[k], a[1], a[2], a[0]), value, terms)
    return sign


def _orient3d_columns(a: Floats, b: Floats, c: Floats, d: Floats) -> Ints:
    """Return what `orient3d` does, for points by axis: (3, n) arrays."""
    rows = np.stack([a - d, b - d, c - d])
    value = _determinant(rows)
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = np.abs(rows, out=rows)
    size = az * (bx * cy + cx * by) + bz * (cx * ay + ax * cy) + cz * (ax * by + bx * ay)
    return _sure((a, b, c, d), value, size)


def _sure(points: Sequence[Floats], value: Floats, size: Floats) -> Ints:
    """Return the signs of determinants: of their values (n,), or exact where these are too small beside `size`.

    `size`: the sum of the sizes of a determinant's terms; points: (axes, n) arrays.
    """
    sign = np.sign(value).astype(np.int8)
    unsure = np.flatnonzero(np.abs(value) <= _BOUND[len(points) - 1] * size + _TINY)
    if len(unsure):
        sign[unsure] = _exact(np.stack([point.take(unsure, axis=1) for point in points]), size[unsure])
    return sign


def _signs(*points: Floats) -> Ints:
    of = orient2d_columns if len(points) == 3 else _orient3d_columns
    sign = np.empty(len(points[0]), np.int8)
    for start in range(0, len(sign), _BLOCK):
        sign[start : start + _BLOCK] = of(*(np.ascontiguousarray(point[start : start + _BLOCK].T) for point in points))
    return sign


def _determinant(rows: Any) -> Any:
    """Return the determinant of rows[i][axis], floats, whole numbers or pairs."""
    if len(rows) == 2:
        (ax, ay), (bx, by) = rows
        return ax * by - ay * bx
    (ax, ay, az), (bx, by, bz), (cx, cy, cz) = rows
    return az * (bx * cy - cx * by) + bz * (cx * ay - ax * cy) + cz * (ax * by - bx * ay)


def _exact(points: Floats, size: Floats) -> Ints:
    """Return signs of the determinants of points (axes + 1, axes, n) that the filter leaves; `size` as in `_sure`."""
    sign = np.zeros(len(size), np.int8)
    same = points == points[-1]
    left = np.flatnonzero(
        ~(same.all(axis=0).any(axis=0) | same[:-1].all(axis=1).any(axis=0))
    )  # else two lines are zero
    points, size = points.take(left, axis=2), size[left]
    known, signs = _modular(points, 2 * (_BOUND[points.shape[1]] * size + _TINY))
    sign[left[known]] = signs
    if known.all():
        return sign
    left, points, size = left[~known], points.compress(~known, axis=2), size[~known]
    value = _determinant([[_Pair.difference(x, y) for x, y in zip(p, points[-1], strict=True)] for p in points[:-1]])
    bound = _PAIR_BOUND * size + _TINY
    sign[left] = np.sign(value.high)
    unsure = np.flatnonzero(np.abs(value.high) <= bound)
    left, points, bound = left[unsure], points.take(unsure, axis=2), bound[unsure]
    known, signs = _modular(points, 2 * bound)
    sign[left[known]] = signs
    if not known.all():
        whole = integers(points.compress(~known, axis=2))
        sign[left[~known]] = np.sign(_determinant(whole[:-1] - whole[-1])).astype(np.int8)
    return sign


def _modular(points: Floats, bound: Floats) -> tuple[Bools, Ints]:
    """Return which determinants, at most `bound`, 64-bit whole numbers hold, and the signs of those."""
    lowest = _lowest_bits(points).min(axis=(0, 1), initial=_ZERO)
    with np.errstate(over="ignore", invalid="ignore"):  # what overflows is not held
        scaled = points * np.ldexp(1.0, -lowest)
        known = np.ldexp(bound, -points.shape[1] * lowest) < _HALF
        known &= np.abs(scaled).max(axis=(0, 1), initial=0) < _HALF
    whole = (scaled if known.all() else scaled.compress(known, axis=2)).astype(np.int64)
    return known, np.sign(_determinant(whole[:-1] - whole[-1])).astype(np.int8)


def _lowest_bits(values: Floats) -> Ints:
    """Return the exponent of each float's lowest bit that is set, as in 2**exponent; _ZERO for 0."""
    mantissa, exponent = np.frexp(values)
    digits = (mantissa * 2.0**53).astype(np.int64)
    lowest = np.frexp((digits & -digits).astype(np.float64))[1] + exponent - 54
    return np.where(digits == 0, _ZERO, lowest)


def integers(values: Floats) -> np.ndarray:
    """Return the floats times one power of two that makes them all whole, as Python's integers."""
    mantissa, exponent = np.frexp(values)
    digits = (mantissa * 2.0**53).astype(np.int64)
    shift = np.where(digits == 0, 0, exponent - exponent.min(initial=_ZERO, where=digits != 0))
    return digits.astype(object) << shift.astype(object)


class _Pair:
    """Numbers as sums high + low, low at most half the last bit of high; sums and products are off by 8 EPS**2."""

    def __init__(self, high: Floats, low: Floats) -> None:
        self.high = high + low
        self.low = low - (self.high - high)

    @classmethod
    def difference(cls, a: Floats, b: Floats) -> _Pair:
        """Return the difference of two floats, exact (Shewchuk 1997, two-diff)."""
        high = a - b
        virtual = a - high
        return cls(high, (a - (high + virtual)) + (virtual - b))

    def __neg__(self) -> _Pair:
        return _Pair(-self.high, -self.low)

    def __sub__(self, other: _Pair) -> _Pair:
        return self + -other

    def __add__(self, other: _Pair) -> _Pair:
        high = self.high + other.high
        virtual = high - self.high
        return _Pair(high, (self.high - (high - virtual)) + (other.high - virtual) + (self.low + other.low))

    def __mul__(self, other: _Pair) -> _Pair:
        product = self.high * other.high
        (a, b), (c, d) = _halves(self.high), _halves(other.high)
        rest = b * d - (((product - a * c) - b * c) - a * d)  # exact (Dekker's product)
        return _Pair(product, rest + (self.high * other.low + self.low * other.high))


def _halves(value: Floats) -> tuple[Floats, Floats]:
    scaled = value * 134_217_729.0  # 2 ** 27 + 1
    high = scaled - (scaled - value)
    return high, value - high
