"""slicer.json: print time and filament of a built folder's tools, by PrusaSlicer where it is installed."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from unitcad import files
from unitcad.errors import UnitcadError
from unitcad.export import slicer
from unitcad.pipeline.folder import held
from unitcad.pipeline.manifest_records import Manifest
from unitcad.pipeline.stages import Say
from unitcad.spec import Spec, printer_of

SLICED = "slicer.json"


def slice_tools(folder: Path, manifest: Manifest, spec: Spec, say: Say = lambda message: None) -> str:
    """Slice the folder's tools into slicer.json and return in a sentence what they take; "" where nothing is to do.

    Pieces whose STL is that of the slicer.json that is there are not sliced again. A file that the slicer refuses is
    named and no error, since another slicer may take it.
    """
    tools = [
        folder / part["files"]["stl"]["path"]
        for part in manifest["parts"]
        if part["role"] == "tool" and "stl" in part["files"]
    ]
    if not tools:
        return ""
    with held(folder):
        try:
            report = slicer.report(tools, printer_of(spec), _earlier(folder / SLICED), say)
        except UnitcadError as error:
            return f"not sliced: {error}"
        if report is None:
            return ""
        files.write(folder / SLICED, (json.dumps(report, indent=2) + "\n").encode())
    if repaired := [piece["file"] for piece in report["pieces"] if piece["repaired"]]:
        return f"{report['slicer']} had to repair {', '.join(repaired)}"
    hours, minutes = divmod(round(report["print_s"] / 60), 60)
    return f"prints in {hours} h {minutes:02d} min with {report['filament_cm3']:.1f} cm3 ({report['slicer']})"


def _earlier(path: Path) -> dict[str, Any] | None:
    try:
        report = files.read_json(path, links=False)
        return report if all({"file", "sha256"} <= piece.keys() for piece in report["pieces"]) else None
    except (UnitcadError, KeyError, TypeError, AttributeError):
        return None
