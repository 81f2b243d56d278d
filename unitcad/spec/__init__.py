"""The raw and the resolved spec: the tables of a TOML spec, and the resolved spec with every value there."""

from unitcad.spec.convert import check_plain, convert
from unitcad.spec.resolved import MOTOR_SIZES, Spec, assumed_lengths, length_text, motor_of, printer_of, with_formats
from unitcad.spec.toml import from_json, spec_hash, to_data, to_json, to_toml

__all__ = [
    "MOTOR_SIZES",
    "Spec",
    "assumed_lengths",
    "check_plain",
    "convert",
    "from_json",
    "length_text",
    "motor_of",
    "printer_of",
    "spec_hash",
    "to_data",
    "to_json",
    "to_toml",
    "with_formats",
]
