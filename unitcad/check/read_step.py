"""STEP, where a B-rep extra is installed: validity, solid count, volume. Without one, a finding says so."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from unitcad.check.findings import Facts, Finding, counted
from unitcad.check.limits import Limits, Unreadable
from unitcad.check.rulebook import finding

if TYPE_CHECKING:
    from unitcad.check.check import Options

NEEDS = "STEP needs the extra build123d or cadquery: pip install 'unitcad[build123d]'"


def installed() -> bool:
    """Whether STEP can be read here."""
    return find_spec("OCP") is not None


def check_step(path: Path, data: memoryview, options: Options) -> tuple[list[Finding], Facts]:
    """Findings about a STEP file's text and, with OCP there, about its solids."""
    _text(data, options.limits)
    try:
        from OCP.BRepCheck import BRepCheck_Analyzer
        from OCP.BRepGProp import BRepGProp
        from OCP.GProp import GProp_GProps
        from OCP.IFSelect import IFSelect_RetDone
        from OCP.STEPControl import STEPControl_Reader
        from OCP.TopAbs import TopAbs_SOLID
        from OCP.TopExp import TopExp_Explorer
    except ImportError as error:
        raise Unreadable(finding("F012", f"{NEEDS} ({error})")) from error
    reader = STEPControl_Reader()
    if reader.ReadFile(str(path)) != IFSelect_RetDone or reader.TransferRoots() < 1:
        raise Unreadable(finding("F003", "the STEP file holds no shape that can be read"))
    shape = reader.OneShape()
    findings: list[Finding] = []
    if not BRepCheck_Analyzer(shape).IsValid():
        findings.append(finding("G001", "the B-rep is not valid by BRepCheck"))
    explorer, solids = TopExp_Explorer(shape, TopAbs_SOLID), 0
    while explorer.More():
        solids += 1
        explorer.Next()
    volume, area = GProp_GProps(), GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, volume)
    BRepGProp.SurfaceProperties_s(shape, area)
    facts = Facts(
        shells=solids,
        volume_mm3=float(volume.Mass()),
        area_mm2=float(area.Mass()),
        bbox_mm=_box(shape),
        watertight=solids > 0,
    )
    if not solids:
        findings.append(finding("G007", "no solid in the file"))
    elif facts.volume_mm3 is not None and facts.volume_mm3 < 0:
        findings.append(finding("T008", f"volume {facts.volume_mm3:.6g} mm3"))
    if options.shells is not None and solids != options.shells:
        findings.append(
            finding("G005", f"{counted(solids, 'solid')}, {options.shells} expected", abs(solids - options.shells))
        )
    return findings, facts


def _box(shape: Any) -> tuple[tuple[float, float, float], tuple[float, float, float]] | None:
    from OCP.Bnd import Bnd_Box
    from OCP.BRepBndLib import BRepBndLib

    box = Bnd_Box()
    BRepBndLib.AddOptimal_s(shape, box, False, False)
    if box.IsVoid():
        return None
    x0, y0, z0, x1, y1, z1 = box.Get()
    return (x0, y0, z0), (x1, y1, z1)


def _text(data: memoryview, limits: Limits) -> None:
    """Begin and end of ISO 10303-21, before OCCT sees the file: it must not be handed a fragment."""
    if bytes(data[:12]) != b"ISO-10303-21":
        raise Unreadable(finding("F005", "named STEP, but does not begin with ISO-10303-21"))
    if b"END-ISO-10303-21" not in bytes(data[-2000:]):
        raise Unreadable(finding("F003", "the text ends before END-ISO-10303-21"))
    if len(data) > limits.max_bytes:
        raise Unreadable(finding("F011", f"more than {limits.max_bytes} bytes"))
