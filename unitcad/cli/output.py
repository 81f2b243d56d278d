"""How commands speak: one JSON object on standard output, or lines for a person; errors on standard error."""

from __future__ import annotations

import contextlib
import json
import sys
from collections.abc import Callable, Iterator
from typing import Any

from unitcad.errors import UnitcadError


def print_json(data: Any) -> None:
    """Write `data` as the one JSON object on standard output. Raises ValueError for NaN and infinity."""
    sys.stdout.write(json.dumps(data, indent=2, allow_nan=False, ensure_ascii=False) + "\n")


def say_error(error: UnitcadError, as_json: bool) -> None:
    """One error: a line on standard error and, with `--json`, an object on standard output."""
    sys.stderr.write(f"error: {error}\n")
    if as_json:
        print_json({"error": error.as_dict()})


@contextlib.contextmanager
def progress(name: str) -> Iterator[Callable[[str], None]]:
    """A spinner with the stage of work on a terminal; silent in a pipe. Yields the function that names the stage."""
    if not sys.stderr.isatty():
        yield lambda stage: None
        return
    from rich.console import Console

    with Console(stderr=True).status(name) as status:
        yield lambda stage: status.update(f"{name}: {stage}")
