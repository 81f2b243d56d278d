"""PrusaSlicer, headless, if it is installed: whether it reads a file without repair, print time and filament."""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from unitcad import files
from unitcad.catalogue import Printer
from unitcad.errors import Missing, Refusal, UnitcadError
from unitcad.spec import Spec, printer_of
from unitcad.text import some
from unitcad.workers import TimedOut, cores, run

PROGRAMS = ("prusa-slicer", "prusa-slicer-console", "PrusaSlicer")
"""Its names on the path of Linux, Windows and macOS."""
PLACES = {
    "darwin": (
        "/Applications/PrusaSlicer.app/Contents/MacOS/PrusaSlicer",
        "/Applications/Original Prusa Drivers/PrusaSlicer.app/Contents/MacOS/PrusaSlicer",
    ),
    "win32": (r"C:\Program Files\Prusa3D\PrusaSlicer\prusa-slicer-console.exe",),
}
"""Its folders by `sys.platform`, if its installer does not add it to the path."""
TIMEOUT_S = 300
FILAMENT_MM = 1.75
SLICED = "slicer.json"
_REPAIRS = re.compile(r"^(?:degenerate_facets|edges_fixed|facets_removed|facets_reversed|backwards_edges)\s*=", re.M)


@dataclass(frozen=True)
class Sliced:
    """One file as the slicer read it. `repaired`: it was not manifold, or something had to be repaired."""

    file: str
    repaired: bool
    print_s: int
    filament_mm: float
    filament_cm3: float


def program() -> str | None:
    """Return PrusaSlicer's command: on the path, or in the folder of its installer; None if there is none."""
    return next((path for name in (*PROGRAMS, *PLACES.get(sys.platform, ())) if (path := shutil.which(name))), None)


def needs_repair(path: Path) -> bool:
    """Tell whether PrusaSlicer finds anything to repair in a mesh file; fast, nothing is sliced.

    Raises UnitcadError if the slicer is missing or does not read the file.
    """
    output = _run("--info", str(path))
    if "manifold" not in output:
        raise UnitcadError(f"{path}: PrusaSlicer does not read it: {output.strip()[-200:]}")
    return "manifold = yes" not in output or bool(_REPAIRS.search(output))


def slice_file(path: Path, printer: Printer) -> Sliced:
    """Slice one STL with the slicer's own defaults and this printer's layers. Raises UnitcadError if that fails."""
    with tempfile.TemporaryDirectory(prefix="unitcad-slice-") as scratch:
        code = Path(scratch) / "out.gcode"
        layer, nozzle = float(printer.layer_mm), float(printer.nozzle_mm or 0.4)
        output = _run(
            "--export-gcode",
            *("--output", str(code)),
            *("--nozzle-diameter", f"{nozzle:g}"),
            *("--layer-height", f"{layer:g}"),
            *("--first-layer-height", f"{layer:g}"),
            *("--filament-diameter", f"{FILAMENT_MM:g}"),
            str(path),
        )
        if not code.is_file():
            raise UnitcadError(f"{path}: PrusaSlicer wrote nothing: {output.strip()[-200:]}")
        text = code.read_text("utf-8", "replace")
    return Sliced(
        path.name,
        needs_repair(path),
        _seconds(_value(text, "estimated printing time (normal mode)")),
        float(_value(text, "filament used [mm]")),
        float(_value(text, "filament used [cm3]")),
    )


def print_report(
    paths: Sequence[Path], printer: Printer, earlier: Mapping[str, Any], say: Callable[[str], object]
) -> dict[str, Any]:
    """Slice binary STL files, several at a time; return the content of slicer.json.

    Pieces of the `earlier` report with the same content, printer and slicer are taken from it. `say` gets the name of
    each file that is sliced. Raises UnitcadError for a file that the slicer refuses.
    """
    head = {"slicer": _version(), "printer": printer.name, "layer_mm": float(printer.layer_mm)}
    same = {key: earlier.get(key) for key in head} == head
    known = {(piece["file"], piece["sha256"]): piece for piece in earlier["pieces"]} if same else {}

    def piece(path: Path) -> dict[str, Any]:
        sha256 = hashlib.sha256(path.read_bytes()).hexdigest()
        if (path.name, sha256) in known:
            return known[path.name, sha256]
        say(f"slicing {path.name}")
        return {**asdict(slice_file(path, printer)), "sha256": sha256}

    with ThreadPoolExecutor(cores()) as pool:
        pieces = list(pool.map(piece, paths))
    return {
        **head,
        "pieces": pieces,
        "print_s": sum(piece["print_s"] for piece in pieces),
        "filament_cm3": round(sum(piece["filament_cm3"] for piece in pieces), 3),
        "note": "the slicer's own defaults but for nozzle and layer height; each piece printed by itself",
    }


def _version() -> str:
    """Return the slicer's own name and version."""
    name = re.search(r"^(PrusaSlicer-\S+)", _run("--help"), re.M)
    return name.group(1) if name else "PrusaSlicer"


def _run(*arguments: str) -> str:
    command = program()
    if command is None:
        raise UnitcadError("PrusaSlicer is not installed")
    try:
        # It ends at once if the user's locale is not installed; this one always is.
        done = run([command, *arguments], seconds=TIMEOUT_S, env={**os.environ, "LC_ALL": "C"})
    except TimedOut:
        raise UnitcadError(f"PrusaSlicer took more than {TIMEOUT_S} s") from None
    return (done.stdout + done.stderr).decode("utf-8", "replace")


def _value(text: str, name: str) -> str:
    match = re.search(rf"^; {re.escape(name)} = (.+)$", text, re.M)
    if not match:
        raise UnitcadError(f"PrusaSlicer's G-code does not say: {name}")
    return match.group(1).strip()


def _seconds(text: str) -> int:
    """Read "1d 2h 3m 4s" as seconds."""
    units = {"d": 86400, "h": 3600, "m": 60, "s": 1}
    return sum(int(number) * units[unit] for number, unit in re.findall(r"(\d+)([dhms])", text))


def check_slicing(spec: Spec, only: Sequence[str]) -> None:
    """Raise UnitcadError, before the work, if nothing of a spec can be sliced."""
    if program() is None:
        raise Missing("--slice: PrusaSlicer is not installed, or not on the path (prusa-slicer)")
    if "moulds" not in only:
        raise Refusal("--only", ",".join(only), "has no moulds, which --slice is for", ",".join((*only, "moulds")))
    if "stl" not in spec.output.formats:
        raise Refusal("output.formats", list(spec.output.formats), "has no stl, which --slice reads")
    printer = printer_of(spec)
    if printer.technology.value != "fdm":
        raise Refusal("moulds.printer", printer.name, "prints no filament: leave out --slice", "fdm-0.4")


def slice_tools(spec: Spec, folder: Path, manifest: Mapping[str, Any], say: Callable[[str], object]) -> str:
    """Write the slicer.json of a built folder's tools and return a sentence with time and filament.

    A file that the slicer refuses is named. It is no error, since another slicer may accept it.
    """
    tools = [
        folder / part["files"]["stl"]["path"]
        for part in manifest["parts"]
        if part["role"] == "tool" and "stl" in part["files"] and part["files"]["stl"]["path"].startswith("moulds/")
    ]
    try:
        report = print_report(tools, printer_of(spec), _earlier(folder / SLICED), say)
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
