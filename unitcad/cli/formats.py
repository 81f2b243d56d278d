"""The option --formats."""

from __future__ import annotations


def chosen_formats(formats: str | None) -> list[str]:
    """Return what --formats overrides in a spec. Raises Refusal for an unknown format."""
    from unitcad.errors import unknown_name
    from unitcad.pipeline.artifacts import FORMATS

    if formats is None:
        return []
    names = [name.strip() for name in formats.split(",")]
    for name in names:
        if name not in FORMATS:
            raise unknown_name("--formats", name, FORMATS)
    return [f"output.formats={names}"]
