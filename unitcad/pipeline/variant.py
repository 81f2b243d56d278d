"""A variant: a mould set with its ways to other CAD libraries."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from unitcad.moulds.mould_set import MouldSet
from unitcad.validation import load


@dataclass(frozen=True, eq=False)
class Variant(MouldSet):
    """A spec's unit, moulds and meshes. Lengths in mm, as assembled, z = 0 at the skin."""

    @classmethod
    def of(cls, source: str, *overrides: str) -> Variant:
        """Return the variant of a spec file or a template. Raises Refusal or UnitcadError."""
        return cls(load(source, overrides))

    def to_build123d(self) -> Any:
        """Return unit and moulds as a named, coloured build123d Compound. Raises UnitcadError without the extra."""
        from unitcad.kernels import build123d

        return build123d.compound((*self.unit, *self.plan.tools))

    def to_cadquery(self) -> Any:
        """Return unit and moulds as a named, coloured CadQuery Assembly. Raises UnitcadError without the extra."""
        from unitcad.kernels import cadquery

        return cadquery.assembly((*self.unit, *self.plan.tools))
