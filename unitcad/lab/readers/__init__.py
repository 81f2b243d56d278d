"""Recordings: channels of numbers in a file, and their units. Its ending chooses the reader, a module a format."""

from __future__ import annotations

import contextlib
import functools
import os
import pkgutil
import warnings
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from unitcad import files
from unitcad.errors import Refusal, UnitcadError
from unitcad.extras import missing_extra
from unitcad.geometry.arrays import Floats
from unitcad.lab.units import TIMES, in_name, plain
from unitcad.text import some
from unitcad.workers import Pool, TimedOut, WorkerEnded

LARGEST = 250_000_000
"""Bytes of a file that is read: all formats are read whole."""
TIME_NAMES = ("time", "t", "zeit", "temps", "timestamp", "time stamp", "second", "seconds", "x_value", "时间")
"""Names of a column that is time, if the file gives a unit of time with one of them."""
LONGEST_S = 60.0
"""Seconds that a format's library may take to read a file."""
MEMORY = 3 << 30
"""Bytes that a format's library may take."""
OTHER_PROGRAMS = {
    **dict.fromkeys((".svd", ".pvd"), "only Polytec's library reads it: export UFF"),
    **dict.fromkeys((".xls", ".xlsx", ".ods"), "a spreadsheet: save the sheet with the numbers as CSV"),
}
"""Endings that no reader has, and the way to a file that one reads."""
_MOST = 1e30
"""Beyond it, and beyond its inverse, a number is none that was measured."""
_EXTRA = {"pyuff": "pyuff", "nptdms": "npTDMS", "h5py": "h5py"}


class Unreadable(Refusal):
    """A recording that can't be read without a guess, or at all; `field` is the file or the key that settles it."""


@dataclass(frozen=True)
class Layout:
    """A text file's delimiter ("" to find it; " " for any white space), decimal sign, lines before the numbers."""

    delimiter: str = ""
    decimal: str = ""
    skip_lines: int = 0


AS_FOUND = Layout()


@dataclass(frozen=True)
class Channel:
    """One channel: its samples, its name, its unit ("" if the file gives none), its step in s if known.

    `doubt`: why the file's unit is not clear, "" if it is; `likely`: the unit that it then may be.
    """

    samples: Any
    name: str
    unit: str = ""
    step_s: float | None = None
    doubt: str = ""
    likely: str = ""


@dataclass(frozen=True)
class Recording:
    """Channels of a file; `time` is the time by its name and unit."""

    path: Path
    channels: Sequence[Channel]

    @property
    def time(self) -> int | None:
        """The channel of time: by its name and unit, or the first one if only that has a unit of time."""
        found = [i for i, c in enumerate(self.channels) if _last(c.name).strip().lower() in TIME_NAMES]
        found = [i for i in found if plain(self.channels[i].unit) in TIMES]
        if not found:
            found = [i for i, c in enumerate(self.channels) if plain(c.unit) in TIMES]
            found = found if found == [0] and len(self.channels) > 1 else []
        return found[0] if len(found) == 1 else None

    def numbered(self, indices: Iterable[int] | None = None) -> str:
        """Return the first channels' numbers and names, of some or of all."""
        shown = list(range(len(self.channels)) if indices is None else indices)
        return some(f"{i + 1} {self.channels[i].name}" for i in shown)

    def index(self, wanted: str | int, field: str) -> int:
        """Return the index of a channel by its name or its number, which counts from 1. Raises Refusal.

        The name may lack its group if only one channel ends so.
        """
        names = [channel.name for channel in self.channels]
        if isinstance(wanted, int):
            if not 1 <= wanted <= len(names):
                raise Refusal(field, wanted, f"{self.path.name} has {len(names)} channels: {self.numbered()}", 1)
            return wanted - 1
        found = [i for i, name in enumerate(names) if name == wanted]
        if len(found) > 1:
            limit = f"{self.path.name} has several channels of this name; give a number"
            raise Refusal(field, wanted, limit, found[0] + 1)
        found = found or [i for i, name in enumerate(names) if _last(name) == wanted]
        if len(found) != 1:
            close = get_close_matches(wanted, names, n=1)
            limit = f"is no channel of {self.path.name}, which has {self.numbered()}"
            raise Refusal(field, wanted, limit, close[0] if close else None)
        return found[0]

    def columns(self, indices: Sequence[int]) -> Floats:
        """Return channels as columns (n, k). Raises Refusal for different lengths, Unreadable for absurd numbers."""
        chosen = [self.channels[i] for i in indices]
        counts = [len(channel.samples) for channel in chosen]
        if len(set(counts)) > 1:
            each = some((f"{c.name} {count}" for c, count in zip(chosen, counts, strict=True)))
            raise Refusal("channel", self.path.name, f"its channels have different counts of samples: {each}")
        with np.errstate(invalid="ignore"):  # a damaged number may be a NaN that signals
            table = np.column_stack([np.asarray(channel.samples, float) for channel in chosen])
        size = np.abs(table)
        absurd = (size > _MOST) | ((size > 0) & (size < 1 / _MOST))
        if absurd.any():
            row, column = np.argwhere(absurd)[0]
            limit = f"sample {row + 1} of channel {chosen[column].name!r} is {table[row, column]:g}"
            raise Unreadable(str(self.path), None, f"{limit}: the file is damaged")
        return table


