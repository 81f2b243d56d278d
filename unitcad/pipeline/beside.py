"""A second process for a build: it makes a unit's estimate and the pictures of its procedure beside everything else."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import CancelledError, Future
from typing import Any

from unitcad.children import Answering, Lost
from unitcad.moulds.mould_set import MouldSet
from unitcad.spec import Spec, to_json
from unitcad.spec.custom_code import is_custom

_PICTURES = 7
"""Of one request: what the process has not begun when it is wanted is made by the one who asked."""


class Beside(Answering):
    """The process, which ends with the block. What it is asked for is made in the order of asking."""

    def __init__(self) -> None:
        super().__init__("unitcad.pipeline.beside_child")

    def estimate(self, spec: Spec, here: Callable[[], dict[str, Any]]) -> Callable[[], dict[str, Any]]:
        """Ask for a spec's estimate; return what gives it, by `here` where the process has not begun or is lost."""
        if is_custom(spec.design):
            return here
        asked = self.answer(("estimate", to_json(spec)))
        return lambda: _given(asked, here)

    def pictures(
        self, moulds: MouldSet, names: Sequence[str], here: Callable[[Sequence[str]], Mapping[str, bytes]]
    ) -> Callable[[], dict[str, bytes]]:
        """Ask for pictures of a procedure by their names; return what gives them, by their paths, as `estimate`."""
        if type(moulds) is not MouldSet or moulds.altered or is_custom(moulds.spec.design):
            return lambda: dict(here(names))
        some = [names[i : i + _PICTURES] for i in range(0, len(names), _PICTURES)]
        asked = [(each, self.answer(("pictures", (moulds.geometry, each)))) for each in some]

        def made() -> dict[str, bytes]:
            # Backwards: the process makes the first ones meanwhile.
            found = [_given(future, lambda each=each: here(each)) for each, future in reversed(asked)]
            return {path: content for part in reversed(found) for path, content in part.items()}

        return made


def _given(asked: Future[Any], here: Callable[[], Any]) -> Any:
    """Return the process's answer; what `here` makes where it has not begun, is lost or could not."""
    if asked.cancel():
        return here()
    try:
        answer = asked.result()
    except (Lost, CancelledError):
        return here()
    return here() if answer is None else answer
