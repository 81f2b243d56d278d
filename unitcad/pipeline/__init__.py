"""The pipeline from a spec to a folder of files; each step runs once."""

from unitcad.pipeline.variant import Variant

__all__ = ["Variant"]