def _last(name: str) -> str:
    return name.rpartition("/")[2]


@functools.cache
def _by_ending() -> dict[str, str]:
    """Return the reader's module by ending: every module of this package has ENDINGS."""
    found: dict[str, str] = {}
    for one in pkgutil.iter_modules(__path__):
        found |= dict.fromkeys(import_module(f"{__name__}.{one.name}").ENDINGS, one.name)
    return found


def expect_ending(path: Path, field: str) -> str:
    """Return the ending of a file's name, in small letters. Raises Unreadable for one that no reader has."""
    ending = path.suffix.lower()
    if ending in OTHER_PROGRAMS:
        raise Unreadable(field, path.name, OTHER_PROGRAMS[ending])
    if ending not in _by_ending():
        limit = f"no reader for this ending; known: {', '.join(_by_ending())}"
        raise Unreadable(field, None if field == str(path) else path.name, limit)
    return ending


def open_recording(path: Path, layout: Layout = AS_FOUND) -> Recording:
    """Return the recording in a file.

    Raises Unreadable (a Refusal) for a file that can't be read without a guess, Missing without the library of its
    format, UnitcadError for a file that isn't there or is no regular one.
    """
    module = _by_ending()[expect_ending(path, str(path))]
    try:
        with open(path, "rb", opener=files.regular()) as file:
            file.read(1)
    except FileNotFoundError:
        raise files.NotThere(path) from None
    except OSError as error:
        raise UnitcadError(f"{path}: {(error.strerror or 'unreadable').lower()}") from None
    if (size := path.stat().st_size) > LARGEST:
        limit = f"has {size / 1e6:.0f} MB; files are read whole, up to {LARGEST / 1e6:g} MB: cut it, or record slower"
        raise Unreadable(str(path), None, limit)
    with _refusing(path):
        if getattr(import_module(f"{__name__}.{module}"), "LIBRARY", ""):
            # Some damaged files end the library's process, take all memory, or loop for ever.
            reading = _worker().submit(_read_in, os.getcwd(), module, path, layout, seconds=LONGEST_S)
            return Recording(path, reading.result())
        return Recording(path, _read(module, path, layout))


def _read_in(folder: str, module: str, path: Path, layout: Layout) -> list[Channel]:
    os.chdir(folder)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return _read(module, path, layout)


def _read(module: str, path: Path, layout: Layout) -> list[Channel]:
    found = import_module(f"{__name__}.{module}").read(path, layout)
    if not found:
        raise Unreadable(str(path), None, "has no channel of numbers")
    return [_with_name(channel) for channel in found]


def _with_name(channel: Channel) -> Channel:
    """Return a channel with the unit that its name states, or the doubt if its file states another one."""
    _, by_name = in_name(channel.name)
    if not channel.unit and not channel.doubt:
        return replace(channel, unit=by_name.unit, doubt=by_name.doubt, likely=by_name.likely)
    if channel.unit and by_name.unit and plain(channel.unit) != plain(by_name.unit):
        doubt = f"its name says {by_name.unit}, and its file {channel.unit}"
        return replace(channel, unit="", doubt=doubt, likely=plain(channel.unit))
    return channel


@functools.cache
def _worker() -> Pool:
    return Pool(memory=MEMORY)


@contextlib.contextmanager
def _refusing(path: Path) -> Iterator[None]:
    """Turn an exception of a format's library into a refusal."""
    try:
        yield
    except ModuleNotFoundError as missing:
        name = _EXTRA.get(missing.name or "", missing.name)
        raise missing_extra("lab", f"{path}: needs {name}") from None
    except TimedOut:
        raise Unreadable(str(path), None, f"was not read in {LONGEST_S:g} s: it is damaged or too large") from None
    except MemoryError:
        limit = f"is damaged, or takes more than {MEMORY >> 30} GiB to read"
        raise Unreadable(str(path), None, limit) from None
    except WorkerEnded as end:
        raise Unreadable(str(path), None, f"is damaged, or no {path.suffix} file ({end})") from None
    except UnitcadError:
        raise
    except Exception as error:  # a damaged file: whatever the library stumbles over
        said = " ".join(str(error).split())[:120] or type(error).__name__
        raise Unreadable(str(path), None, f"is damaged, or no {path.suffix} file ({said})") from None
