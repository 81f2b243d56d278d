"""STEP by OCCT, where a B-rep extra is installed. Without one, a finding says so."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.util import find_spec
from math import dist
from pathlib import Path
from typing import Any

from unitcad.geometry.arrays import Floats, Ints
from unitcad.meshcheck.findings import Point
from unitcad.meshcheck.readers.step_bodies import triangles_of
from unitcad.meshcheck.rules.f_file import F003, F011, F012
from unitcad.workers import NoWorker, Pool, TimedOut, WorkerEnded

_LEAST_MM, _PART = 0.01, 5e-5
"""A mesh lies within the larger of _LEAST_MM and _PART of the diagonal from its surface."""

NEEDS = "STEP needs the extra step: in a clone, pip install '.[step]'"


def installed() -> bool:
    """Return whether STEP can be read here."""
    return find_spec("OCP") is not None


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
    """Return what OCCT measures of a STEP file. Raises `Unreadable` for a damaged file, and without OCP."""
    if b"END-ISO-10303-21" not in bytes(data[-2000:]):  # OCCT must not be handed a fragment
        raise F003.unreadable("the text ends before END-ISO-10303-21")
    if not installed():
        raise F012.unreadable(NEEDS)
    found = _from_child(path, seconds)
    if found is None:
        raise F003.unreadable("the STEP file holds no shape that can be read")
    return found


def _from_child(path: Path, seconds: float) -> Measured | None:
    """Return what `measure` finds, in a worker: OCCT dies of some malformed files, and it prints."""
    try:
        with Pool() as pool:
            return pool.submit(measure, str(path), seconds=seconds).result()
    except TimedOut as error:
        raise F011.unreadable(f"not finished within --timeout {seconds:g} s") from error
    except (NoWorker, WorkerEnded) as error:
        if isinstance(error, NoWorker) or "SIGKILL" in str(error):  # the system's, when memory is short
            raise F011.unreadable(str(error)) from error
        raise F003.unreadable(f"the STEP reader died of the file ({error})") from error
    except ImportError as error:
        raise F012.unreadable(f"{NEEDS} ({error})"[:200]) from error


def measure(path: str) -> Measured | None:
    """Measure a STEP file in this process; None if it holds no shape."""
    from OCP.BRepCheck import BRepCheck_Analyzer
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps
    from OCP.IFSelect import IFSelect_RetDone
    from OCP.STEPControl import STEPControl_Reader
    from OCP.TopAbs import TopAbs_SOLID
    from OCP.TopExp import TopExp_Explorer

    reader = STEPControl_Reader()
    if reader.ReadFile(path) != IFSelect_RetDone or reader.TransferRoots() < 1:
        return None
    shape = reader.OneShape()
    volume, area = GProp_GProps(), GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, volume)
    BRepGProp.SurfaceProperties_s(shape, area)
    valid, box = BRepCheck_Analyzer(shape).IsValid(), _box(shape)
    tolerance = max(_LEAST_MM, _PART * dist(*box)) if box else _LEAST_MM
    meshes: list[tuple[Floats, Ints]] = []
    explorer = TopExp_Explorer(shape, TopAbs_SOLID)
    while explorer.More():
        meshes.append(triangles_of(explorer.Current(), tolerance))
        explorer.Next()
    return Measured(valid, len(meshes), float(volume.Mass()), float(area.Mass()), box, tolerance, meshes)


def _box(shape: Any) -> tuple[Point, Point] | None:
    from OCP.Bnd import Bnd_Box
    from OCP.BRepBndLib import BRepBndLib

    box = Bnd_Box()
    BRepBndLib.AddOptimal_s(shape, box, False, False)
    if box.IsVoid():
        return None
    x0, y0, z0, x1, y1, z1 = box.Get()
    return (x0, y0, z0), (x1, y1, z1)
