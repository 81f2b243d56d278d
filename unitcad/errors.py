"""The errors that a person may meet: one clear sentence each; the command line prints it, exits with `exit_code`."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class UnitcadError(Exception):
    """Asked wrongly, or the machine lacks something: exit code 2, no traceback."""

    exit_code = 2

    def as_dict(self) -> dict[str, object]:
        """The error as JSON-ready data."""
        return {"message": str(self)}


class Refusal(UnitcadError):
    """A value that can't be: which field, its value, the limit it breaks and the nearest accepted value.

    `nearest` is a value that may be typed in `field`'s place and that meets this limit (it may then meet another one).
    """

    def __init__(self, field: str, value: object, limit: str, nearest: object = None) -> None:
        self.field, self.value, self.limit, self.nearest = field, value, limit, nearest
        text = f"{field} = {_shown(value)}: {limit}"
        if nearest is not None:
            text += f"; nearest accepted: {_shown(nearest)}"
        super().__init__(text)

    def as_dict(self) -> dict[str, object]:
        return {
            "message": str(self),
            "field": self.field,
            "value": self.value,
            "limit": self.limit,
            "nearest": self.nearest,
        }


def unknown_name(field: str, value: str, known: Iterable[str]) -> Refusal:
    """A refusal of a name that is not in `known`, with the closest names that are."""
    known = sorted(known)
    close = difflib.get_close_matches(value, known, n=3, cutoff=0.4) or known[:8]
    return Refusal(field, value, f"not known; closest: {', '.join(close)}", close[0] if close else None)


def unknown_key(field: str, value: object, known: Iterable[str]) -> Refusal:
    """A refusal of a key that no table has; `field` is its whole path, `known` the keys of that table."""
    table, _, key = field.rpartition(".")
    known = list(known)
    close = difflib.get_close_matches(key, known, n=1, cutoff=0.6)
    nearest = f"{table}.{close[0]}" if table and close else close[0] if close else None
    shown = value if isinstance(value, int | float | str) else str(value)
    return Refusal(field, shown, f"unknown key; known here: {', '.join(known)}", nearest)


def _shown(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.6g}"
    return repr(value) if isinstance(value, str) else str(value)
