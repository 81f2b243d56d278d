"""Checks of mesh files as they are, before any repair: STL, 3MF, OBJ, PLY, OFF, GLB and STEP, by named rules.

`unitcad.check("part.stl")` calls this package and gives a `CheckResult` (`unitcad.check.check_call`);
`check_file(path, Options())` gives the `FileReport` of one file. Needs numpy and scipy; knows nothing of CAD.
Importing it is light: readers and rules are loaded by the first file that needs them.
"""

import inspect
import sys
from types import ModuleType

from unitcad.check.check_call import CheckResult, check
from unitcad.check.findings import Facts, FileReport, Finding, Location
from unitcad.check.one_file import check_bytes, check_file, check_mesh
from unitcad.check.options import Options
from unitcad.check.rules.f_limits import Limits

__all__ = [
    "CheckResult",
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


class _Callable(ModuleType):
    """A package that may be called, so that `unitcad.check(...)` works beside `from unitcad.check import ...`."""

    __call__ = staticmethod(check)


__signature__ = inspect.signature(check)
sys.modules[__name__].__class__ = _Callable
