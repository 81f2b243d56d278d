"""Formats that are read whole: a limit of their size, and their columns in blocks."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from unitcad.errors import Refusal
from unitcad.geometry.arrays import Floats
from unitcad.lab.recording import LARGEST_WHOLE, ROWS, Unreadable


def expect_small(path: Path, advice: str) -> None:
    """Raise Unreadable for a file larger than LARGEST_WHOLE: its format can't be read in blocks."""
    size = path.stat().st_size
    if size > LARGEST_WHOLE:
        limit = f"has {size / 1e6:.0f} MB; this format is read whole, up to {LARGEST_WHOLE / 1e6:g} MB: {advice}"
        raise Unreadable(str(path), None, limit)


def columns_of(path: Path, names: Sequence[str], columns: Sequence[Floats]) -> Iterator[Floats]:
    """Yield columns of the same length, which may be lazy, in blocks. Raises Refusal for columns of several lengths."""
    counts = [len(column) for column in columns]
    if len(set(counts)) > 1:
        listed = ", ".join(f"{name} {count}" for name, count in zip(names, counts, strict=True))
        raise Refusal("channel", str(path.name), f"its channels have different counts of samples: {listed}")
    for start in range(0, counts[0], ROWS):
        yield np.column_stack([np.asarray(column[start : start + ROWS], float) for column in columns])
