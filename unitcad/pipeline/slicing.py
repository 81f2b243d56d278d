"""slicer.json: print time and filament of a built folder's tools, by PrusaSlicer."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from unitcad import files
from unitcad.errors import Missing, Refusal, UnitcadError
from unitcad.export import slicer
from unitcad.pipeline.manifest import Manifest
from unitcad.pipeline.write import held
from unitcad.spec import Spec, printer_of
from unitcad.text import some

SLICED = "slicer.json"


def check_slicing(spec: Spec, only: Sequence[str]) -> None:
    """Raise UnitcadError, before the work, if nothing of a spec can be sliced."""
    if slicer.program() is None:
        raise Missing("--slice: PrusaSlicer is not installed, or not on the path (prusa-slicer)")
    if "moulds" not in only:
        raise Refusal("--only", ",".join(only), "has no moulds, which --slice is for", ",".join((*only, "moulds")))
    if "stl" not in spec.output.formats:
        raise Refusal("output.formats", list(spec.output.formats), "has no stl, which --slice reads")
    printer = printer_of(spec)
    if printer.technology.value != "fdm":
        raise Refusal("moulds.printer", printer.name, "prints no filament: leave out --slice", "fdm-0.4")


def slice_tools(spec: Spec, folder: Path, manifest: Manifest, say: Callable[[str], object]) -> str:
    """Write the slicer.json of a built folder's tools and return a sentence with time and filament.

    A file that the slicer refuses is named. It is no error, since another slicer may accept it.
    """
    tools = [
        folder / part["files"]["stl"]["path"]
        for part in manifest["parts"]
        if part["role"] == "tool" and "stl" in part["files"] and part["files"]["stl"]["path"].startswith("moulds/")
    ]
    with held(folder):
        try:
            report = slicer.print_report(tools, printer_of(spec), _earlier(folder / SLICED), say)
        except UnitcadError as error:
            return f"not sliced: {error}"
        files.write(folder / SLICED, (json.dumps(report, indent=2) + "\n").encode())
    if repaired := [piece["file"] for piece in report["pieces"] if piece["repaired"]]:
        return f"{report['slicer']} had to repair {some(repaired)}"
    hours, minutes = divmod(round(report["print_s"] / 60), 60)
    return f"prints in {hours} h {minutes:02d} min with {report['filament_cm3']:.1f} cm3 ({report['slicer']})"


def _earlier(path: Path) -> dict[str, Any]:
    try:
        report = files.read_json(path, links=False)
        return report if all({"file", "sha256"} <= piece.keys() for piece in report["pieces"]) else {}
    except (UnitcadError, KeyError, TypeError, AttributeError):
        return {}
