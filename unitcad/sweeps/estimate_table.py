"""The estimate-only sweep: no folders, one table, the closed forms evaluated over arrays of variants.

A variant's edge level reads its design, its lengths, its silicones and the frequency. Silicones and the frequency are
looked up value by value; everything else that is swept is validated once for each combination. Both are then put
together as arrays, a block of variants at a time.
"""

from __future__ import annotations

import re
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from unitcad.attenuation.edge.closed_form import Units
from unitcad.attenuation.edge.measured import Moduli, whole_ratio
from unitcad.attenuation.edge.models import edge_levels, stored
from unitcad.errors import UnitcadError
from unitcad.estimate_inputs import closed_forms, drawn_input
from unitcad.spec import Spec
from unitcad.sweeps import task as tasks
from unitcad.sweeps.insensitive_keys import swept_estimate
from unitcad.sweeps.insensitive_keys import warnings as insensitive_warnings
from unitcad.sweeps.journal import Failure, Journal, JournalEntry, Summary
from unitcad.sweeps.results import FIRST, write_results, write_timings
from unitcad.sweeps.run import MOST_FAILURES, batch_head, count_variants
from unitcad.sweeps.shards import BatchOptions
from unitcad.sweeps.sweep import Sweep
from unitcad.sweeps.task import OK
from unitcad.validation import from_data, put
from unitcad.validation.defaults import lab_fit

BLOCK = 1 << 15
FREE = re.compile(r"layers\.(\d+)\.material|estimate\.frequency_hz|name|casting\..+")
"""Paths that are validated one by one: no other value decides whether theirs is accepted, without a tail end width."""
SILICONES = re.compile(r"materials(\.|$)|estimate\.moduli")
"""Paths that decide the meaning of a silicone's name: a layer's material is not independent of them."""
FIELDS = ("youngs_modulus", "density", "poisson_ratio", "tan_delta")


@dataclass(frozen=True)
class _Known:
    """Input of the models for one combination: passes, lengths (m), omega, the layers' silicones and (N, 4) FIELDS.

    A silicone that is known as a range only has NaN: no number can be given.
    """

    design: str
    name: str
    diameter_mm: float
    passes: float
    omega: float
    walls: tuple[float, ...]
    materials: tuple[str, ...]
    silicones: np.ndarray
    models: tuple[str, ...]
    fit: str | None = None
    moduli: Moduli = "small-strain"


@dataclass(frozen=True)
class EstimateBlock:
    """Variants from `start` on: edge levels by model (NaN: no number), and the input of each or why it is refused."""

    start: int
    levels: dict[str, np.ndarray]
    known: list[_Known | UnitcadError]


def write_estimates(sweep: Sweep, out: Path, options: BatchOptions) -> Summary:
    """Write `variants.csv`, `batch.json` and `timings.json` of every variant's edge level by model into `out`.

    Raises UnitcadError for a folder that isn't ours.
    """
    count = count_variants(sweep, options.limit)
    head = batch_head(sweep, ("estimate",), options)
    journal = Journal(out, head)
    summary, start = Summary(count), time.perf_counter()
    try:
        blocks = list(evaluate(sweep, count))
        models = list(dict.fromkeys(model for block in blocks for model in block.levels))
        paths = [path for path in sweep.paths if path != "name"]
        columns = list(dict.fromkeys([*FIRST, *paths, "name", "design", "diameter_mm", *(f"edge_{m}" for m in models)]))
        found = swept_estimate(sweep, count)
        summary.warnings += insensitive_warnings(found)
        write_results(out, columns, lambda: _entries(sweep, blocks), head, found, options.tables, count)
        _count(summary, blocks)
        summary.seconds = round(time.perf_counter() - start, 3)
        write_timings(out, summary, 1)
    finally:
        journal.close()
    return summary


