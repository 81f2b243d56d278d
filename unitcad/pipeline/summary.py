"""The lines that a person reads at the end of a build."""

from __future__ import annotations

import shlex
from collections.abc import Container, Iterator
from pathlib import Path

from unitcad.casting.steps import casting_summary
from unitcad.designs import widths
from unitcad.documents import read_json
from unitcad.meshcheck.findings import counted
from unitcad.moulds.heights import as_printed
from unitcad.moulds.mould_set import MouldSet
from unitcad.pipeline.manifest import BENCH, PAGE, Manifest, PartRecord, row
from unitcad.spec import Spec, assumed_lengths, length_text
from unitcad.text import join_words, number

MOULDED = {"moulds", "casting"}
"""Outputs with which a person prints."""


def unit_summary(moulds: MouldSet, folder: Path, manifest: Manifest) -> Iterator[str]:
    """Yield a line each: size, mass and checks; lengths to measure; what to print and mix; when it is ready; the level.

    The last line has the page to open. Skipped outputs have no line.

    A length that the set's spec was given counts as measured.
    """
    spec = moulds.spec
    columns, checked = row(spec, manifest), checks_text(manifest)
    parts = [part for part in manifest["parts"] if part["role"] == "unit"]
    casting = read_json(folder / "casting.json") if manifest["casting"] else None
    if parts:
        high, alone = _height(parts), _height([part for part in parts if part["made"] != "bought"])
        circuit = f" with its circuit, {alone} without" if alone != high and spec.fpcb else ""
        mass = columns.get("silicone_mass_g")
        silicone = f", {number(mass, 3)} g of silicone" if isinstance(mass, float) else ""
        cells = casting["cells"] if casting else 1
        each = f"{cells} units, each " if cells > 1 else ""
        cast = [part["bbox_mm"] for part in parts if part["made"] != "bought"]  # without motor, circuit and wires
        across = " x ".join(number(width, 3) for width in widths(spec, cast))
        made = as_printed(moulds) if MOULDED & set(manifest["outputs"]) else ""
        if made and circuit:
            made += f", {high} with its circuit"
        yield f"{each}{across} mm across, {made or f'{high} mm high{circuit}'}{silicone}{checked}"
    elif checked:
        yield checked.removeprefix("; ")
    yield from assumed_line(spec, moulds.given)
    if casting:
        yield from casting_summary(casting, manifest["files"])
    if level := manifest["estimate"]:
        yield level["line"]
    yield from to_open(folder)


def assumed_line(spec: Spec, given: Container[str], path: str = "") -> Iterator[str]:
    """Yield a line of the lengths that nobody measured, if there are any; `path`: of the spec in its file."""
    if assumed := assumed_lengths(spec, given, path):
        told = {key: how.partition("; ") for key, how in assumed.items()}
        lengths = join_words(f"{path}{length_text(spec, key)} ({how})" for key, (how, _, _) in told.items())
        lengths += "".join(f". {more[0].upper()}{more[1:]}" for _, _, more in told.values() if more)
        yours = f". Build with yours: --set {path}{next(iter(assumed))}=MM" if path else ""
        yield f"measure first; assumed: {lengths}{yours}"


def checks_text(manifest: Manifest) -> str:
    """Return "; checks: N of M" with the faults of files if there are any; "" for a result that was not checked."""
    checks, check = manifest["mould_checks"], manifest["check"]
    if not checks:
        return ""
    passed = sum(entry["ok"] for entry in checks)
    found = (("error", check["errors"]), ("warning", check["warnings"]))
    faults = [counted(count, kind) for kind, count in found if count]
    files = f", {join_words(faults)} in the files" if faults else ""
    return f"; checks: {passed} of {len(checks)}{files}"


def to_open(folder: Path) -> Iterator[str]:
    """Yield a line for the pages of a result's folder."""
    there = [name for name in (BENCH, PAGE) if (folder / name).is_file()]
    if there:
        first = shlex.quote(str(folder / there[0]))
        yield f"open {first} to cast; {PAGE} is next to it" if len(there) > 1 else f"open {first}"


def _height(parts: list[PartRecord]) -> str:
    boxes = [part["bbox_mm"] for part in parts]
    return number(max((box[5] for box in boxes), default=0.0) - min((box[2] for box in boxes), default=0.0), 3)
