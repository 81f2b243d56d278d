"""Whether a candidate can be cast: its unit and moulds are drawn, and every mould check is asked."""

from __future__ import annotations

from dataclasses import dataclass

from unitcad.checks import check_moulds
from unitcad.errors import Refusal
from unitcad.moulds.mould_set import MouldSet
from unitcad.spec import Spec


@dataclass(frozen=True)
class Verdict:
    """How many places were checked, and what failed, a sentence each, with the check's code."""

    checked: int
    failed: tuple[str, ...]

    @property
    def castable(self) -> bool:
        """Whether every check holds."""
        return not self.failed


def castability(spec: Spec) -> Verdict:
    """Draw the moulds of a spec and judge them."""
    try:
        found = check_moulds(MouldSet(spec))
    except Refusal as refusal:
        return Verdict(0, (str(refusal),))
    failed = [
        f"{one.code} {one.where}: {one.value:.3g} against {one.limit:.3g} {one.unit}".rstrip()
        for one in found
        if not one.ok
    ]
    return Verdict(len(found), tuple(failed))
