"""The names of the shipped arrays."""

from __future__ import annotations

from pathlib import Path

from unitcad.validation.shipped_files import shipped_files


def array_templates() -> dict[str, Path]:
    """Return the shipped arrays by name."""
    return shipped_files("arrays")
