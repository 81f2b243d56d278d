"""The process that writes STEP files for `step_process`: it loads OCCT first, then answers requests one by one."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from unitcad.children import answer_requests
from unitcad.errors import UnitcadError
from unitcad.shape.body import Body


def begin() -> Callable[[tuple[Sequence[Body], str]], bytes | str]:
    """Load OCCT; return what answers (bodies, name) with the file, or with the sentence of an error."""
    from unitcad.export import step

    def answer(asked: tuple[Sequence[Body], str]) -> bytes | str:
        try:
            return step.content(*asked)
        except UnitcadError as error:
            return str(error)

    return answer


if __name__ == "__main__":
    answer_requests(begin)
