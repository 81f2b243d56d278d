"""Scipy, loaded without the developer tools of numpy that it would load too."""

from __future__ import annotations

import sys
from importlib.util import LazyLoader, find_spec, module_from_spec

_TOOLS = ("f2py", "testing")


def postpone_tools() -> None:
    """Have numpy.f2py and numpy.testing load when something of them is used.

    scipy asks numpy for all its names, and so loads both, which it does not use. They take a third of the time in which
    scipy.special loads.
    """
    import numpy

    for name in _TOOLS:
        whole = f"numpy.{name}"
        spec = None if whole in sys.modules else find_spec(whole)
        if spec is None or spec.loader is None:
            continue
        spec.loader = LazyLoader(spec.loader)
        sys.modules[whole] = module = module_from_spec(spec)
        spec.loader.exec_module(module)
        setattr(numpy, name, module)
