"""How much detail a report has: locations of a finding, and meshes to draw. Set while a file is checked."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator
from contextvars import ContextVar
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from unitcad.meshcheck.geometry.mesh import Mesh

SHOWN = 5
"""Locations of a finding unless more are asked for; its count says how many there are."""
MOST = 10_000
"""Locations of a finding that are kept where all are asked for."""


@dataclass(frozen=True)
class Detail:
    """`locations` a finding; `meshes`: where meshes with a finding are collected, None where they are not drawn."""

    locations: int = SHOWN
    meshes: list[Mesh] | None = None


_DEFAULT = Detail()
_DETAIL: ContextVar[Detail] = ContextVar("detail", default=_DEFAULT)


def detail() -> Detail:
    """Return what is kept now."""
    return _DETAIL.get()


@contextlib.contextmanager
def detailed(locations: int, meshes: list[Mesh] | None = None) -> Iterator[None]:
    """Keep at most `locations` locations a finding, and meshes if a list is given, until the block ends."""
    before = _DETAIL.set(Detail(locations, meshes))
    try:
        yield
    finally:
        _DETAIL.reset(before)
