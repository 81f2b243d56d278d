"""The table of a settings file of `unitcad check`: imported only if there is one, since most runs have none."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta, Struct, field


class Settings(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True, rename="kebab"):
    """Keys of a settings file, by the options' names; None or empty for a missing key."""

    select: list[str] = []
    ignore: list[str] = []
    per_file_ignores: dict[str, list[str]] = {}
    fail_on: Literal["error", "warning"] | None = None
    printer: str | None = None
    unit: str | None = None
    strict: bool | None = None
    exclude: list[str] = []
    strict_3mf: bool | None = field(default=None, name="3mf-strict")
    max_faces: Annotated[int, Meta(ge=1)] | None = None
    timeout: Annotated[float, Meta(ge=0.001)] | None = None
    memory: Annotated[int, Meta(ge=200)] | None = None
    baseline: str | None = None
