"""A worker process: reads tasks from standard input, answers on standard output, ends when its parent does.

A message is the pickle of bytes, and these of a task or an answer: one that can't be unpickled is read whole.
"""

from __future__ import annotations

import faulthandler
import gc
import importlib
import os
import pickle
import queue
import signal
import threading
from typing import IO

from unitcad.children import end_with_parent, message_pipes


def serve(preload: tuple[str, ...]) -> None:
    """Import `preload`, then run tasks until the parent ends."""
    end_with_parent()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group; the parent decides
    faulthandler.enable()
    tasks, answers = message_pipes()
    for name in preload:
        importlib.import_module(name)
    gc.collect()
    gc.freeze()  # modules last as long as the process: no later collection looks at them
    coming: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    threading.Thread(target=_read, args=(tasks, coming), daemon=True).start()
    while True:
        try:
            function, args, kwargs = pickle.loads(coming.get())
            answer = True, function(*args, **kwargs)
        except Exception as error:
            answer = False, error
        try:
            packed = pickle.dumps(answer)
            pickle.loads(packed) if not answer[0] else None  # an exception may pickle and not come back
        except Exception:
            packed = pickle.dumps((False, RuntimeError(f"{type(answer[1]).__name__}: {answer[1]}")))
        try:
            pickle.dump(packed, answers)
            answers.flush()
        except OSError:
            os._exit(0)


def _read(tasks: IO[bytes], coming: queue.SimpleQueue[bytes]) -> None:
    """Pass on every message; end this process when the parent has ended, whatever it is doing."""
    while True:
        try:
            coming.put(pickle.load(tasks))
        except (EOFError, pickle.UnpicklingError):
            os._exit(0)
