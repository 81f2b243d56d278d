"""The parts of a result's files that the page relies on."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec
from msgspec import UNSET, Struct, UnsetType, structs

from unitcad.errors import UnitcadError, misfit
from unitcad.pipeline.manifest import Manifest
from unitcad.report.pool import REFERENCE

DEEPEST = 40
"""Nesting of lists and tables that a result's file may have."""


class ListedVariant(Struct):
    """A variant of a batch."""

    folder: str | None = None


class SweptLevels(Struct):
    """Each model's typical error in a batch, a factor, and the swept keys that it does not read.

    `not_measured`: swept lengths with the one value, mm, that every measured unit had; earlier batches have none.
    """

    typical_error: dict[str, float]
    insensitive: dict[str, list[str]]
    not_measured: dict[str, float] = {}


class BatchFile(Struct):
    """batch.json."""

    columns: list[str]
    variants: list[ListedVariant]
    estimate: SweptLevels | None = None


class VariantRecord(Struct, kw_only=True):
    """A variant on the page; a file that its folder lacks, or that can't be read, is None.

    `casts`: the cast records in it; `drawings`: SVG by path; `pictures`: those of the procedure's steps as data by
    path, only on the page of one variant; `files`: (path, bytes); `damaged`: unreadable files; `model`: the key of the
    geometry, and `no_model` the reason for none.
    """

    folder: str
    manifest: Manifest
    estimate: dict[str, Any] | None
    casting: dict[str, Any] | None
    slicer: dict[str, Any] | None
    drawings: dict[str, str]
    pictures: dict[str, str]
    casts: list[dict[str, Any]]
    files: list[tuple[str, int]]
    damaged: list[str]
    spec: dict[str, Any] | None = None
    model: str | None = None
    no_model: str | UnsetType = UNSET

    def as_dict(self) -> dict[str, Any]:
        """Return the record as plain data."""
        return {name: value for name, value in structs.asdict(self).items() if value is not UNSET}


class ResultsTable(Struct, frozen=True):
    """Table of a batch on the page: each row begins with the folder that its variant has, or can have, else "".

    `swept` are the columns that a person chose values for.
    """

    columns: list[str]
    rows: list[list[Any]]
    swept: list[str] = []


def expect(data: Any, kind: Any, path: Path) -> None:
    """Raise UnitcadError, naming file and place, for data of another kind, too deep, or with the page's own key."""
    level = [data]
    for _ in range(DEEPEST):
        tables = [node for node in level if isinstance(node, dict)]
        if any(REFERENCE in table for table in tables):
            raise UnitcadError(f"{path}: is not a result of unitcad: a key of it is a NUL")
        level = [item for table in tables for item in table.values()] + [
            item for node in level if isinstance(node, list) for item in node
        ]
    if level:
        raise UnitcadError(f"{path}: is not a result of unitcad: nested deeper than {DEEPEST}")
    try:
        msgspec.convert(data, kind)
    except msgspec.ValidationError as error:
        raise UnitcadError(f"{path}: is not a result of unitcad: {misfit(error)}") from None
