"""The process that makes estimates and pictures for `beside`; it loads what they need first."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from unitcad.children import answer_requests


def begin() -> Callable[[tuple[str, Any]], object]:
    """Return what answers (what, of what); None for what is refused, which the caller then meets itself."""
    from unitcad import estimating  # noqa: F401  the slowest to load
    from unitcad.cache import MemoryStore
    from unitcad.casting.bench_pictures import pictures
    from unitcad.errors import UnitcadError
    from unitcad.moulds.mould_set import MouldSet
    from unitcad.pipeline.artifacts import estimated
    from unitcad.spec import from_json

    sets: dict[str, MouldSet] = {}

    def answer(asked: tuple[str, Any]) -> object:
        what, of = asked
        try:
            if what == "estimate":
                return estimated(MouldSet(from_json(of)), MemoryStore())
            geometry, names = of
            return pictures(sets.setdefault(geometry, MouldSet(from_json(geometry))), names)
        except UnitcadError:
            return None

    return answer


if __name__ == "__main__":
    answer_requests(begin)
