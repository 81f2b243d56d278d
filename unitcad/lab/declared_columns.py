"""Columns of a mechanical test: which one holds which quantity, in which unit, by name or as declared.

Nothing is guessed: a column without a unit, or two columns for one quantity, are refused until they are declared as
QUANTITY=COLUMN:UNIT, COLUMN being a name or a number from 1.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from unitcad.errors import Refusal, unknown_name
from unitcad.lab.quantities import plain
from unitcad.lab.recording import Recording

_PRESSURE = {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "N/mm2": 1e6, "psi": 6894.757293168}
_STRAIN = {"1": 1.0, "%": 1e-2, "mm/mm": 1.0, "m/m": 1.0, "in/in": 1.0, "-": 1.0}
UNITS: Mapping[str, Mapping[str, float]] = {
    "time": {"s": 1.0, "ms": 1e-3, "min": 60.0},
    "strain": _STRAIN,
    "true_strain": _STRAIN,
    "stress": _PRESSURE,
    "true_stress": _PRESSURE,
    "force": {"N": 1.0, "mN": 1e-3, "kN": 1e3, "lbf": 4.4482216152605, "gf": 9.80665e-3, "kgf": 9.80665},
    "travel": {"mm": 1e-3, "um": 1e-6, "cm": 1e-2, "m": 1.0, "in": 0.0254},
    "frequency": {"Hz": 1.0, "rad/s": 1.0 / (2.0 * np.pi)},
    "storage": _PRESSURE,
    "loss": _PRESSURE,
    "tan_delta": {"1": 1.0, "-": 1.0},
}
"""Factors to SI by quantity and unit; frequency to Hz."""
_ANY_CASE = ("lbf", "kgf", "kN", "kPa", "psi", "in", "in/in", "Hz")
"""Units that mean one thing in any case: none has a prefix whose other case is another one."""
_NAMES = {
    "time": r"(?:test )?time",
    "strain": r"(?:(?:engineering|eng\.?|nominal|tensile) )?strain",
    "true_strain": r"(?:true|log\w*|hencky) strain",
    "stress": r"(?:(?:engineering|eng\.?|nominal|tensile) )?stress",
    "true_stress": r"(?:true|cauchy) stress",
    "force": r"force|load|standard force",
    "travel": r"travel|displacement|extension|crosshead(?: travel| displacement)?|position",
    "frequency": r"(?:angular )?freq(?:uency|\.)?",
    "storage": r"storage(?: modulus)?|[eg](?:'|′)",
    "loss": r"loss(?: modulus)?|[eg](?:''|\"|″)",
    "tan_delta": r"tan ?\(?(?:delta|δ)\)?|loss factor",
}
"""What an instrument calls a quantity, without its unit."""
_BARE = ("tan_delta",)
"""Quantities that may stand without a unit; a strain may not, since a percentage looks like a ratio."""


@dataclass(frozen=True)
class Declared:
    """What a person said of one quantity: its column (a name, or a number from 1) and its unit, "" for the file's."""

    column: str | int
    unit: str = ""


def declared(texts: Iterable[str], field: str = "--column") -> dict[str, Declared]:
    """Parse QUANTITY=COLUMN[:UNIT]. Raises Refusal for anything else."""
    found: dict[str, Declared] = {}
    for text in texts:
        quantity, equals, rest = (part.strip() for part in text.partition("="))
        if not equals or not rest:
            raise Refusal(field, text, "needs the form QUANTITY=COLUMN or QUANTITY=COLUMN:UNIT, such as stress=3:kPa")
        if quantity not in UNITS:
            raise unknown_name(field, quantity, UNITS)
        column, colon, unit = rest.rpartition(":")
        if not colon:
            column, unit = rest, ""
        elif _unit(unit, quantity) is None:
            raise unknown_name(field, unit, UNITS[quantity])
        found[quantity] = Declared(int(column) if column.isdecimal() else column, unit)
    return found


def column_of(recording: Recording, quantity: str, given: Mapping[str, Declared]) -> tuple[int, float] | None:
    """Return the index of a quantity's column and the factor to SI; None where the file has none.

    Raises Refusal where several columns fit, and for a unit that is missing or of another quantity.
    """
    channels = recording.channels
    if quantity in given:
        at = recording.index(given[quantity].column, "--column")
    else:
        fitting = [i for i, c in enumerate(channels) if re.fullmatch(_NAMES[quantity], c.name.strip(), re.IGNORECASE)]
        if not fitting:
            return None
        if len(fitting) > 1:
            names = ", ".join(f"{i + 1} {channels[i].name!r}" for i in fitting)
            limit = f"{recording.path.name} has several columns for {quantity}: {names}; declare {quantity}=COLUMN:UNIT"
            raise Refusal("--column", None, limit)
        at = fitting[0]
    unit = given[quantity].unit if quantity in given else ""
    unit = unit or channels[at].unit
    factor = _unit(unit, quantity) if unit else 1.0 if quantity in _BARE else None
    if factor is None:
        said = f"has the unit {unit!r}" if unit else "has no unit"
        limit = f"{recording.path.name}: column {at + 1} ({channels[at].name}) {said}; declare {quantity}={at + 1}:UNIT"
        units = ", ".join(UNITS[quantity])
        raise Refusal("--column", None, f"{limit} with the unit that it is in, of {units}; {columns_of(recording)}")
    return at, factor


def columns_of(recording: Recording) -> str:
    """Say which columns a file has."""
    return "its columns: " + ", ".join(f"{i} {channel.name}" for i, channel in enumerate(recording.channels, 1))


def columns(recording: Recording, wanted: Mapping[str, tuple[int, float]]) -> tuple[dict[str, np.ndarray], int]:
    """Return the columns (n,) in SI without the rows that lack a number, and how many rows those were."""
    indices = tuple(at for at, _ in wanted.values())
    rows = np.concatenate([np.asarray(block, float) for block in recording.read(indices)])
    whole = np.isfinite(rows).all(axis=1)
    found = {name: rows[whole, i] * factor for i, (name, (_, factor)) in enumerate(wanted.items())}
    return found, int((~whole).sum())


def _unit(text: str, quantity: str) -> float | None:
    known, written = UNITS[quantity], plain(text)
    if (factor := known.get(text.strip(), known.get(written))) is not None:
        return factor
    # Case alone may differ where it can't be a prefix's: mN and MN, mm and Mm are two units.
    alike = [unit for unit in known if unit.lower() == written.lower()]
    return known[alike[0]] if len(alike) == 1 and alike[0] in _ANY_CASE else None
