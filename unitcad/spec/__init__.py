"""What was asked for: the TOML spec, checked at the door, and the dimensions that follow from it."""

from unitcad.spec.convert import check_plain, convert
from unitcad.spec.dimensions import Dimensions, dimensions
from unitcad.spec.door import printer_of, warnings
from unitcad.spec.load import (
    from_data,
    from_json,
    load,
    override,
    put,
    read,
    read_toml,
    templates,
    to_data,
    to_json,
    to_toml,
)
from unitcad.spec.models import Spec, with_formats

__all__ = [
    "Dimensions",
    "Spec",
    "check_plain",
    "convert",
    "dimensions",
    "from_data",
    "from_json",
    "load",
    "override",
    "printer_of",
    "put",
    "read",
    "read_toml",
    "templates",
    "to_data",
    "to_json",
    "to_toml",
    "warnings",
    "with_formats",
]
