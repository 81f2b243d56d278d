"""Synthetic pulls of known truth: five laws and a viscoelastic one, slack, an untared force, noise, cycles, steps."""

from dataclasses import dataclass

import numpy as np

LOW, HIGH = 0.12, 0.24
KINDS = ("neo-Hooke", "Mooney", "Yeoh", "Ogden", "Gent", "filled")


def law(kind, rng):
    """Return a law of the nominal stress (Pa) of a stretch; constants and modulus are drawn."""
    young = float(np.exp(rng.uniform(np.log(15e3), np.log(600e3))))
    c, d = rng.random(2)

    def stress(x):
        neo, first = young / 3 * (x - x**-2), x * x + 2 / x - 3
        match kind:
            case "neo-Hooke":
                return neo
            case "Mooney":
                return (0.2 + 0.7 * (1 - c)) * neo + (0.1 + 0.7 * c) * young / 3 * (1 - x**-3)
            case "Yeoh":
                return neo * (1 + 2 * (0.13 * c - 0.08) * first + 0.03 * d * first**2)
            case "Ogden":
                power = 0.6 + 4 * c
                return 2 * young / (3 * power) * (x ** (power - 1) - x ** (-power / 2 - 1))
            case "Gent":
                return neo / (1 - first / (5 + 55 * c))
            case _:  # stiffer at small strain
                return neo * (1 + (0.1 + 0.4 * c) * np.exp(-(x - 1) / (0.05 + 0.2 * d)))

    return stress


@dataclass(frozen=True)
class Pull:
    """A pull: travel in mm and force in N as recorded, the specimen, and the exact secant over 12 to 24 %, Pa."""

    travel: np.ndarray
    force: np.ndarray
    gauge_mm: float
    width_mm: float
    thickness_mm: float
    truth: float
    cycles: int
    slack_mm: float
    offset: float

    def write(self, path):
        """Write the pull as a file of travel and force."""
        rows = "\n".join(f"{x:.6f},{1e3 * f:.6f}" for x, f in zip(self.travel, self.force, strict=True))
        path.write_text(f"Travel (mm),Force (mN)\n{rows}\n")
        return path


def pull(rng, slack_mm=None, offset=None, cycles=None, noise=None, step=None, rounded=0.0, relaxing=False):
    """Draw a pull; None for a value draws it too. `rounded`: strain over which the specimen straightens.

    `relaxing`: a part of the stress relaxes during the pull, as at a slow rate; the truth is the secant at this rate.
    """
    stress = law(KINDS[rng.integers(len(KINDS))], rng)
    gauge, width = float(rng.choice([20, 25, 33, 50, 60])), float(rng.choice([4, 6, 8, 12]))
    thickness = float(rng.choice([2, 3, 4]))
    area = width * thickness * 1e-6
    slack = rng.uniform(0, 5) if slack_mm is None else slack_mm
    untared = rng.uniform(-0.05, 0.05) if offset is None else offset
    rms = float(rng.choice([0.2e-3, 0.5e-3, 1e-3, 3e-3])) if noise is None else noise
    least = float(rng.choice([0, 0.1e-3, 1e-3, 5e-3])) if step is None else step
    count = int(np.exp(rng.uniform(np.log(120), np.log(1200))))
    turns = int(rng.choice([0, 5])) if cycles is None else cycles
    top, begin = rng.uniform(0.4, 1.5), -slack / gauge

    first = np.linspace(begin, top, count)
    strokes = [first]
    for _ in range(turns - 1):
        strokes += [first[::-1][1:], first[1:]]
    if turns and rng.random() < 0.5:
        strokes.append(np.linspace(top, 1.5 * top, count)[1:])
    strain = np.concatenate(strokes)

    def stretch(strain):
        straight = rounded * np.logaddexp(0, strain / rounded) if rounded else np.maximum(strain, 0)
        return 1 + straight

    def measured(strain):
        elastic = stress(stretch(strain))
        if not relaxing:
            return elastic
        # One Maxwell branch: its stress follows d elastic/dt and relaxes with a time of a tenth of the pull.
        branch, decay = np.zeros_like(elastic), np.exp(-np.diff(strain, prepend=strain[0]) / (0.1 * top))
        for i in range(1, len(elastic)):
            branch[i] = decay[i] * (branch[i - 1] + elastic[i] - elastic[i - 1])
        return elastic + 0.4 * branch

    pulled = measured(first)
    # Mullins: a stroke below the largest strain so far is softer, and leaves a set.
    largest = np.maximum.accumulate(strain)
    again = (np.arange(len(strain)) >= count) & (strain < largest - 1e-12)
    share = np.clip(strain / np.maximum(largest, 1e-9), 0, 1)
    soft, residual = rng.uniform(0.05, 0.35), rng.uniform(0, 0.03)
    back = np.maximum(stress(stretch(strain - residual * (1 - share))) * (1 - soft * (1 - share**2)), 0)
    on_first = np.interp(strain, first, pulled)
    beyond = strain > top
    on_first[beyond] = stress(1 + strain[beyond]) + (pulled[-1] - stress(1 + top))
    force = np.where(again, np.minimum(back, on_first), on_first) * area + untared
    force = force + rms * rng.standard_normal(len(force))
    if least:
        force = np.round(force / least) * least
    use = np.linspace(LOW, HIGH, 401)
    exact = law_at_rate(measured, use) if relaxing else stress(1 + use)
    truth = float(np.mean(exact / use))
    return Pull((strain - begin) * gauge, force, gauge, width, thickness, truth, turns, slack, untared)


def law_at_rate(measured, use):
    """Return the stress at strains of a pull from no strain without slack."""
    dense = np.linspace(0.0, use[-1], 4001)
    return np.interp(use, dense, measured(dense))
