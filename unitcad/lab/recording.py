"""A recording: its channels, and their samples in blocks, whatever the file's format."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path

from unitcad.errors import Refusal
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

    def numbered(self, indices: Iterable[int] | None = None) -> str:
        """Return the channels' numbers and names, of some or of all."""
        shown = range(len(self.channels)) if indices is None else indices
        return ", ".join(f"{i + 1} {self.channels[i].name}" for i in shown)

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
            close = get_close_matches(wanted, names, n=1)
            limit = f"is no channel of {self.path.name}, which has {self.numbered()}"
            raise Refusal(field, wanted, limit, close[0] if close else None)
        return names.index(wanted)


def is_time(name: str, unit: str) -> bool:
    """Tell whether a column is time by its name and its unit."""
    from unitcad.lab.quantities import TIMES, plain

    return name.strip().lower() in TIME_NAMES and plain(unit) in TIMES


def in_blocks(columns: Floats) -> Iterator[Floats]:
    """Yield an array (samples, channels) in blocks."""
    for start in range(0, len(columns), ROWS):
        yield columns[start : start + ROWS]
