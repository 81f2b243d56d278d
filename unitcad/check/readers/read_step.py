"""STEP, where a B-rep extra is installed: validity, solid count, volume. Without one, a finding says so."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import Any

from unitcad.check.findings import Facts, Finding, number
from unitcad.check.options import Options
from unitcad.check.rules.f_file import F003, F012
from unitcad.check.rules.f_limits import F011
from unitcad.check.rules.g_crossing import G001
from unitcad.check.rules.g_shells import G007, T008, expected
from unitcad.workers import Pool, TimedOut, WorkerEnded

NEEDS = "STEP needs the extra step: in a clone, pip install '.[step]'"


def installed() -> bool:
    """Return whether STEP can be read here."""
    return find_spec("OCP") is not None


def check_step(path: Path, data: memoryview, options: Options) -> tuple[list[Finding], Facts]:
    """Return findings about a STEP file's text and, with OCP there, about its solids."""
    if b"END-ISO-10303-21" not in bytes(data[-2000:]):  # OCCT must not be handed a fragment
        raise F003.unreadable("the text ends before END-ISO-10303-21")
    if not installed():
        raise F012.unreadable(NEEDS)
    measured = _from_child(path, options.limits.seconds)
    if not measured:
        raise F003.unreadable("the STEP file holds no shape that can be read")
    solids, volume = measured["solids"], measured["volume"]
    findings: list[Finding] = []
    if not measured["valid"]:
        findings.append(G001.finding("the B-rep is not valid by BRepCheck"))
    facts = Facts(
        shells=solids, volume_mm3=volume, area_mm2=measured["area"], bbox_mm=measured["box"], watertight=solids > 0
    )
    if not solids:
        findings.append(G007.finding("no solid in the file"))
    elif volume < 0:
        findings.append(T008.finding(f"volume {number(volume)} mm3"))
    findings += expected(solids, options.shells, "solid")
    return findings, facts


def _from_child(path: Path, seconds: float) -> dict[str, Any]:
    """Return what `measure` finds, in a worker: OCCT dies of some malformed files, and it prints."""
    try:
        with Pool() as pool:
            return pool.submit(measure, str(path), seconds=seconds).result()
    except TimedOut as error:
        raise F011.unreadable(f"not finished within --timeout {seconds:g} s") from error
    except WorkerEnded as error:
        raise F003.unreadable(f"the STEP reader died of the file ({error})") from error
    except ImportError as error:
        raise F012.unreadable(f"{NEEDS} ({error})"[:200]) from error


def measure(path: str) -> dict[str, Any]:
    """Return validity, solids, volume (mm3), area (mm2) and box of a STEP file; {} if it holds no shape."""
    from OCP.BRepCheck import BRepCheck_Analyzer
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps
    from OCP.IFSelect import IFSelect_RetDone
    from OCP.STEPControl import STEPControl_Reader
    from OCP.TopAbs import TopAbs_SOLID
    from OCP.TopExp import TopExp_Explorer

    measures: dict[str, Any] = {}
    reader = STEPControl_Reader()
    if reader.ReadFile(path) == IFSelect_RetDone and reader.TransferRoots() >= 1:
        shape = reader.OneShape()
        explorer, solids = TopExp_Explorer(shape, TopAbs_SOLID), 0
        while explorer.More():
            solids += 1
            explorer.Next()
        volume, area = GProp_GProps(), GProp_GProps()
        BRepGProp.VolumeProperties_s(shape, volume)
        BRepGProp.SurfaceProperties_s(shape, area)
        measures = {"valid": BRepCheck_Analyzer(shape).IsValid(), "solids": solids, "box": _box(shape)}
        measures |= {"volume": float(volume.Mass()), "area": float(area.Mass())}
    return measures


def _box(shape: Any) -> tuple[tuple[float, float, float], tuple[float, float, float]] | None:
    from OCP.Bnd import Bnd_Box
    from OCP.BRepBndLib import BRepBndLib

    box = Bnd_Box()
    BRepBndLib.AddOptimal_s(shape, box, False, False)
    if box.IsVoid():
        return None
    x0, y0, z0, x1, y1, z1 = box.Get()
    return (x0, y0, z0), (x1, y1, z1)
