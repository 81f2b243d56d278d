"""Layouts: places of the units of an array. Every file here that defines LAYOUT is one."""

from __future__ import annotations

import pkgutil
from functools import cache
from importlib import import_module

from unitcad.arrays.layouts.kind import LayoutKind, Point

__all__ = ["LayoutKind", "Point", "layouts"]

MOST_PLACES = 1024
"""Places of an array, at most."""


@cache
def layouts() -> dict[str, LayoutKind]:
    """Return the kinds of layout by name."""
    modules = (import_module(f"{__name__}.{file.name}") for file in pkgutil.iter_modules(__path__))
    return {module.LAYOUT.name: module.LAYOUT for module in modules if hasattr(module, "LAYOUT")}
