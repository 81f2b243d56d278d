"""STEP by OCCT, if a B-rep extra is installed. Without one, a finding says so."""

from __future__ import annotations

import re
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from unitcad.errors import Unfinished, UnitcadError
from unitcad.extras import install_command
from unitcad.geometry.arrays import Floats, Ints
from unitcad.meshcheck.findings import Point
from unitcad.meshcheck.rules.f_file import F003, F011, F012
from unitcad.workers import NoWorker, Pool, TimedOut, WorkerEnded

_OCCT = "unitcad.meshcheck.readers.occt_bodies"
MEASURE = f"{_OCCT}:measure"
"""The function that a worker measures a file by: OCCT dies of some malformed files, and it prints."""


def step_bodies(path: Path, tolerance: float, seconds: float) -> list[tuple[str, np.ndarray, np.ndarray]]:
    """Return the name, vertices (n, 3) in mm and faces (m, 3) of every solid, in the order of the file.

    No facet lies farther than `tolerance` (mm) from its surface. Vertices of neighbouring B-rep faces are not joined.
    OCCT runs in a worker. Raises UnitcadError if it fails, Unfinished if it lacks memory or time (`seconds`).
    """
    try:
        with Pool() as pool:
            return pool.submit(f"{_OCCT}:read_bodies", str(path), tolerance, seconds=seconds).result()
    except TimedOut:
        raise Unfinished(f"{path}: OCCT needs more than {seconds:g} s for it") from None
    except MemoryError:
        raise Unfinished(f"{path}: OCCT needs more memory for it") from None
    except NoWorker:
        raise
    except Exception as error:
        if "SIGKILL" in str(error):  # the system's, when memory is short
            raise Unfinished(f"{path}: {error}") from None
        raise UnitcadError(f"OCCT can't turn it into a mesh: {str(error)[:200]}") from error


_ASIDE = re.compile(rb"'[^']*'?|/\*(?:.*?\*/|.*)", re.DOTALL)
"""A text or a comment; one that does not end goes to the end of the file."""
_SEVERAL = re.compile(rb"=\s*\(")
SQUARES, SQUARES_A_BYTE = 2e9, 1e3
"""Limit of the sum of squares that `expect_readable` takes: some 5 s of OCCT, and 2 s for each million bytes."""


def expect_readable(data: bytes | memoryview) -> None:
    """Raise `Unreadable` (F011) for a STEP file whose reading would take OCCT much longer than its size suggests.

    OCCT keeps an entity that it does not understand as text. The time for that grows as the square of its references
    and lists, so that half a million of them, in 1.5 MB, take ten minutes.
    """
    text = np.frombuffer(_ASIDE.sub(b"", bytes(data)), np.uint8)
    ends = np.flatnonzero(text == ord(";"))
    marks = np.flatnonzero((text == ord("#")) | (text == ord("(")))
    counts = np.diff(np.searchsorted(marks, np.append(ends, len(text))), prepend=0).astype(float)
    several = [found.start() for found in _SEVERAL.finditer(text.tobytes())]
    counts[np.unique(np.searchsorted(ends, several))] *= _OF_SEVERAL
    squares, limit = float(counts @ counts), SQUARES + SQUARES_A_BYTE * len(data)
    if squares > limit:
        raise F011.unreadable(
            f"entities of up to {counts.max():,.0f} references and lists: the squares add up to {squares:.1e}, "
            f"more than {limit:.1e}, the limit for a file of {len(data):,} bytes"
        )


_OF_SEVERAL = 3.0
"""Weight of the parts of an entity of several types, whose time grows faster."""


def missing() -> str:
    """Return the advice to install the reader of STEP; "" if STEP can be read here."""
    return "" if find_spec("OCP") else f"STEP needs the extra step: {install_command('step')}"


class TooMany(UnitcadError):
    """Bodies that a file places so often that there is neither time nor memory for all."""


@dataclass(frozen=True, eq=False)
class Measured:
    """A B-rep: validity, number of solids, volume (mm3), area (mm2) and box, as OCCT measures it.

    `meshes` are its solids as vertices (n, 3), mm, and faces (m, 3), no farther than `tolerance` (mm) from the surface.
    """

    valid: bool
    solids: int
    volume: float
    area: float
    box: tuple[Point, Point] | None
    tolerance: float
    meshes: list[tuple[Floats, Ints]]


def measured(path: Path, data: memoryview, seconds: float) -> Measured:
    """Return OCCT's measures of a STEP file. Raises `Unreadable` for a damaged file, and without OCP."""
    if b"END-ISO-10303-21" not in bytes(data[-2000:]):  # OCCT must not be handed a fragment
        raise F003.unreadable("the text ends before END-ISO-10303-21")
    expect_readable(data)
    if lacking := missing():
        raise F012.unreadable(lacking)
    try:
        with Pool() as pool:
            found = pool.submit(MEASURE, str(path), seconds=seconds).result()
    except TimedOut as error:
        raise F011.unreadable(f"not finished within --timeout {seconds:g} s") from error
    except (NoWorker, WorkerEnded) as error:
        if isinstance(error, NoWorker) or "SIGKILL" in str(error):  # the system's, when memory is short
            raise F011.unreadable(str(error)) from error
        raise F003.unreadable(f"the STEP reader died of the file ({error})") from error
    except ImportError as error:
        raise F012.unreadable(f"the kernel for STEP does not load ({str(error)[:200]})") from error
    except TooMany as error:
        raise F011.unreadable(str(error)) from error
    if found is None:
        raise F003.unreadable("the STEP file holds no shape that can be read")
    return found
