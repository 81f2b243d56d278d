"""Signs of determinants that are never wrong: a float filter with an error bound, whole numbers for what it leaves.

orient3d(a, b, c, d) is the sign of det(a - d, b - d, c - d): positive where d lies below the plane through a, b, c
(seen so that a, b, c turn anticlockwise), zero where all four are coplanar. The bound is Shewchuk's (1997), for
differences that are rounded themselves.
"""

from __future__ import annotations

import numpy as np

from unitcad.check.mesh import Floats, Ints

_EPS = np.finfo(np.float64).eps / 2
_O3D = (7.0 + 56.0 * _EPS) * _EPS
_O2D = (3.0 + 16.0 * _EPS) * _EPS
_SMALL, _LARGE = 1e-120, 1e120
"""Between them a product and what rounding takes of it neither underflow nor overflow."""


def orient3d(a: Floats, b: Floats, c: Floats, d: Floats) -> Ints:
    """The sign of orient3d for each row of four (n, 3) arrays, int8."""
    ad, bd, cd = a - d, b - d, c - d
    one, two = bd[:, 0] * cd[:, 1], cd[:, 0] * bd[:, 1]
    three, four = cd[:, 0] * ad[:, 1], ad[:, 0] * cd[:, 1]
    five, six = ad[:, 0] * bd[:, 1], bd[:, 0] * ad[:, 1]
    det = ad[:, 2] * (one - two) + bd[:, 2] * (three - four) + cd[:, 2] * (five - six)
    permanent = np.abs(ad[:, 2]) * (np.abs(one) + np.abs(two))
    permanent += np.abs(bd[:, 2]) * (np.abs(three) + np.abs(four))
    permanent += np.abs(cd[:, 2]) * (np.abs(five) + np.abs(six))
    sign = np.sign(det).astype(np.int8)
    unsure = np.flatnonzero(np.abs(det) <= _O3D * permanent + 1e-290)
    if len(unsure):
        sign[unsure] = _exact3d(a[unsure], b[unsure], c[unsure], d[unsure])
    return sign


def orient2d(a: Floats, b: Floats, c: Floats) -> Ints:
    """The sign of the area of each triangle a, b, c in the plane, (n, 2) arrays: positive anticlockwise."""
    ac, bc = a - c, b - c
    left, right = ac[:, 0] * bc[:, 1], ac[:, 1] * bc[:, 0]
    det = left - right
    sign = np.sign(det).astype(np.int8)
    unsure = np.flatnonzero(np.abs(det) <= _O2D * (np.abs(left) + np.abs(right)) + 1e-290)
    if len(unsure):
        sign[unsure] = _exact2d(a[unsure], b[unsure], c[unsure])
    return sign


