"""What was asked for: the TOML spec, checked at the door, and the dimensions that follow from it."""

from unitcad.spec.dimensions import Dimensions, dimensions
from unitcad.spec.door import printer_of, warnings
from unitcad.spec.load import from_data, load, override, put, read, read_toml, templates, to_toml
from unitcad.spec.models import Spec

__all__ = [
    "Dimensions",
    "Spec",
    "dimensions",
    "from_data",
    "load",
    "override",
    "printer_of",
    "put",
    "read",
    "read_toml",
    "templates",
    "to_toml",
    "warnings",
]
