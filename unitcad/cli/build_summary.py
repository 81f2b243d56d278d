"""The summary at the end of a build: size, time, grams, warnings, level, pages to open."""

from __future__ import annotations

import json
import shlex
from collections.abc import Container, Iterator
from pathlib import Path

from unitcad.casting.steps import casting_summary
from unitcad.designs import widths
from unitcad.meshcheck.findings import counted
from unitcad.pipeline.manifest import PartRecord, row
from unitcad.pipeline.write import BENCH, PAGE, Built
from unitcad.spec import Spec, assumed_lengths, said_of
from unitcad.text import listed, number


def summary(spec: Spec, built: Built, given: Container[str] = ()) -> Iterator[str]:
    """Yield a line each: size and mass, times, grams, checks, the edge level, the page. Skipped outputs have no line.

    A length that is `given`, by its path, counts as measured.
    """
    manifest = built.manifest
    columns = row(spec, manifest)
    parts = [part for part in manifest["parts"] if part["role"] == "unit"]
    if parts:
        high, alone = _height(parts), _height([part for part in parts if part["made"] != "bought"])
        circuit = f" with its circuit, {alone} without" if alone != high and spec.fpcb else ""
        mass = columns.get("silicone_mass_g")
        silicone = f", {number(mass, 3)} g of silicone" if isinstance(mass, float) else ""
        cells = json.loads((built.folder / "casting.json").read_bytes())["cells"] if manifest["casting"] else 1
        each = f"{cells} units, each " if cells > 1 else ""
        yield f"{each}{_across(spec, manifest['parts'])} mm across, {high} mm high{circuit}{silicone}"
    yield from assumed_line(spec, given)
    if manifest["casting"]:
        yield from casting_summary(json.loads((built.folder / "casting.json").read_bytes()))
    checks, check = manifest["mould_checks"], manifest["check"]
    if checks:
        passed = sum(entry["ok"] for entry in checks)
        files = f"{counted(check['errors'], 'error')} and {counted(check['warnings'], 'warning')} in the files"
        yield f"{len(manifest['parts'])} bodies, {passed} of {len(checks)} mould checks passed, {files}"
    if level := manifest["estimate"]:
        yield from level["lines"]
    yield from to_open(built.folder)


def assumed_line(spec: Spec, given: Container[str], path: str = "") -> Iterator[str]:
    """Yield a line of the lengths that nobody measured, if there are any; `path`: of the spec in its file."""
    assumed = {key: how for key, how in assumed_lengths(spec).items() if path + key not in given}
    if assumed:
        lengths = listed(f"{path}{said_of(spec, key)} ({how})" for key, how in assumed.items())
        yours = f"; build with yours: --set {path}{next(iter(assumed))}=MM" if path else ""
        yield f"measure first; assumed: {lengths}{yours}"


def to_open(folder: Path) -> Iterator[str]:
    """Yield a line for each page of a result's folder."""
    for name, use in ((BENCH, " to cast"), (PAGE, "")):
        if (folder / name).is_file():
            yield f"open {shlex.quote(str(folder / name))}{use}"


def _height(parts: list[PartRecord]) -> str:
    boxes = [part["bbox_mm"] for part in parts]
    return number(max((box[5] for box in boxes), default=0.0) - min((box[2] for box in boxes), default=0.0), 3)


def _across(spec: Spec, parts: list[PartRecord]) -> str:
    """Return a unit's width without motor, circuit and wires, as text: "14", or "30 x 20"."""
    boxes = [part["bbox_mm"] for part in parts if part["role"] == "unit" and part["made"] != "bought"]
    return " x ".join(number(width, 3) for width in widths(spec, boxes))
