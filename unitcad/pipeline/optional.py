"""Files that a result can do without, such as drawings: a fault costs one file and a sentence, not the result."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import TypeVar

from unitcad.cache import MissingContent
from unitcad.errors import Missing, Unfinished, UnitcadError
from unitcad.pipeline.manifest import Skipped

UNMADE = "could not be made: "
"""How the reason of such a file begins."""
_ENDS_THE_BUILD = (Missing, MissingContent, Unfinished, OSError, MemoryError)
"""Lacks of the machine: another try may succeed."""
_T = TypeVar("_T")


class OptionalFiles:
    """Makes the optional files of a result; `skipped`, which may be the result's own, lists those that can't be made."""

    def __init__(self, skipped: list[Skipped] | None = None) -> None:
        self.skipped: list[Skipped] = [] if skipped is None else skipped

    def made(self, path: str, make: Callable[[], _T]) -> _T | None:
        """Return the result of `make`; None, with an entry in `skipped`, if it fails.

        Raises the errors of a machine that lacks something, and every error if UNITCAD_TRACEBACK is set.
        """
        try:
            return make()
        except _ENDS_THE_BUILD:
            raise
        except Exception as error:
            if os.environ.get("UNITCAD_TRACEBACK"):
                raise
            known = isinstance(error, UnitcadError)
            why = str(error) if known else f"internal error: {type(error).__name__}: {error} (a bug)"
            self.skipped.append(Skipped(output=path, reason=f"{UNMADE}{why}"))
            return None
