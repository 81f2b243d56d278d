"""Reference compliance in arbitrary precision, by another road than the package takes.

Every layer's four waves P and S, uncancelled, with amplitudes of all layers in one linear system (the global matrix
method), solved by mpmath. At omega = 0 the static pair (1, z) e^{-kz}. Nothing is shared with `unitcad.attenuation`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import mpmath as mp


@dataclass(frozen=True)
class Body:
    """SI; thickness None for the half-space. `tan_delta` scales the shear modulus by 1 + i tan_delta."""

    thickness: Any
    density: Any
    youngs_modulus: Any
    poisson_ratio: Any
    tan_delta: Any = 0.0
    viscosity: Any = 0.0


def _moduli(body: Body, omega: Any) -> tuple[Any, Any, Any]:
    nu = mp.mpf(body.poisson_ratio)
    shear = mp.mpf(body.youngs_modulus) / (2 * (1 + nu))
    mu = shear * (1 + 1j * mp.mpf(body.tan_delta)) + 1j * omega * mp.mpf(body.viscosity)
    return mu, (1 - 2 * nu) / (2 * (1 - nu)), mp.mpf(body.density) * omega**2 / mu


def _root(squared: Any) -> Any:
    root = mp.sqrt(squared)
    if mp.re(root) < 0 or (mp.re(root) == 0 and mp.im(root) < 0):
        root = -root
    return root


def _waves(body: Body, k: Any, omega: Any) -> list[tuple]:
    """Two downgoing waves, each a function of depth giving (U, W, t_r, t_z) without and the rate of its exponential."""
    mu, eps, ks2 = _moduli(body, omega)
    if omega == 0:
        alpha = -(1 + eps) / (1 - eps)

        def linear(z):
            u, w = alpha + k * z, k * z
            du, dw = k - k * alpha - k * k * z, k - k * k * z
            s = mu * (du - k * w)
            n = -2 * mu * k * (1 - 2 * eps) / (1 - eps) + 2 * mu * dw
            return (u, w, -s, -n)

        return [(lambda z: (k, k, 2 * mu * k * k, 2 * mu * k * k), k), (linear, k)]
    gp, gs = _root(k * k - eps * ks2), _root(k * k - ks2)
    q = 2 * k * k - ks2
    return [
        (lambda z: (k, gp, 2 * mu * k * gp, mu * q), gp),
        (lambda z: (gs, k, mu * q, 2 * mu * k * gs), gs),
    ]


def compliance(bodies: list[Body], k: Any, omega: Any) -> Any:
    """2x2 compliance at the surface of `bodies` (the last one a half-space) at the working precision."""
    k, omega = mp.mpmathify(k), mp.mpf(omega)
    unknowns = 4 * (len(bodies) - 1) + 2
    system, right = mp.matrix(unknowns, unknowns), mp.matrix(unknowns, 2)
    surface: list[list] = [[mp.mpf(0)] * unknowns for _ in range(2)]
    row = 0
    for i, body in enumerate(bodies):
        last = i == len(bodies) - 1
        h = mp.mpf(0) if last else mp.mpf(body.thickness)
        pair = _waves(body, k, omega)
        columns = []
        for shape, rate in pair:
            columns.append((shape(mp.mpf(0)), [v * mp.exp(-rate * h) for v in shape(h)]))
        if not last:
            for shape, rate in pair:
                at_top = [v * mp.exp(-rate * h) for v in shape(h)]
                at_bottom = shape(mp.mpf(0))
                mirror = (1, -1, -1, 1)
                up = [[m * v for m, v in zip(mirror, at, strict=True)] for at in (at_top, at_bottom)]
                columns.append(tuple(up))
        for j, (top, bottom) in enumerate(columns):
            column = 4 * i + j
            if i == 0:
                for c in range(2):
                    system[c, column] = top[2 + c]
                    surface[c][column] = top[c]
            else:
                for c in range(4):
                    system[row + c - 4, column] -= top[c]
            if not last:
                base = 2 if i == 0 else row
                for c in range(4):
                    system[base + c, column] += bottom[c]
        row = 6 if i == 0 else row + 4
    right[0, 0] = right[1, 1] = 1
    # rows and columns scaled to one magnitude, so that a pivot means something at any contrast
    rows = [max(abs(system[i, j]) for j in range(unknowns)) for i in range(unknowns)]
    for i in range(unknowns):
        for j in range(unknowns):
            system[i, j] /= rows[i]
        for c in range(2):
            right[i, c] /= rows[i]
    out = mp.matrix(2, 2)
    for c in range(2):
        found = mp.lu_solve(system, right[:, c])
        for a in range(2):
            out[a, c] = mp.fsum(surface[a][j] * found[j] for j in range(unknowns))
    return out


def norm(matrix: Any) -> Any:
    return mp.sqrt(mp.fsum(abs(v) ** 2 for v in matrix))


def condition(bodies: list[Body], k: Any, omega: Any, reference: Any) -> Any:
    """Relative change of the compliance (normwise) per relative change of an input, summed over inputs; at least 1."""
    step = mp.mpf(10) ** -25
    total = mp.mpf(0)

    def add(changed: Any) -> Any:
        return norm(changed - reference) / norm(reference) / step

    total += add(compliance(bodies, mp.mpmathify(k) * (1 + step), omega))
    if omega != 0:
        total += add(compliance(bodies, k, mp.mpf(omega) * (1 + step)))
    for i, body in enumerate(bodies):
        for name in ("thickness", "density", "youngs_modulus", "poisson_ratio", "tan_delta"):
            value = getattr(body, name)
            if value is None or value == 0 or (name == "density" and omega == 0):
                continue
            changed = [*bodies]
            changed[i] = replace(body, **{name: mp.mpf(value) * (1 + step)})
            total += add(compliance(changed, k, omega))
    return max(total, mp.mpf(1))
