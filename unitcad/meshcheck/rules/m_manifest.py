"""A file against a build's manifest: M001 to M005."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from unitcad.meshcheck.findings import FileReport, Finding, counted, number
from unitcad.meshcheck.rules.registry import Rule
from unitcad.text import some

M001 = Rule("""
    M001 error: volume differs from the manifest's
    The mesh encloses another volume than the manifest or the B-rep says, by more than a thousandth.
    Example: The manifest says 1200 mm3, the mesh encloses 1180 mm3.
    Fix: Build again; if it stays, the tessellation is at fault.
""")

M002 = Rule("""
    M002 error: solid count
    The file holds another number of solids than the manifest says.
    Example: The manifest counts one solid, and the file holds two pieces.
    Fix: Build again; look for loose pieces.
""")

M003 = Rule("""
    M003 error: hash differs from the manifest's
    The file's SHA-256 is not the one in the manifest: it was changed after it was built.
    Example: Another program opened the file and saved it.
    Fix: Build again.
""")

M004 = Rule("""
    M004 error: file and manifest do not name each other
    The manifest lists a file that is not there, or does not list the file that was to be compared with it.
    Example: lid.stl was renamed after the build.
    Fix: Build again.
""")

M005 = Rule("""
    M005 error: path outside the manifest's folder
    The manifest lists an absolute path, one that climbs with .., or a link that leads out of its folder. Such a file is
    not read.
    Example: The manifest lists ../lid.stl.
    Fix: Keep a build's files in its folder, and list them by paths relative to it.
""")

VOLUME = 1e-3  # M001: a mesh's share of a B-rep's volume that tessellation may cost


@dataclass(frozen=True)
class ListedFile:
    """One file of the manifest: the parts in it (several for an assembly file)."""

    names: tuple[str, ...]
    tool: bool
    sha256: str | None
    volume_mm3: float | None
    solids: int


def check_listed(part: ListedFile, report: FileReport) -> Iterator[Finding]:
    """Apply M001 to M004 to one file."""
    path = Path(report.path)
    if not os.path.isfile(path):
        yield M004.finding(f"listed for {some(part.names)}")
        return
    if part.sha256 is not None:
        import hashlib  # most files are in no manifest

        try:
            with path.open("rb") as file:
                digest = hashlib.file_digest(file, "sha256").hexdigest()
        except OSError as error:
            yield M003.finding(f"cannot be read: {error.strerror or error}")
            return
        if digest != part.sha256.lower():
            yield M003.finding(f"{digest[:12]} instead of {part.sha256[:12]}")
    facts = report.facts
    if facts.shells is not None and facts.shells != part.solids:
        yield M002.finding(f"{counted(facts.shells, 'solid')}, {part.solids} in the manifest")
    if facts.volume_mm3 is not None and part.volume_mm3:
        off = facts.volume_mm3 / part.volume_mm3 - 1
        if abs(off) > VOLUME:
            text = f"{number(facts.volume_mm3)} mm3, {number(part.volume_mm3)} in the manifest ({off:+.2%})"
            yield M001.finding(text)
