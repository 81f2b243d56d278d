"""The Gauss-Legendre rules of a panel: a coarse one, tried first where the tolerance is loose, and the finest."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.special import factorial2

_LOOSE = 1e-3
"""The rtol from which on panels are tried by the coarse rule."""


@dataclass(frozen=True, eq=False)
class Rule:
    """Nodes and weights on [-1, 1], and the matrix from values at the nodes to Legendre coefficients.

    phase: the most that a wave may turn over the nodes; degrees: of the Legendre coefficients of a wave from which on
    the kernel's meet an error of the rule, one for each of the kernel's; odd_factorials: (2m - 1)!! of each.
    """

    nodes: np.ndarray
    weights: np.ndarray
    to_legendre: np.ndarray
    phase: float
    degrees: np.ndarray
    odd_factorials: np.ndarray

    @property
    def count(self) -> int:
        return self.nodes.size

    def spread(self, pieces: int) -> np.ndarray:
        """Return the matrix from values at a panel's nodes to those at the nodes of its equal pieces."""
        return _spread(self, pieces)


def _gauss(count: int, phase: float) -> Rule:
    nodes, weights = np.polynomial.legendre.leggauss(count)
    degrees = np.arange(2 * count, count, -1)
    to_legendre = np.linalg.inv(np.polynomial.legendre.legvander(nodes, count - 1))
    return Rule(nodes, weights, to_legendre, phase, degrees, np.array([float(factorial2(2 * m - 1)) for m in degrees]))


FINEST = _gauss(16, 8.0 * np.pi)
"""The rule by which a panel is judged before it is halved: off by some 1e-9 of the waves."""
COARSE = _gauss(10, 4.0 * np.pi)
"""The rule that costs least: off by some 3e-8 of the waves.

There is one for all loose tolerances, and it cuts a panel into twice as many pieces as the finest or one less: so its
bound is not the lower one, and a tighter tolerance leaves no more than a looser one.
"""


def first_rule(rtol: float) -> Rule:
    """Return the rule by which panels are tried first."""
    return COARSE if rtol >= _LOOSE else FINEST


@cache
def _spread(rule: Rule, pieces: int) -> np.ndarray:
    middles = (2.0 * np.arange(pieces) + 1.0) / pieces - 1.0
    at = (middles[:, None] + rule.nodes / pieces).ravel()
    return (np.polynomial.legendre.legvander(at, rule.count - 1) @ rule.to_legendre).T
