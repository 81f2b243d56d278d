"""Who needs what, once: from a spec to a folder of files."""

from unitcad.pipeline.variant import Variant

__all__ = ["Variant"]
