"""Processes beside a build: they write its STEP, make its estimate and draw its procedure beside everything else.

The first one loads OCCT from the moment it is started and writes STEP, then draws pictures. Where there is another
core, a second one makes the estimate and the pictures from the start. What none of them has begun when it is wanted is
made by the one who asked.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from concurrent.futures import CancelledError, Future
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, Self

from unitcad.children import Answering, Lost, cores
from unitcad.errors import UnitcadError

# Nothing heavier is imported here: a build starts the processes before it loads its own modules.
if TYPE_CHECKING:
    from contextlib import ExitStack

    from unitcad.moulds.mould_set import MouldSet
    from unitcad.shape.body import Body
    from unitcad.spec import Spec

_CHILD = "unitcad.pipeline.beside_child"


def started(step: bool, rest: bool) -> Beside:
    """Return the processes that pay on this machine, where STEP (`step`) and estimate and pictures (`rest`) are wanted.

    With one core there are none; none writes STEP where OCCT is not installed, or is loaded here already.
    """
    step = step and cores() > 1 and "OCP" not in sys.modules and find_spec("OCP") is not None
    return Beside(step, rest and cores() > 1 + step)


class Beside:
    """The processes, which end with the block; each makes what it is asked for in the order of asking."""

    def __init__(self, step: bool = False, rest: bool = False) -> None:
        self._step = Answering(_CHILD, "step") if step else None
        self._rest = Answering(_CHILD, "estimate") if rest else None
        self._ending: ExitStack | None = None

    def __enter__(self) -> Self:
        from contextlib import ExitStack

        with ExitStack() as ending:
            for process in self._processes:
                ending.enter_context(process)
            self._ending = ending.pop_all()
        return self

    def __exit__(self, *raised: object) -> None:
        if self._ending:
            self._ending.close()

    @property
    def _processes(self) -> list[Answering]:
        return [process for process in (self._step, self._rest) if process]

    def step(self, bodies: Sequence[Body], name: str, here: Callable[[], bytes]) -> Callable[[], bytes]:
        """Ask for the STEP of an assembly; return what waits for it, made by `here` where the process is lost.

        That raises UnitcadError where OCCT fails.
        """
        if self._step is None:
            return here
        asked = self._step.answer(("step", (tuple(bodies), name)))

        def made() -> bytes:
            try:
                answer = asked.result()
            except Lost:
                return here()
            if isinstance(answer, str):
                raise UnitcadError(answer)
            return answer

        return made

    @property
    def estimates(self) -> bool:
        """Whether a process makes estimates from the start."""
        return self._rest is not None

    def estimate(self, spec: Spec, here: Callable[[], dict[str, Any]]) -> Callable[[], dict[str, Any]]:
        """Ask for a spec's estimate; return what gives it, by `here` where the process has not begun or is lost."""
        return _asked(self._rest, spec, lambda text: ("estimate", text), here)

    def pictures(
        self, moulds: MouldSet, names: Sequence[str], here: Callable[[str], bytes]
    ) -> Callable[[], dict[str, bytes]]:
        """Ask for pictures of a procedure by the names of their views; return what gives them, as `estimate`."""
        from unitcad.moulds.mould_set import MouldSet
        from unitcad.spec.custom_code import is_custom

        process = self._rest or self._step
        if process is None or type(moulds) is not MouldSet or moulds.altered or is_custom(moulds.spec.design):
            return lambda: {name: here(name) for name in names}
        asked = {name: process.answer(("picture", (moulds.geometry, name))) for name in names}

        def made() -> dict[str, bytes]:
            # Backwards: the process makes the first ones meanwhile.
            found = {name: _given(asked[name], lambda name=name: here(name)) for name in reversed(names)}
            return {name: found[name] for name in names}

        return made

    def call(self, function: Callable[..., Any], spec: Spec) -> Callable[[], Any]:
        """Ask for what a function of a module gives for a spec; return what gives it, as `estimate`."""
        return _asked(self._rest or self._step, spec, lambda text: ("call", (function, text)), lambda: function(spec))


def _asked(
    process: Answering | None, spec: Spec, request: Callable[[str], object], here: Callable[[], Any]
) -> Callable[[], Any]:
    """Ask a process, where there is one, for what reads a spec, given as JSON; return what gives it."""
    from unitcad.spec import to_json
    from unitcad.spec.custom_code import is_custom

    if process is None or is_custom(spec.design):
        return here
    asked = process.answer(request(to_json(spec)))
    return lambda: _given(asked, here)


def _given(asked: Future[Any], here: Callable[[], Any]) -> Any:
    """Return the process's answer; what `here` makes where it has not begun, is lost or could not."""
    if asked.cancel():
        return here()
    try:
        answer = asked.result()
    except (Lost, CancelledError):
        return here()
    return here() if answer is None else answer
