"""Saves of files by an editor: for `build --watch`."""

from __future__ import annotations

import time
import tomllib
from collections.abc import Iterable, Iterator
from pathlib import Path

from unitcad.spec.custom_code import files_named

EVERY_S = 0.25
"""Seconds between two looks at the files."""


def wait_for_saves(specs: Iterable[Path]) -> Iterator[None]:
    """Yield at once, and then after every save of a spec or a file that it names: a design's, a fit, an array's unit.

    A save counts once the file has not changed for `EVERY_S`: editors write in several steps.
    """
    specs = list(specs)
    while True:
        seen = _states(specs)
        yield
        while (now := _states(specs)) == seen:
            time.sleep(EVERY_S)
        while True:
            time.sleep(EVERY_S)
            if (later := _states(specs)) == now:
                break
            now = later


def _states(specs: list[Path]) -> dict[Path, tuple[int, int, int] | None]:
    """Return time, size and inode of each file, which a save changes; None for a missing file."""
    found = {}
    for path in [*specs, *(named for spec in specs for named in _files_of(spec))]:
        try:
            state = path.stat()
            found[path] = state.st_mtime_ns, state.st_size, state.st_ino
        except OSError:
            found[path] = None
    return found


def _files_of(spec: Path) -> Iterator[Path]:
    """Yield the files that a spec or an array names; none for a text that can't be read."""
    try:
        data = tomllib.loads(spec.read_text("utf-8"))
    except (OSError, ValueError, RecursionError):
        return
    named = files_named(data)
    design = named.pop("design", "")
    unit = data.get("unit")
    for text in (design.rpartition(".py:")[0] + ".py" if ".py:" in design else design, *named.values(), unit):
        if isinstance(text, str) and text.rpartition(".")[2] in ("py", "toml", "stl", "3mf", "step", "stp"):
            yield spec.parent / text
