"""What a person reads at the end of a build: size, time, grams, warnings, level, where to look."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

from unitcad.batch.row import row
from unitcad.casting.time_line import duration
from unitcad.pipeline.build import Built
from unitcad.pipeline.folder import PAGE
from unitcad.spec import Spec
from unitcad.text import number


def summary(spec: Spec, built: Built) -> Iterator[str]:
    """Yield a line each: size and mass, times, grams, checks, the edge level, the page. What was not made has none."""
    manifest = built.manifest
    columns = row(spec, manifest)
    boxes = [part["bbox_mm"] for part in manifest["parts"] if part["role"] == "unit"]
    if boxes:
        height = max(box[5] for box in boxes) - min(box[2] for box in boxes)
        mass = columns.get("silicone_mass_g")
        silicone = f", {number(mass, 3)} g of silicone" if isinstance(mass, float) else ""
        yield f"{number(spec.diameter_mm, 3)} mm across, {number(height, 3)} mm high{silicone}"
    if manifest["casting"]:
        yield from _casting(built.folder)
    checks, check = manifest["laws"], manifest["check"]
    if checks:
        passed = sum(entry["ok"] for entry in checks)
        files = f"{check['errors']} errors and {check['warnings']} warnings in the files"
        yield f"{len(manifest['parts'])} bodies, {passed} of {len(checks)} mould checks passed, {files}"
    if level := manifest["estimate"]:
        yield level["answer"]
    if (built.folder / PAGE).is_file():
        yield f"open {built.folder / PAGE}"


def _casting(folder: Path) -> Iterator[str]:
    procedure = json.loads((folder / "casting.json").read_bytes())
    grams: dict[str, float] = defaultdict(float)
    for pour in procedure["pours"]:
        grams[pour["material"]] += pour["part_a_g"] + pour["part_b_g"]
    total, bench = duration(procedure["earliest_finish_min"]), duration(procedure["bench_min"])
    pours = len(procedure["pours"])
    yield f"{pours} pour{'s' if pours > 1 else ''}, ready {total} after the print, of which {bench} at the bench"
    yield "to mix: " + ", ".join(f"{number(mass, 3)} g of {name}" for name, mass in grams.items())
