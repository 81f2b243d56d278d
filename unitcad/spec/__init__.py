"""The requested and the effective spec: the tables of a TOML spec, and the effective spec with every value there."""

from unitcad.spec.convert import check_plain, convert
from unitcad.spec.effective import Spec, with_formats
from unitcad.spec.printer import printer_of
from unitcad.spec.toml import from_json, parse_toml, read_toml, spec_hash, to_data, to_json, to_toml

__all__ = [
    "Spec",
    "check_plain",
    "convert",
    "from_json",
    "parse_toml",
    "printer_of",
    "read_toml",
    "spec_hash",
    "to_data",
    "to_json",
    "to_toml",
    "with_formats",
]
