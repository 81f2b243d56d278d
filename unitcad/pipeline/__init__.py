"""Who needs what, once: from a spec to a folder of files."""

from unitcad.pipeline.build import FORMATS, OUTPUTS, Built, build
from unitcad.pipeline.variant import Variant

__all__ = ["FORMATS", "OUTPUTS", "Built", "Variant", "build"]
