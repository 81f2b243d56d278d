"""A recording: its channels, and their samples in blocks, whatever the file's format."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from unitcad.errors import Refusal, unknown_name
from unitcad.geometry.arrays import Floats

ROWS = 2**17
"""Samples of a block at most."""
GROUPED = ("tdms", "hdf5")
"""Forms whose channels are named group/channel."""
LARGEST_WHOLE = 250_000_000
"""Bytes of a file whose format can only be read whole."""
TIME_NAMES = ("time", "t", "zeit", "temps", "timestamp", "time stamp")
"""Names of a column that is time, where the file gives a unit of time beside one of them."""


class Unreadable(Refusal):
    """A recording that can't be read without a guess, or at all; `field` is the file or the key that settles it."""


@dataclass(frozen=True)
class Channel:
    """One channel: its name, its unit as the file gives it ("" where it gives none), its step and count if known."""

    name: str
    unit: str = ""
    step_s: float | None = None
    count: int | None = None


@dataclass(frozen=True)
class Recording:
    """Channels of a file; `read(indices)` yields blocks (samples, channels) of at most ROWS samples.

    `time` is the channel that holds time by its name and unit.
    """

    path: Path
    form: str
    channels: tuple[Channel, ...]
    read: Callable[[tuple[int, ...]], Iterator[Floats]]
    time: int | None = None

    def index(self, wanted: str | int, field: str) -> int:
        """Return the index of a channel by its name or its number, which counts from 1. Raises Refusal.

        The name may lack its group where one channel alone ends so.
        """
        names = [channel.name for channel in self.channels]
        if isinstance(wanted, int):
            if not 1 <= wanted <= len(names):
                raise Refusal(field, wanted, f"{self.path.name} has {len(names)} channels: {', '.join(names)}", 1)
            return wanted - 1
        if names.count(wanted) > 1:
            first = names.index(wanted) + 1
            raise Refusal(field, wanted, f"{self.path.name} has several channels of this name; give a number", first)
        if wanted not in names and self.form in GROUPED:
            ends = [i for i, name in enumerate(names) if name.rpartition("/")[2] == wanted]
            if len(ends) == 1:
                return ends[0]
        if wanted not in names:
            raise unknown_name(field, wanted, names)
        return names.index(wanted)


def is_time(name: str, unit: str) -> bool:
    """Tell whether a column is time by its name and its unit."""
    from unitcad.lab.quantities import TIMES, plain

    return name.strip().lower() in TIME_NAMES and plain(unit) in TIMES


def in_blocks(columns: Floats) -> Iterator[Floats]:
    """Yield an array (samples, channels) in blocks."""
    for start in range(0, len(columns), ROWS):
        yield columns[start : start + ROWS]
