"""A worker process: reads tasks from standard input, answers on standard output, ends when its parent does."""

from __future__ import annotations

import contextlib
import ctypes
import faulthandler
import importlib
import os
import pickle
import signal
import sys

from unitcad.batch.frames import receive, send


def serve(preload: tuple[str, ...]) -> None:
    """Import `preload`, then run tasks until the parent goes."""
    _die_with_parent()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group; the parent decides
    faulthandler.enable()
    tasks, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(2, 1)  # what a kernel prints must not get between the answers
    for name in preload:
        importlib.import_module(name)
    while True:
        try:
            message = receive(tasks)
        except EOFError:
            os._exit(0)
        try:
            function, args, kwargs = pickle.loads(message)
            answer = True, function(*args, **kwargs)
        except Exception as error:
            answer = False, error
        try:
            packed = pickle.dumps(answer)
            pickle.loads(packed) if not answer[0] else None  # an exception may pickle and not come back
        except Exception:
            packed = pickle.dumps((False, RuntimeError(f"{type(answer[1]).__name__}: {answer[1]}")))
        try:
            send(answers, packed)
        except OSError:
            os._exit(0)


def _die_with_parent() -> None:
    """On Linux the kernel ends us when the parent's thread ends, even inside a CAD kernel that hangs."""
    if sys.platform == "linux":
        with contextlib.suppress(OSError, AttributeError):
            ctypes.CDLL(None, use_errno=True).prctl(1, signal.SIGKILL)  # PR_SET_PDEATHSIG
