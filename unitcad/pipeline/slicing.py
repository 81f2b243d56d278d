"""slicer.json: print time and filament of a built folder's tools, by PrusaSlicer where it is installed."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from unitcad import files
from unitcad.errors import UnitcadError
from unitcad.export import slicer
from unitcad.pipeline.folder import held
from unitcad.pipeline.stages import Say
from unitcad.spec import Spec, printer_of

SLICED = "slicer.json"


def slice_tools(folder: Path, manifest: dict[str, Any], spec: Spec, say: Say = lambda message: None) -> str:
    """Slice the folder's tools into slicer.json and say in a sentence what they take; "" where there is nothing to do.

    Pieces whose STL is that of the slicer.json that is there are not sliced again. A file that the slicer does not take
    is said and no error: the folder stands, and another slicer may take it.
    """
    tools = [
        folder / part["files"]["stl"]["path"]
        for part in manifest["parts"]
        if part["role"] == "tool" and "stl" in part["files"]
    ]
    if not tools:
        return ""
    there = folder / SLICED
    with held(folder):
        try:
            found = slicer.report(tools, printer_of(spec), _earlier(there), say)
        except UnitcadError as error:
            return f"not sliced: {error}"
        if found is None:
            return ""
        files.write(there, (json.dumps(found, indent=2) + "\n").encode())
    if repaired := [piece["file"] for piece in found["pieces"] if piece["repaired"]]:
        return f"{found['slicer']} had to repair {', '.join(repaired)}"
    hours, minutes = divmod(round(found["print_s"] / 60), 60)
    return f"prints in {hours} h {minutes:02d} min with {found['filament_cm3']:.1f} cm3 ({found['slicer']})"


def _earlier(path: Path) -> dict[str, Any] | None:
    try:
        found = files.read_json(path, links=False)
        return found if all({"file", "sha256"} <= piece.keys() for piece in found["pieces"]) else None
    except (UnitcadError, KeyError, TypeError, AttributeError):
        return None
