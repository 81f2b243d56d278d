"""STEP files from a process of their own: it loads OCCT from the moment it is started, beside the caller's work."""

from __future__ import annotations

import contextlib
import os
import pickle
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from importlib.util import find_spec

from unitcad.errors import UnitcadError
from unitcad.shape.body import Body


def worthwhile() -> bool:
    """Tell whether a process of its own saves time: OCCT is installed and not loaded here, and there are two cores."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return cores > 1 and "OCP" not in sys.modules and find_spec("OCP") is not None


class Lost(Exception):
    """A process that ended before it answered."""


class StepProcess:
    """The process, which ends with the block. `ask` answers later; files are made in the order of asking."""

    def __init__(self) -> None:
        self._child = subprocess.Popen(
            [sys.executable, "-P", "-m", "unitcad.export.step_child"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            start_new_session=True,  # a signal from a terminal reaches the caller alone
        )
        self._thread = ThreadPoolExecutor(1)

    def __enter__(self) -> StepProcess:
        return self

    def __exit__(self, *raised: object) -> None:
        self._child.kill()  # it holds nothing that must be written
        self._thread.shutdown(cancel_futures=True)
        with contextlib.suppress(BrokenPipeError):
            self._child.__exit__(None, None, None)

    def ask(self, bodies: Sequence[Body], name: str) -> Future[bytes]:
        """Return the STEP of an assembly to come.

        Its result raises UnitcadError where OCCT fails, and Lost where the process ended first.
        """
        return self._thread.submit(self._answered, pickle.dumps((tuple(bodies), name)))

    def _answered(self, request: bytes) -> bytes:
        assert self._child.stdin is not None
        assert self._child.stdout is not None
        try:
            self._child.stdin.write(request)
            self._child.stdin.flush()
            answer = pickle.load(self._child.stdout)
        except (OSError, ValueError, EOFError, pickle.UnpicklingError) as error:
            raise Lost from error
        if isinstance(answer, str):
            raise UnitcadError(answer)
        return answer
