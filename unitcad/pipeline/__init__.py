"""The pipeline from a spec to a folder of files; each step runs once."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from unitcad.pipeline.variant import Variant

__all__ = ["Variant"]


def __getattr__(name: str) -> object:
    """Import the variant when it is first asked for: what starts processes beside a build must load little."""
    if name != "Variant":
        raise AttributeError(name)
    from unitcad.pipeline.variant import Variant

    return Variant
