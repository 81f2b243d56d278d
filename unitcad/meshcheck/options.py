"""Options of a mesh check: the choices of the user."""

from __future__ import annotations

from dataclasses import dataclass, field

from unitcad.meshcheck.findings import SHOWN
from unitcad.meshcheck.rules.f_file import Limits
from unitcad.meshcheck.rules.inspection import Printer


@dataclass(frozen=True)
class Options:
    """Options of a check: the rules, the output and the printer.

    `select`, `ignore`: prefixes of codes, the longest that fits decides, ignore on a tie; empty select: all. An error
    that ended the check of a file (not readable, a limit reached, no mesh) is always kept.
    `unit`: unit of formats that have none (a key of UNITS_MM); `printer`: D and S002 rules for it.
    `shells`: the number of shells expected (G005). `cross`: look for self-crossing. `strict`: crossings too shallow for
    a printer are errors too. `strict_3mf`: content that the 3MF specification forbids and common programs write is an
    error, not a warning. `unwanted`: prefixes of codes that no select brings back. `locations`: how many are kept of a
    finding; `draw`: keep meshes with the report.
    """

    select: tuple[str, ...] = ()
    ignore: tuple[str, ...] = ()
    unit: str | None = None
    printer: Printer | None = None
    shells: int | None = None
    cross: bool = True
    strict: bool = False
    strict_3mf: bool = False
    limits: Limits = field(default_factory=Limits)
    unwanted: tuple[str, ...] = ()
    locations: int = SHOWN
    draw: bool = False

    def wants(self, code: str) -> bool:
        """Return whether findings of `code` are reported, unless they ended the check: those always are."""
        chosen = max((len(p) for p in self.select if code.startswith(p)), default=-1 if self.select else 0)
        dropped = max((len(p) for p in self.ignore if code.startswith(p)), default=-1)
        return chosen >= 0 and chosen > dropped and not code.startswith(self.unwanted or ("-",))
