"""Checks of mesh files as they are, before any repair: STL, 3MF, OBJ, PLY, OFF, GLB and STEP, by named rules.

`check_file(path, Options())` gives a `FileReport`. Needs numpy and scipy; knows nothing of CAD. Importing it is light:
readers and rules are loaded by the first file that needs them.
"""

from unitcad.check.findings import Facts, FileReport, Finding, Location
from unitcad.check.one_file import check_bytes, check_file, check_mesh
from unitcad.check.options import Options
from unitcad.check.resource_limits import Limits

__all__ = ["Facts", "FileReport", "Finding", "Limits", "Location", "Options", "check_bytes", "check_file", "check_mesh"]
