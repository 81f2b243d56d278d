"""What a person reads at the end of an array's build: units, size, casting, checks, crosstalk, the page."""

from __future__ import annotations

import json
import shlex
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from unitcad.arrays.array import Array
from unitcad.arrays.array_extras import CROSSTALK
from unitcad.arrays.construction import construction_of
from unitcad.arrays.crosstalk_words import crosstalk_lines
from unitcad.casting.steps import in_short
from unitcad.meshcheck.findings import counted
from unitcad.pipeline.manifest import Manifest
from unitcad.pipeline.write import PAGE
from unitcad.text import number


def array_summary(array: Array, folder: Path, manifest: Manifest) -> Iterator[str]:
    """Yield a line each: units and size, casting, checks, crosstalk, the page."""
    box = array.sheet.outline
    size = f"{number(box[2] - box[0], 3)} x {number(box[3] - box[1], 3)} mm"
    yield f"{counted(len(array.places), 'unit')} on a sheet of {size}, {number(array.sheet.thickness_mm, 3)} mm thick"
    if manifest["casting"]:
        told = {f"warning: {line}" for line in manifest["warnings"]}
        lines = in_short(json.loads((folder / "casting.json").read_bytes()))
        yield from (line for line in lines if line not in told)
        yield from _more_cavities(array)
    if checks := manifest["laws"]:
        check, passed = manifest["check"], sum(entry["ok"] for entry in checks)
        files = f"{counted(check['errors'], 'error')} and {counted(check['warnings'], 'warning')} in the files"
        yield f"{len(manifest['parts'])} bodies, {passed} of {len(checks)} mould checks passed, {files}"
    crosstalk = folder / CROSSTALK
    if "estimate" in manifest["outputs"] and crosstalk.is_file():
        yield from crosstalk_lines(json.loads(crosstalk.read_bytes()))[:2]
    if (folder / PAGE).is_file():
        yield f"open {shlex.quote(str(folder / PAGE))}"


def _more_cavities(array: Array) -> Iterator[str]:
    """Say that units which are cast one by one may be cast together."""
    held = Counter(array.units.index(place.unit) for place in array.places)
    for i, count in held.items() if construction_of(array.construction, array.cast).own_tails else ():
        if array.units[i].moulds.cavities == (1, 1) and count > 1:
            yield f"{count} units one after the other in one cavity: [moulds] cavities = [2, 2] casts four at once"
