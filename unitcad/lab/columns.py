"""Columns of a mechanical test: the quantity and unit of each, by name or as declared.

Nothing is guessed: a column without a unit, or two columns for one quantity, are refused until they are declared as
QUANTITY=COLUMN:UNIT, COLUMN being a name or a number from 1.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from unitcad.errors import Refusal, unknown_name
from unitcad.lab.readers import Recording
from unitcad.lab.units import COLUMN_UNITS, plain

_ANY_CASE = ("lbf", "kgf", "kN", "kPa", "psi", "in", "in/in", "Hz")
"""Units that mean one thing in any case: none has a prefix whose other case is another one."""
_COLUMN_NAMES = {
    "time": r"(?:test )?time|(?:prüf)?zeit|时间",
    "strain": r"(?:(?:engineering|eng\.?|nominal|tensile) )?strain|dehnung|应变",
    "true_strain": r"(?:true|log\w*|hencky) strain",
    "stress": r"(?:(?:engineering|eng\.?|nominal|tensile) )?stress|spannung|应力",
    "true_stress": r"(?:true|cauchy) stress",
    "force": r"force|load|standard force|(?:standard)?kraft|力|载荷",
    "travel": r"(?:crosshead )?(?:travel|displacement)|crosshead|extension|stroke|position|(?:standard)?weg|位移",
    "frequency": r"(?:angular )?freq(?:uency|\.)?",
    "storage": r"storage(?: modulus)?|[eg](?:'|′)",
    "loss": r"loss(?: modulus)?|[eg](?:''|\"|″)",
    "tan_delta": r"tan ?\(?(?:delta|δ)\)?|loss factor",
}
"""Names of a quantity in instruments' files, without its unit."""
_BARE = ("tan_delta",)
"""Quantities that may lack a unit; a strain may not, since a percentage looks like a ratio."""


@dataclass(frozen=True)
class Declared:
    """A declared quantity: its column (a name, or a number from 1) and its unit, "" for the file's."""

    column: str | int
    unit: str = ""


def declared(texts: Iterable[str], field: str = "--column") -> dict[str, Declared]:
    """Parse QUANTITY=COLUMN[:UNIT]. Raises Refusal for anything else."""
    found: dict[str, Declared] = {}
    for text in texts:
        quantity, equals, rest = (part.strip() for part in text.partition("="))
        if not equals or not rest:
            raise Refusal(field, text, "needs the form QUANTITY=COLUMN or QUANTITY=COLUMN:UNIT, such as stress=3:kPa")
        if quantity not in COLUMN_UNITS:
            raise unknown_name(field, quantity, COLUMN_UNITS)
        column, colon, unit = rest.rpartition(":")
        if not colon:
            column, unit = rest, ""
        elif _unit(unit, quantity) is None:
            raise unknown_name(field, unit, COLUMN_UNITS[quantity])
        found[quantity] = Declared(int(column) if column.isdecimal() else column, unit)
    return found


def column_of(recording: Recording, quantity: str, given: Mapping[str, Declared]) -> tuple[int, float] | None:
    """Return the index of a quantity's column and the factor to SI; None if the file has none.

    Raises Refusal if several columns fit, and for a unit that is missing or of another quantity.
    """
    channels = recording.channels
    if quantity in given:
        at = recording.index(given[quantity].column, "--column")
    else:
        fitting = [
            i for i, c in enumerate(channels) if re.fullmatch(_COLUMN_NAMES[quantity], c.name.strip(), re.IGNORECASE)
        ]
        if not fitting:
            return None
        if len(fitting) > 1:
            names = recording.numbered(fitting)
            limit = f"{recording.path.name} has several columns for {quantity}: {names}; declare {quantity}=COLUMN:UNIT"
            raise Refusal("--column", None, limit)
        at = fitting[0]
    unit = given[quantity].unit if quantity in given else ""
    unit = unit or channels[at].unit
    factor = _unit(unit, quantity) if unit else 1.0 if quantity in _BARE else None
    if factor is None:
        said = f"has the unit {unit!r}" if unit else "has no unit"
        limit = f"{recording.path.name}: column {at + 1} ({channels[at].name}) {said}; declare {quantity}={at + 1}:UNIT"
        units = ", ".join(COLUMN_UNITS[quantity])
        raise Refusal("--column", None, f"{limit} with the unit that it is in, of {units}; {columns_of(recording)}")
    return at, factor


def columns_of(recording: Recording) -> str:
    """Say which columns a file has."""
    return f"its columns: {recording.numbered()}"


def columns(recording: Recording, wanted: Mapping[str, tuple[int, float]]) -> tuple[dict[str, np.ndarray], int]:
    """Return the columns (n,) in SI without the rows that lack a number, and how many rows those were."""
    rows = recording.columns([at for at, _ in wanted.values()])
    whole = np.isfinite(rows).all(axis=1)
    found = {name: rows[whole, i] * factor for i, (name, (_, factor)) in enumerate(wanted.items())}
    return found, int((~whole).sum())


def _unit(text: str, quantity: str) -> float | None:
    known, written = COLUMN_UNITS[quantity], plain(text)
    if (factor := known.get(text.strip(), known.get(written))) is not None:
        return factor
    # Only the case may differ, unless it tells prefixes apart: mN and MN, mm and Mm are two units.
    alike = [unit for unit in known if unit.lower() == written.lower()]
    return known[alike[0]] if len(alike) == 1 and alike[0] in _ANY_CASE else None
