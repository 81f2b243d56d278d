"""Checks of mesh files as they are, before any repair: STL, 3MF, OBJ, PLY, OFF, GLB and STEP, by named rules.

`check("part.stl")` returns a `CheckResult`, `check_file(path, Options())` the `FileReport` of one file.
Needs numpy and scipy; knows nothing of CAD. The first file that needs a reader or a rule
loads it.
"""

from unitcad.meshcheck.check_call import CheckResult, check
from unitcad.meshcheck.findings import Facts, FileReport, Finding, Location
from unitcad.meshcheck.one_file import check_bytes, check_file, check_mesh
from unitcad.meshcheck.options import Options
from unitcad.meshcheck.rules.f_file import Limits

__all__ = [
    "CheckResult",
    "Facts",
    "FileReport",
    "Finding",
    "Limits",
    "Location",
    "Options",
    "check",
    "check_bytes",
    "check_file",
    "check_mesh",
]
