"""`scipy.special`, loaded without the developer tools of numpy that it would load too.

scipy asks numpy for all its names, and so loads `numpy.f2py` and `numpy.testing`, which it does not use. They take a
third of the time in which scipy.special loads. Here they are made to load when something of them is used.
"""

from __future__ import annotations

import sys
from importlib.util import LazyLoader, find_spec, module_from_spec

import numpy

for _name in ("f2py", "testing"):
    _whole = f"numpy.{_name}"
    _spec = None if _whole in sys.modules else find_spec(_whole)
    if _spec is not None and _spec.loader is not None:
        _spec.loader = LazyLoader(_spec.loader)
        sys.modules[_whole] = _module = module_from_spec(_spec)
        _spec.loader.exec_module(_module)
        setattr(numpy, _name, _module)

from scipy import special  # noqa: E402

__all__ = ["special"]