def evaluate(sweep: Sweep, count: int) -> Iterator[EstimateBlock]:
    """Yield edge levels of variants 0 to `count`, a block at a time."""
    free = _free_axes(sweep)
    combinations: dict[int, _Known | UnitcadError] = {}
    values: dict[tuple[int | str, int, int], Any] = {}
    shape = (len(sweep.bases), *(len(axis) for axis in sweep.axes)) if sweep.mode == "product" else (sweep.count,)
    for start in range(0, count, BLOCK):
        indices = np.arange(start, min(start + BLOCK, count))
        digits = np.array(np.unravel_index(indices, shape))
        plain = digits.copy()
        plain[[position + 1 for position in free]] = 0
        bound = np.asarray(np.ravel_multi_index(tuple(plain), shape))
        for index in np.unique(bound).tolist():
            if index not in combinations:
                combinations[index] = _of(sweep, index, {sweep.axes[position].path for position in free})
        known = [combinations[index] for index in bound.tolist()]
        yield _block(sweep, start, digits, known, free, values)


def _free_axes(sweep: Sweep) -> list[int]:
    """Return the axes (by position) whose values are independent of each other."""
    if sweep.mode != "product" or any("tail_end_width_mm" in repr(base) for base in (sweep.bases, sweep.paths)):
        return []
    silicones_vary = any(SILICONES.match(path) for path in sweep.paths)
    return [
        i
        for i, axis in enumerate(sweep.axes)
        if FREE.fullmatch(axis.path) and not (silicones_vary and axis.path.endswith(".material"))
    ]


def _of(sweep: Sweep, index: int, free: set[str]) -> _Known | UnitcadError:
    """Return the input of variant `index`, with the base's values on the free axes."""
    base, values = sweep.values(index)
    data = sweep.base_data(base)
    try:
        for path, value in values.items():
            if path not in free:
                put(data, path, value)
        return _known(from_data(data))
    except UnitcadError as error:
        return error


def _known(spec: Spec) -> _Known:
    asked = drawn_input(spec)
    return _Known(
        design=spec.design,
        name=spec.name,
        diameter_mm=spec.diameter_mm,
        passes=asked.passes,
        omega=2.0 * np.pi * asked.frequency.middle,
        walls=tuple(layer.thickness for layer in asked.layers),
        materials=tuple(layer.material for layer in asked.layers),
        silicones=np.array([_silicone(layer) for layer in asked.layers]),
        models=closed_forms(spec.estimate.models),
        fit=spec.estimate.fit_source,
        moduli=spec.estimate.moduli,
    )


def _silicone(layer: Any) -> list[float]:
    modulus, ratio, loss = layer.youngs_modulus, layer.poisson_ratio, layer.tan_delta
    values = [q.value if q.value is not None else np.nan for q in (modulus, ratio, loss)]
    return [values[0], layer.density, values[1], values[2]]


def _block(
    sweep: Sweep, start: int, digits: np.ndarray, known: list[_Known | UnitcadError], free: list[int], values: dict
) -> EstimateBlock:
    """Evaluate one block: the combinations' inputs, with the free axes' values put in."""
    levels: dict[str, np.ndarray] = {}
    by_layers: dict[int, list[int]] = {}
    for row, entry in enumerate(known):
        if isinstance(entry, _Known):
            by_layers.setdefault(len(entry.walls), []).append(row)
    for rows in by_layers.values():
        chosen = np.array(rows)
        there = [entry for entry in (known[row] for row in rows) if isinstance(entry, _Known)]
        silicones = np.array([entry.silicones for entry in there])
        materials = np.array([entry.materials for entry in there], dtype=object)
        omega = np.array([entry.omega for entry in there])
        for position in free:
            path, at = sweep.axes[position].path, digits[position + 1][chosen]
            if path == "estimate.frequency_hz" and (hertz := _frequencies(sweep, position, values)) is not None:
                omega = 2.0 * np.pi * hertz[at]
                continue
            for base, digit in np.unique(np.array([digits[0][chosen], at]), axis=1).T.tolist():
                here = (at == digit) & (digits[0][chosen] == base)
                value = _free_value(sweep, base, position, digit, values)
                if isinstance(value, UnitcadError):
                    for row in chosen[here]:
                        known[row] = value
                elif path == "estimate.frequency_hz":
                    omega[here] = value.omega
                elif match := re.fullmatch(r"layers\.(\d+)\.material", path):
                    layer = int(match[1])
                    silicones[here, layer], materials[here, layer] = value.silicones[layer], value.materials[layer]
        units = Units(
            **{field: silicones[..., i] for i, field in enumerate(FIELDS)},
            thickness=np.array([entry.walls for entry in there]),
            omega=omega,
            passes=np.array([entry.passes for entry in there]),
            whole=np.array([whole_ratio(entry.moduli) for entry in there]),
        )
        alike = list(_merge(units, materials[:, 1:] == materials[:, :-1]))
        unknown = np.isnan(silicones).any(axis=(1, 2))
        for model in dict.fromkeys(model for entry in there for model in entry.models):
            column = levels.setdefault(model, np.full(len(known), np.nan))
            for fit, moduli in dict.fromkeys((entry.fit, entry.moduli) for entry in there):
                of_these = [model in one.models and (one.fit, one.moduli) == (fit, moduli) for one in there]
                constants = lab_fit(fit).constants(model) if fit else stored(moduli)[model]
                found = np.full(len(there), np.nan)
                for rows, own in alike:
                    found[rows] = edge_levels(own, model, constants)
                column[chosen] = np.where(np.array(of_these) & ~unknown, found, column[chosen])
    return EstimateBlock(start, levels, known)


