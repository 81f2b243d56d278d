"""Where the triangles of a mesh come from in its file: polygon, line, part and object."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from unitcad.geometry.arrays import Ints

_NO_INDEX = np.empty(0, np.int64)


@dataclass(frozen=True, eq=False)
class Source:
    """The places of a mesh's triangles (m) in its file, by polygon (p); what is None or empty is not known.

    `polygons` (m,) gives the polygon of each triangle, None where every triangle is one by itself. `lines` (p,) are
    line numbers from 1. `starts` (s,) are the first polygons of the file's objects, `names` their names, a line each.
    """

    polygons: Ints | None = None
    lines: Ints | None = None
    part: str | None = None
    starts: Ints = field(default_factory=lambda: _NO_INDEX)
    names: bytes = b""

    @cached_property
    def _names(self) -> list[str]:
        return [name.strip() for name in self.names.decode("utf-8", "replace").split("\n")]

    def line(self, polygon: int) -> int | None:
        """Return the line on which a polygon stands."""
        return None if self.lines is None else int(self.lines[polygon])

    def object(self, polygon: int) -> str | None:
        """Return the name of the object that a polygon belongs to."""
        at = int(np.searchsorted(self.starts, polygon, "right")) - 1
        return self._names[at] if at >= 0 and self._names[at] else None
