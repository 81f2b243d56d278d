"""The pictures of a procedure's steps, as a page carries them."""

from __future__ import annotations

import base64
from collections.abc import Iterable
from pathlib import Path

from unitcad import files
from unitcad.errors import UnitcadError

LARGEST_PICTURE = 1_000_000
"""Bytes of a step's picture, at most."""
MOST_PICTURES = 500
PNG = b"\x89PNG\r\n\x1a\n"


def step_pictures(folder: Path, paths: Iterable[str]) -> dict[str, str]:
    """Return the pictures of these paths in a folder as data, without files that are missing or no PNG."""
    read: dict[str, str] = {}
    for path in list(dict.fromkeys(path for path in paths if path))[:MOST_PICTURES]:
        parts = Path(path).parts
        if Path(path).is_absolute() or ".." in parts or any((folder / p).is_symlink() for p in Path(path).parents):
            continue
        try:
            content = files.read(folder / path, largest=LARGEST_PICTURE, links=False)
        except UnitcadError:
            continue
        if content.startswith(PNG):
            read[path] = f"data:image/png;base64,{base64.b64encode(content).decode()}"
    return read
