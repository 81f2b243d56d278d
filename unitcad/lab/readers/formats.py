"""The choice of a reader: by the ending of a file's name, then by its first bytes."""

from __future__ import annotations

import contextlib
import functools
import pkgutil
from collections.abc import Callable, Iterator
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np

from unitcad import files
from unitcad.errors import Missing, UnitcadError
from unitcad.geometry.arrays import Floats
from unitcad.lab import readers
from unitcad.lab.readers.hierarchical import HDF5_MARK
from unitcad.lab.readers.recording_layout import Layout
from unitcad.lab.recording import Recording, Unreadable

VENDOR = (".svd", ".pvd")
_LARGEST = 1e30
"""Beyond it, and beyond its inverse, a number is none that was measured."""
_EXTRA = {"pyuff": "pyuff", "nptdms": "npTDMS", "h5py": "h5py"}


@functools.cache
def by_ending() -> dict[str, str]:
    """Return the reader's module by ending: every module of this package that has ENDINGS."""
    found: dict[str, str] = {}
    for one in pkgutil.iter_modules(readers.__path__):
        if one.name != "formats":
            module = import_module(f"{readers.__name__}.{one.name}")
            found |= dict.fromkeys(getattr(module, "ENDINGS", ()), one.name)
    return found


def open_recording(path: Path, layout: Layout | None = None) -> Recording:
    """Return the recording in a file.

    Raises Unreadable (a Refusal) for a file that can't be read without a guess, Missing without the library of its
    format, UnitcadError for a file that isn't there or is no regular one.
    """
    ending = expect_ending(path, str(path))
    first = _first_bytes(path)
    module = by_ending()[ending]
    if module == "matlab" and first.startswith((HDF5_MARK, b"MATLAB 7.3")):
        module = "hierarchical"
    reader: Callable[[Path, Layout], Recording] = import_module(f"unitcad.lab.readers.{module}").read
    with _refusing(path):
        recording = reader(path, layout or Layout())
    return replace(recording, read=lambda indices: _plausible(recording, indices))


def expect_ending(path: Path, field: str) -> str:
    """Return the ending of a file's name, in small letters. Raises Unreadable for one that no reader has."""
    ending = path.suffix.lower()
    if ending in VENDOR:
        raise Unreadable(field, path.name, "Polytec's own format is read by Polytec's library alone: export UFF")
    if ending not in by_ending():
        raise Unreadable(field, path.name, f"no reader; known endings: {', '.join((*by_ending(), *VENDOR))}", ".csv")
    return ending


def _plausible(recording: Recording, indices: tuple[int, ...]) -> Iterator[Floats]:
    """Yield a recording's blocks. Raises Unreadable at a number that no sensor gives: its bytes are shifted or lost."""
    at = 0
    with _refusing(recording.path):
        for block in recording.read(indices):
            size = np.abs(block)
            absurd = (size > _LARGEST) | ((size > 0) & (size < 1 / _LARGEST))
            if absurd.any():
                row, column = np.argwhere(absurd)[0]
                limit = f"sample {at + row + 1} of channel {recording.channels[indices[column]].name!r} is "
                raise Unreadable(str(recording.path), None, f"{limit}{block[row, column]:g}: the file is damaged")
            at += len(block)
            yield block


@contextlib.contextmanager
def _refusing(path: Path) -> Iterator[None]:
    """Turn what a format's library raises into a refusal."""
    try:
        yield
    except UnitcadError:
        raise
    except ModuleNotFoundError as missing:
        name = _EXTRA.get(missing.name or "", missing.name)
        raise Missing(f"{path}: needs {name}: pip install 'unitcad[lab]'") from None
    except Exception as error:  # a damaged file: whatever the library stumbles over
        said = " ".join(str(error).split())[:120] or type(error).__name__
        raise Unreadable(str(path), None, f"is damaged, or no {path.suffix} file ({said})") from None


def _first_bytes(path: Path) -> bytes:
    try:
        with open(path, "rb", opener=files.regular()) as file:
            return file.read(512)
    except FileNotFoundError:
        raise files.NotThere(f"{path}: no such file") from None
    except OSError as error:
        raise UnitcadError(f"{path}: {(error.strerror or 'unreadable').lower()}") from None
