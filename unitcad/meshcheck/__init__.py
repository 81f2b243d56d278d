"""Checks of mesh files as they are, before any repair: STL, 3MF, OBJ, PLY, OFF and STEP, by named rules.

`check_file(path, Options())` returns the `FileReport` of one file, `check_mesh(vertices, faces)` that of a mesh.
Of unitcad it needs only `workers`, `errors`, `text`, `files` and `geometry`, and knows nothing of CAD.
"""

from unitcad.meshcheck.file_checks import check_bytes, check_file, check_mesh
from unitcad.meshcheck.findings import Facts, FileReport, Finding, Location
from unitcad.meshcheck.rules.f_file import Limits
from unitcad.meshcheck.rules.inspection import Options

__all__ = [
    "Facts",
    "FileReport",
    "Finding",
    "Limits",
    "Location",
    "Options",
    "check_bytes",
    "check_file",
    "check_mesh",
]