def _exact2d(a: Floats, b: Floats, c: Floats) -> Ints:
    """The same without error. Single precision has exact differences: then two products are compared to their last bit.

    Rounding keeps order, so products that round apart are apart; else what the rounding took decides (Dekker, 1971).
    """
    ac, bc = a - c, b - c
    (left, left_rest), (right, right_rest) = _product(ac[:, 0], bc[:, 1]), _product(ac[:, 1], bc[:, 0])
    sign = np.where(left == right, np.sign(left_rest - right_rest), np.sign(left - right)).astype(np.int8)
    exact = (_rounded_off(a, c, ac) == 0).all(axis=1) & (_rounded_off(b, c, bc) == 0).all(axis=1)
    for value in (ac, bc):
        size = np.abs(value)
        exact &= ((size == 0) | ((size > _SMALL) & (size < _LARGE))).all(axis=1)
    rest = np.flatnonzero(~exact)
    if not len(rest):
        return sign
    whole = integers(np.stack([a[rest], b[rest], c[rest]]))
    if whole.dtype == np.int64:
        u, v = whole[0] - whole[2], whole[1] - whole[2]
        sign[rest] = np.sign(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
        return sign
    for place, (p, q, r) in zip(rest, whole.transpose(1, 0, 2).tolist(), strict=True):
        value = (p[0] - r[0]) * (q[1] - r[1]) - (p[1] - r[1]) * (q[0] - r[0])
        sign[place] = (value > 0) - (value < 0)
    return sign


def _rounded_off(a: Floats, b: Floats, difference: Floats) -> Floats:
    """a - b less `difference`, which is a - b rounded; exact (Shewchuk 1997, two-diff)."""
    virtual = a - difference
    return (a - (difference + virtual)) + (virtual - b)


def _product(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """x y rounded, and what rounding took; exact while neither overflows or underflows (Dekker's product)."""
    product = x * y
    (high_x, low_x), (high_y, low_y) = _halves(x), _halves(y)
    return product, low_x * low_y - (((product - high_x * high_y) - low_x * high_y) - high_x * low_y)


def _halves(value: Floats) -> tuple[Floats, Floats]:
    with np.errstate(over="ignore", invalid="ignore"):  # such values are left to whole numbers
        scaled = value * 134_217_729.0  # 2 ** 27 + 1
        high = scaled - (scaled - value)
    return high, value - high


def _exact3d(a: Floats, b: Floats, c: Floats, d: Floats) -> Ints:
    """The same with whole numbers. Faces square to an axis have equal coordinates, neighbours equal points: no need."""
    sign = np.zeros(len(a), np.int8)
    flat = ((a == b) & (b == c) & (c == d)).any(axis=1)
    for point in (a, b, c):
        flat |= (point == d).all(axis=1)
    rest = np.flatnonzero(~flat)
    if not len(rest):
        return sign
    whole = integers(np.stack([a[rest], b[rest], c[rest], d[rest]]))
    u, v, w = (whole[i] - whole[3] for i in range(3))
    if whole.dtype == np.int64 and _bits(u, v, w) <= 61:
        value = (
            u[:, 2] * (v[:, 0] * w[:, 1] - w[:, 0] * v[:, 1])
            + v[:, 2] * (w[:, 0] * u[:, 1] - u[:, 0] * w[:, 1])
            + w[:, 2] * (u[:, 0] * v[:, 1] - v[:, 0] * u[:, 1])
        )
        sign[rest] = np.sign(value)
        return sign
    for place, (p, q, r) in zip(rest, zip(u.tolist(), v.tolist(), w.tolist(), strict=True), strict=True):
        value = (
            p[2] * (q[0] * r[1] - r[0] * q[1]) + q[2] * (r[0] * p[1] - p[0] * r[1]) + r[2] * (p[0] * q[1] - q[0] * p[1])
        )
        sign[place] = (value > 0) - (value < 0)
    return sign


def _bits(*arrays: Ints) -> int:
    """Bits that a determinant of these differences needs."""
    return 3 * max(int(np.abs(array).max(initial=1)).bit_length() for array in arrays) + 3


def integers(values: Floats) -> np.ndarray:
    """The floats times one power of two that makes them all whole: int64 where that fits 31 bits, else Python ints."""
    mantissa, exponent = np.frexp(values)
    lowest = np.where(values == 0, 10_000, exponent - 53)
    least = int(lowest.min(initial=10_000))
    if least == 10_000:
        return np.zeros(values.shape, np.int64)
    # Strip trailing zero bits that all values share, so that float32 coordinates stay small.
    digits = np.ldexp(mantissa, 53).astype(np.int64)
    nonzero = digits[digits != 0]
    trailing = np.log2((nonzero & -nonzero).astype(np.float64)).astype(np.int64)
    scale = int((exponent[digits != 0] - 53 + trailing).min())
    with np.errstate(over="ignore"):  # a denormal beside an ordinary number: the shifts below are for that
        scaled = np.ldexp(values, -scale)
    if np.abs(scaled).max() < 2**30:
        return scaled.astype(np.int64)
    shift = (exponent - 53 - scale).tolist()
    found = np.empty(values.shape, object)
    flat, whole, shifts = found.reshape(-1), digits.reshape(-1).tolist(), np.asarray(shift).reshape(-1).tolist()
    for i, (value, by) in enumerate(zip(whole, shifts, strict=True)):
        flat[i] = 0 if value == 0 else (value << by if by >= 0 else value >> -by)
    return found
