"""The parts of a result's files that the page relies on."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec
from msgspec import Struct

from unitcad.errors import UnitcadError
from unitcad.report.pool import REFERENCE

DEEPEST = 40
"""Nesting of lists and tables that a result's file may have."""


class Law(Struct):
    """A mould check, passed or broken."""

    code: str
    ok: bool
    where: str = ""


class Found(Struct):
    """A finding in a file."""

    code: str
    severity: str
    path: str = ""
    message: str = ""


class Checked(Struct):
    """Result of the mesh check."""

    errors: int
    findings: list[Found] = []


class Part(Struct):
    """A body."""

    name: str
    role: str = ""
    made: str | None = None
    material: str | None = None
    volume_mm3: float | None = None
    bbox_mm: list[float] = []


class LeftOut(Struct):
    """An output that a build left out."""

    what: str
    why: str


class Level(Struct):
    """A model's level at the edge."""

    edge: float | None = None


class Levels(Struct):
    """The estimate's summary."""

    models: dict[str, Level] = {}


class Manifest(Struct):
    """manifest.json."""

    name: str = ""
    design: str = ""
    hash: str = ""
    label: str | None = None
    laws: list[Law] = []
    check: Checked | None = None
    parts: list[Part] = []
    warnings: list[str] = []
    left_out: list[LeftOut] = []
    estimate: Levels | None = None
    versions: dict[str, str] = {}


class Row(Struct):
    """A variant of a batch."""

    folder: str | None = None


class BatchFile(Struct):
    """batch.json."""

    columns: list[str]
    variants: list[Row]


def expect(data: Any, kind: Any, path: Path) -> None:
    """Raise UnitcadError, naming the file and the place, for data that is not of a kind, is nested too deep, or has a
    key that the page keeps for itself.
    """
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
        raise UnitcadError(f"{path}: is not a result of unitcad: {error}") from None
