"""A process of `beside`; its argument is what it loads first: "step" or "estimate"."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from unitcad.children import answer_requests
from unitcad.errors import UnitcadError
from unitcad.heap import keep_freed_memory, seek_cycles_seldom
from unitcad.lean_import import postpone_tools

if TYPE_CHECKING:
    from unitcad.casting.bench_pictures import BenchPictures
    from unitcad.shape.body import Body


def begin() -> Callable[[tuple[str, Any]], object]:
    """Return what answers (what, of what); None for what is refused, which the caller then meets itself."""
    seek_cycles_seldom()  # before anything heavy is loaded
    keep_freed_memory()
    from unitcad.casting.bench_pictures import BenchPictures
    from unitcad.moulds.mould_set import MouldSet
    from unitcad.spec import from_json

    if "step" in sys.argv:
        from unitcad.export import step  # noqa: F401
    else:
        postpone_tools()
        from unitcad import estimating  # noqa: F401

    benches: dict[str, BenchPictures] = {}

    def pictures(geometry: str) -> BenchPictures:
        if geometry not in benches:
            benches.clear()
            benches[geometry] = BenchPictures(MouldSet(from_json(geometry)))
        return benches[geometry]

    def answer(asked: tuple[str, Any]) -> object:
        what, of = asked
        try:
            match what:
                case "step":
                    return _step(*of)
                case "estimate":
                    from unitcad.estimating import estimate_spec

                    return estimate_spec(from_json(of))
                case "call":
                    function, spec = of
                    return function(from_json(spec))
                case _:
                    geometry, name = of
                    return pictures(geometry).picture(name)
        except UnitcadError:
            return None

    return answer


def _step(bodies: Sequence[Body], name: str) -> bytes | str:
    """Return the STEP of an assembly, or the sentence of an error."""
    from unitcad.export import step

    try:
        return step.content(bodies, name)
    except UnitcadError as error:
        return str(error)


if __name__ == "__main__":
    answer_requests(begin)
