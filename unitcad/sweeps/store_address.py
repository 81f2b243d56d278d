"""The place of a batch's store, noted in its folder: relative to the folder if both can be moved together."""

from __future__ import annotations

import json
import os
from pathlib import Path

from unitcad import files
from unitcad.cache import absolute
from unitcad.pipeline.write import ADDRESS, STORE


def note_store(out: Path, address: str) -> None:
    """Note the store's place in a batch's folder. Raises OSError."""
    files.write(out / ADDRESS, json.dumps({"store": noted(out, address)}).encode() + b"\n")


def noted(out: Path, address: str) -> str:
    """Return a store's address as a batch in `out` notes it: relative if near the batch, so that both can move."""
    near = {str((place / STORE).absolute()): way for place, way in ((out, STORE), (out.parent, f"../{STORE}"))}
    return near.get(address, address)


def found_at(out: Path, address: str) -> str:
    """Return the address that a batch in `out` has `noted`."""
    return absolute(address if "://" in address else os.path.normpath(out / address))


def store_noted(out: Path) -> str | None:
    """Return the address of the store that a batch's folder notes, None if it notes none. Raises UnitcadError."""
    if not (out / ADDRESS).is_file():
        return None
    return found_at(out, str(files.read_json(out / ADDRESS)["store"]))
