"""The leaves that carry the ribs of a cup printed in resin: how long they must be to bend and not to break.

Crushing would chip a rib of resin. So each is on a leaf of the skirt, cut free on three sides, which gives way: a
cantilever of thickness t, pushed aside by d at the arm a below its root. The strain at the root is 1.5 t d / a^2, the
most in it, if nothing but the leaf bends. No leaf has been printed yet.
"""

from __future__ import annotations

import math

from unitcad.catalogue import Printer

MOST_STRAIN = 0.012
"""Largest strain at a leaf's root (assumed: about half of strength over modulus of standard resins)."""
LEAF_WIDTH = 2.5
CREST = 0.8
"""Distance from the skirt's lower end up to the contact of a rib on a leaf with the plinth, mm."""


def leaf_mm(printer: Printer) -> float:
    """Return how thick a leaf is, and how wide the slot round it, mm: the least wall; 0 for ribs that are crushed."""
    return float(printer.least_wall_mm) if printer.technology.value == "sla" else 0.0


def leaf_strain(thickness: float, pushed: float, arm: float) -> float:
    """Return the strain at the root of a leaf that is pushed aside by `pushed` at `arm` below it, mm."""
    return 1.5 * thickness * pushed / arm**2


def farthest_push(interference: float, play: float, clearance: float) -> float:
    """Return how far a rib is pushed back if the gap is printed narrower by the printer's play, mm."""
    return interference + min(play, clearance)


def least_skirt(thickness: float, pushed: float) -> float:
    """Return the height of a skirt, mm, whose leaves are strained by no more than `MOST_STRAIN`."""
    return math.sqrt(1.5 * thickness * pushed / MOST_STRAIN) + CREST
