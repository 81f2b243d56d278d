"""Which swept keys the level at the edge does not read, and which no measurement supports.

Levels that stay the same are no result of the sweep. If all measured units had the same length, only the model says how
the level changes with it.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from unitcad.attenuation.edge.measured import nominal
from unitcad.attenuation.edge.models import edge_levels
from unitcad.attenuation.edge.ranges import lead_of
from unitcad.catalogue import measurements
from unitcad.errors import UnitcadError
from unitcad.estimate_inputs import estimate_input, fit_of
from unitcad.report.read_results import SweptLevels
from unitcad.spec import Spec
from unitcad.sweeps.sweep import Sweep
from unitcad.text import join_words
from unitcad.validation import from_data
from unitcad.validation.plain_data import apply

_OF_THE_UNIT = re.compile(
    r"(design|diameter_mm|layers|motor|fpcb|wires|materials|motors|tissue|parameters"
    r"|estimate\.(frequency_hz|tissue|moduli))(\.|$)"
)
"""Keys that a person may expect a level to depend on: not those of tooling, casting and files."""
_LENGTH = re.compile(r"diameter_mm|layers\.\d+\.(wall|cap)_mm")
"""Lengths that every measured unit of one number of layers had alike."""
_STARTS, _VALUES = 4, 8
"""Number of variants from which only one key is changed, and number of values that are tried."""
_SAME = 1e-9


def swept_estimate(sweep: Sweep, count: int) -> SweptLevels | None:
    """Return the swept keys that the level does not read; None without an estimate.

    Each key is changed by itself, from several variants, through several of its values, since a rule by name would have
    to know every model. A key that can't be changed by itself, or whose levels are not known, is taken for read.
    """
    if sweep.of_compounds:
        return None
    starts = [(index, spec) for index in _spread(count, _STARTS) if (spec := _spec(sweep, index))]
    if not starts:
        return None
    unread = []
    for path in sweep.paths:
        if not _OF_THE_UNIT.match(path):
            continue
        groups = [_levels(sweep, index, path) for index, _ in starts]
        told = [levels for levels in groups if len(levels) > 1]
        if told and all(np.ptp(np.log(levels)) < _SAME for levels in told):
            unread.append(path)
    fit = fit_of(starts[0][1])
    # A lab's units may have other lengths.
    return SweptLevels(unread, {} if fit else _not_measured(sweep, [spec for _, spec in starts]))


def _not_measured(sweep: Sweep, specs: Sequence[Spec]) -> dict[str, float]:
    """Return the swept lengths with values that no measured unit of as many layers had, and the one that these had."""
    shared, found = measurements().unit, dict[str, float]()
    counts = {len(spec.layers) for spec in specs}
    walls = [2 * shared.wall_mm / count for count in sorted(counts) if count <= 2]
    for path in sweep.paths:
        if not _LENGTH.fullmatch(path) or not walls:
            continue
        measured = [shared.diameter_mm] if path == "diameter_mm" else walls
        values = [value for value in _values(sweep, path) if isinstance(value, int | float)]
        if any(all(abs(value - one) > _SAME for one in measured) for value in values):
            found[path] = measured[-1]
    return found


def warnings(found: SweptLevels | None) -> list[str]:
    """Say which swept keys the level does not read."""
    if found is None:
        return []
    lines = []
    if found.unread:
        lines.append(f"the level at the edge does not read {join_words(found.unread)}: at most its range changes")
    for length in dict.fromkeys(found.not_measured.values()):
        same = [path for path, one in found.not_measured.items() if one == length]
        lines.append(
            f"every measured unit had {length:g} mm for {join_words(same)}: no measurement shows how a level changes "
            f"with {'it' if len(same) == 1 else 'them'}"
        )
    return lines


def _spread(count: int, most: int) -> list[int]:
    """Return indices from 0 to count - 1, both ends among them."""
    return sorted({round(i * (count - 1) / max(1, most - 1)) for i in range(most)})


def _spec(sweep: Sweep, index: int) -> Spec | None:
    """Return a variant's spec; None if it is refused or has no estimate."""
    try:
        spec = sweep.spec(index)
        assert isinstance(spec, Spec)
        estimate_input(spec)
    except UnitcadError:
        return None
    return spec


def _levels(sweep: Sweep, index: int, path: str) -> list[float]:
    """Return the levels while only the value at a path goes through those of the sweep, from variant `index`.

    By the leading model, without the measured units near it, whose weight every length changes.
    """
    levels = []
    for value in _values(sweep, path):
        data = sweep.data(index)
        try:
            apply(data, {path: value})
            spec = from_data(data, Path())
            variant = estimate_input(spec)
        except UnitcadError:
            continue
        lead = lead_of(variant.moduli, fit_of(spec))
        level = float(edge_levels(nominal(variant), lead.model, lead.constants)[0])
        if np.isfinite(level) and level > 0:
            levels.append(level)
    return levels


def _values(sweep: Sweep, path: str) -> Iterator[Any]:
    """Yield different values of a path, spread over those that it has."""
    if sweep.mode == "cases":
        every: Sequence[Any] = [values[path] for _, values in sweep.cases if path in values]
        every = [value for i, value in enumerate(every) if value not in every[:i]]
    else:
        given = sweep.axes[path]
        every = [given[i] for i in _spread(len(given), _VALUES)]
    yield from (every[i] for i in _spread(len(every), _VALUES))
