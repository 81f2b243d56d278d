"""STEP by OCCT, if a B-rep extra is installed. Without one, a finding says so."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from unitcad.errors import Unfinished, UnitcadError, install_command
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


def missing() -> str:
    """Return the advice to install the reader of STEP; "" if STEP can be read here."""
    return "" if find_spec("OCP") else f"STEP needs the extra step: {install_command('step')}"


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
    if found is None:
        raise F003.unreadable("the STEP file holds no shape that can be read")
    return found
