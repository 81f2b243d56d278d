"""STEP files from a process of their own: it loads OCCT from the moment it is started, beside the caller's work."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from importlib.util import find_spec

from unitcad.children import Answering, cores
from unitcad.errors import UnitcadError
from unitcad.shape.body import Body


def worthwhile() -> bool:
    """Tell whether a process of its own saves time: OCCT is installed and not loaded here, and there are two cores."""
    return cores() > 1 and "OCP" not in sys.modules and find_spec("OCP") is not None


class StepProcess(Answering):
    """The process, which ends with the block. `ask` answers later; files are made in the order of asking."""

    def __init__(self) -> None:
        super().__init__("unitcad.export.step_child")

    def ask(self, bodies: Sequence[Body], name: str) -> Callable[[], bytes]:
        """Ask for the STEP of an assembly; return what waits for it.

        That raises UnitcadError where OCCT fails, and Lost where the process ended first.
        """
        asked = self.answer((tuple(bodies), name))

        def made() -> bytes:
            answer = asked.result()
            if isinstance(answer, str):
                raise UnitcadError(answer)
            return answer

        return made
