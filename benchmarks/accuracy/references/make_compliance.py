"""Makes compliance.json: 60-digit compliances and condition numbers for seeded stiff and extreme cases.

Run by hand: python -m benchmarks.accuracy.references.make_compliance   (some minutes; needs mpmath only)
"""

from __future__ import annotations

import json
import random
from pathlib import Path

import mpmath as mp

from benchmarks.accuracy.layered_mp import Body, compliance, condition

OUT = Path(__file__).parent

NU = (0.0, 0.3, 0.49, 0.4999999, 0.5 - 1e-12, 0.5)
OMEGA = (6e3, 785.0, 1.0, 6e-4, 6e-8, 0.0)
CONTRAST = (1e-4, 1e-2, 1.0, 1.0, 3.0, 1e2, 1e4)  # of 1e5 Pa: pairs reach 1e-8 to 1e8
TAN_DELTA = (0.0, 0.0, 0.2, 1e-3)


def bodies_of(rng: random.Random, omega: float) -> list[Body]:
    count, tan = rng.choice([0, 1, 1, 2, 3]), rng.choice(TAN_DELTA)
    return [
        Body(
            10 ** rng.uniform(-9, -1) if i < count else None,
            1000 * 10 ** rng.uniform(-0.3, 0.3),
            1e5 * rng.choice(CONTRAST),
            rng.choice(NU),
            tan,
            rng.choice([0.0, 0.0, 3.0]) if omega and not tan else 0.0,
        )
        for i in range(count + 1)
    ]


def wide(rng: random.Random) -> tuple[list[Body], float, float]:
    """Any k from k h = 1e-2 to k h = 1e12."""
    omega = rng.choice(OMEGA)
    bodies = bodies_of(rng, omega)
    h = bodies[0].thickness or 1e-3
    k = rng.choice([10 ** rng.uniform(-1, 5), 10 ** rng.uniform(-2, 3) / h, 10 ** rng.uniform(3, 12) / h])
    return bodies, k, omega


def at_branch(rng: random.Random) -> tuple[list[Body], float, float]:
    """k beside a branch point of one of the materials, down to the last digit, or far below all of them."""
    omega = rng.choice(OMEGA[:3])
    bodies = bodies_of(rng, omega)
    body = rng.choice(bodies)
    nu = body.poisson_ratio
    ks = omega / (body.youngs_modulus / (2 * (1 + nu)) / body.density) ** 0.5
    kp = ks * ((1 - 2 * nu) / (2 * (1 - nu))) ** 0.5
    side = 1 + rng.choice([-1, 1]) * 10 ** rng.uniform(-16, -2)
    return bodies, rng.choice([ks * side, (kp or ks) * side, ks * 10 ** rng.uniform(-8, -1)]), omega


def main() -> None:
    rng, cases = random.Random(20260101), []
    for kind, make, count in (("wide", wide, 300), ("branch", at_branch, 150)):
        while sum(case["kind"] == kind for case in cases) < count:
            bodies, k, omega = make(rng)
            mp.mp.dps = 60 + (90 if 0 < omega < 1 else 60 if omega else 0)
            found = compliance(bodies, k, omega)
            cond = condition(bodies, k, omega, found)
            cases.append(
                {
                    "kind": kind,
                    "bodies": [list(vars(body).values()) for body in bodies],
                    "k": k,
                    "omega": omega,
                    "compliance": [[float(mp.re(v)), float(mp.im(v))] for v in found],
                    "condition": float(cond),
                }
            )
    text = ",\n".join(json.dumps(case) for case in cases)
    (OUT / "compliance.json").write_text(f"[\n{text}\n]\n")


if __name__ == "__main__":
    main()