def _merge(units: Units, same: np.ndarray) -> Iterator[tuple[np.ndarray, Units]]:
    """Yield rows of units and these units, neighbouring layers of one silicone as one: `variant_units.merged`.

    `same` (rows, N - 1) tells if a layer is of the silicone of the one inside it.
    """
    for pattern in np.unique(same, axis=0):
        rows = np.flatnonzero((same == pattern).all(axis=1))
        first = np.flatnonzero(np.append(True, ~pattern))
        yield (
            rows,
            Units(
                **{field: getattr(units, field)[rows][:, first] for field in FIELDS},
                thickness=np.add.reduceat(units.thickness[rows], first, axis=1),
                **{field: getattr(units, field)[rows] for field in ("omega", "passes", "whole")},
            ),
        )


def _frequencies(sweep: Sweep, position: int, values: dict) -> np.ndarray | None:
    """Return the frequencies of an axis, Hz, if each is a positive number; else None."""
    key = ("frequencies", position, 0)
    if key not in values:
        axis = sweep.axes[position]
        hertz = [axis.values[i] for i in range(len(axis))]
        plain = all(isinstance(v, int | float) and not isinstance(v, bool) and 0 < v < np.inf for v in hertz)
        values[key] = np.array(hertz, dtype=float) if plain else None
    return values[key]


def _free_value(sweep: Sweep, base: int, position: int, digit: int, values: dict) -> _Known | UnitcadError:
    """Return the input of a base with one value of a free axis put in."""
    key = (base, position, digit)
    if key not in values:
        axis = sweep.axes[position]
        data = sweep.base_data(sweep.bases[base][0])
        put(data, axis.path, axis.values[digit])
        try:
            values[key] = _known(from_data(data))
        except UnitcadError as error:
            values[key] = error
    return values[key]


def _entries(sweep: Sweep, blocks: list[EstimateBlock]) -> Iterator[JournalEntry]:
    for block in blocks:
        levels = {f"edge_{model}": column.tolist() for model, column in block.levels.items()}
        for row, known in enumerate(block.known):
            index = block.start + row
            _, values = sweep.values(index)
            if isinstance(known, UnitcadError):
                failed = tasks.failure(index, known)
                yield JournalEntry(index=index, status=failed.status, reason=failed.reason, values=values)
                continue
            edges = {name: _rounded(column[row]) for name, column in levels.items()}
            name = values.get("name", known.name)
            columns = {"name": name, "design": known.design, "diameter_mm": known.diameter_mm, **edges}
            yield JournalEntry(index=index, status=OK, values=values, row=columns)


def _rounded(level: float) -> float | None:
    return None if level != level else float(f"{level:.6g}")


def _count(summary: Summary, blocks: list[EstimateBlock]) -> None:
    summary.done = sum(len(block.known) for block in blocks)
    failed = [
        tasks.failure(block.start + row, entry)
        for block in blocks
        for row, entry in enumerate(block.known)
        if isinstance(entry, UnitcadError)
    ]
    summary.failed, summary.ok = len(failed), summary.done - len(failed)
    summary.failures = [Failure(each.index, each.status, each.reason) for each in failed[:MOST_FAILURES]]
