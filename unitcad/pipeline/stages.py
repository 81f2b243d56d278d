"""The time that each stage of a build takes, and the callbacks that show it and take the files as they come."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from unitcad.pipeline.beside import Beside

Say = Callable[[str], None]
Take = Callable[[str, bytes], None]
"""Takes a file that unit and moulds share with other variants: its path in the folder and its content."""


@dataclass
class Stages:
    """`with stages("meshes"): ...` calls `say`, once a stage, and adds to `seconds`; `take` gets files as they come.

    beside: processes that write STEP, make the estimate and draw the procedure; without them all is made in this one.
    """

    say: Say = lambda stage: None
    take: Take | None = None
    beside: Beside | None = None
    seconds: dict[str, float] = field(default_factory=dict)

    @contextlib.contextmanager
    def __call__(self, stage: str) -> Iterator[None]:
        if stage not in self.seconds:
            self.say(stage)
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[stage] = self.seconds.get(stage, 0.0) + time.perf_counter() - start
