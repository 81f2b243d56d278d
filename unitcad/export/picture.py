"""Shaded pictures by VTK (CadQuery brings it), drawn in a child process.

VTK without libEGL and without a display ends its process with a segmentation fault. So it is never loaded here: a child
draws; if it crashes and Xvfb is installed, a second one draws under a virtual display; else there is a message.
"""

from __future__ import annotations

import contextlib
import importlib.util
import os
import pickle
import shutil
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from queue import SimpleQueue

import numpy as np

from unitcad.errors import UnitcadError
from unitcad.workers import Pool, WorkerEnded, run, run_here

SECONDS = 300
"""The time after which a child that draws is ended."""


@dataclass(frozen=True)
class Drawn:
    """A closed mesh in a picture: vertices (n, 3) in mm, faces (m, 3), colour of three numbers 0 to 1.

    `label` is written beside it.
    """

    colour: tuple[float, float, float]
    vertices: np.ndarray
    faces: np.ndarray
    label: str = ""


@dataclass(frozen=True)
class Scene:
    """A picture: its parts, the direction from them to the eye, and its size in pixels. +z is up."""

    parts: tuple[Drawn, ...]
    towards_eye: tuple[float, float, float]
    size: tuple[int, int] = (1200, 900)


class NoPicture(UnitcadError):
    """A machine that can't draw: VTK is missing, or there is neither EGL nor Xvfb."""


def draw(scenes: Sequence[Scene]) -> list[bytes]:
    """Draw the scenes as PNG files. Raises NoPicture, with what to install, where this machine can't draw."""
    if importlib.util.find_spec("vtkmodules") is None:
        raise NoPicture("pictures need VTK: in a clone, pip install '.[cadquery]'")
    request = pickle.dumps([(s.size, s.towards_eye, [vars(part) for part in s.parts]) for s in scenes])
    answer = _ask(request, dict(os.environ))
    if answer is None and shutil.which("Xvfb"):
        with _virtual_display() as display:
            answer = _ask(request, {**os.environ, "DISPLAY": display})
    if answer is None:
        raise NoPicture("VTK can't draw here: it needs libEGL (Debian: libegl1) or a virtual display (Debian: xvfb)")
    return answer


def _ask(request: bytes, environment: dict[str, str]) -> list[bytes] | None:
    """Return the child's pictures; None where it crashed."""
    child = [sys.executable, "-P", "-m", "unitcad.export.picture_child"]
    try:
        done = run(child, content=request, seconds=SECONDS, env=environment)
        return pickle.loads(done.stdout) if done.returncode == 0 else None
    except (WorkerEnded, EOFError, pickle.UnpicklingError):
        return None


@contextlib.contextmanager
def _virtual_display() -> Iterator[str]:
    """Run an X server of our own for a while; yield its display. It picks a free number and prints it."""
    command = ["Xvfb", "-displayfd", "1", "-screen", "0", "1280x1024x24", "-nolisten", "tcp"]
    lines: SimpleQueue[tuple[str, str]] = SimpleQueue()
    with Pool() as pool:
        call = pool.submit(run_here, command, lines=True, heard=lambda line: lines.put(line) if line[0] == "out" else 0)
        call.add_done_callback(lambda _: lines.put(("out", "")))  # it ended before it printed a number
        yield f":{lines.get()[1]}"
