"""Makes half_space.json: u_z of an undamped half-space under a disc, far away, in 18 digits.

Rayleigh's function in its classical form; the integral over a triangular path of its own up to K > k_R, then the two
Hankel functions along the vertical lines up and down from K, where they decay. Run by hand; needs mpmath only.
"""

import json
from itertools import pairwise
from pathlib import Path

import mpmath as mp

RHO, E, A, OMEGA = 1000, 3e4, 3.5e-3, 785.0
RULE = {"method": "gauss-legendre", "maxdegree": 6}
RATIOS = (2, 10, 50, 150)


def displacement(nu, r):
    mu = mp.mpf(E) / (2 * (1 + mp.mpf(nu)))
    eps = (1 - 2 * mp.mpf(nu)) / (2 * (1 - mp.mpf(nu)))
    ks2 = RHO * mp.mpf(OMEGA) ** 2 / mu

    def root(x):
        found = mp.sqrt(x)
        return -found if mp.re(found) < 0 else found

    def kernel(k):
        gp, gs = root(k * k - eps * ks2), root(k * k - ks2)
        rayleigh = (2 * k * k - ks2) ** 2 - 4 * k * k * gp * gs
        return -gp * ks2 / (mu * rayleigh) * A * mp.besselj(1, k * A)

    stop = 2 * mp.sqrt(ks2)
    height = min(1 / mp.mpf(r), stop / 6)
    corners = [mp.mpf(0), height * (1 + 1j), stop * mp.mpf("0.8") + 1j * height, stop]
    near = mp.mpf(0)
    for a, b in pairwise(corners):
        count = 2 + int(abs(b - a) * r / 3)
        points = [a + (b - a) * i / count for i in range(count + 1)]
        near += mp.quad(lambda k: kernel(k) * mp.besselj(0, k * r), points, **RULE)
    scale = 1 / (mp.mpf(r) - A)
    points = [0, scale, 4 * scale, 16 * scale, 64 * scale]
    up = mp.quad(lambda t: 1j * kernel(stop + 1j * t) * mp.hankel1(0, (stop + 1j * t) * r), points, **RULE)
    down = mp.quad(lambda t: -1j * kernel(stop - 1j * t) * mp.hankel2(0, (stop - 1j * t) * r), points, **RULE)
    return near + (up + down) / 2


def main():
    mp.mp.dps = 18
    cases = []
    for nu in (0.3, 0.4999999, 0.5):
        for ratio in RATIOS:
            found = displacement(nu, ratio * A)
            cases.append({"nu": nu, "r_over_a": ratio, "u_z": [float(mp.re(found)), float(mp.im(found))]})
    data = {"density": RHO, "youngs_modulus": E, "radius": A, "omega": OMEGA, "cases": cases}
    (Path(__file__).parent / "half_space.json").write_text(json.dumps(data, indent=1) + "\n")


if __name__ == "__main__":
    main()
