"""A process that loads OCCT and makes STEP next to everything else. Light: it starts before other modules load."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from importlib.util import find_spec
from typing import Any

from unitcad.workers import Pool, cores

_pool: Pool | None = None
_STEP = "unitcad.export.step"


def start() -> None:
    """Start the process if a second core is free, and OCCT is installed and not loaded here already."""
    global _pool
    if _pool is None and cores() > 1 and "OCP" not in sys.modules and find_spec("OCP") is not None:
        _pool = Pool(load=(_STEP,))


def begin(bodies: Sequence[Any], name: str, here: Callable[[], bytes]) -> Callable[[], bytes]:
    """Begin the STEP of an assembly; return a function that waits for it. `here` makes it if there is no process."""
    if _pool is None:
        return here
    call = _pool.submit(f"{_STEP}:content", bodies, name)
    return lambda: call.result_or(here, wait=True)
