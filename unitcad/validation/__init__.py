"""Validation: from a TOML file, a template or plain data to an effective spec, or one refusal that names the field."""

from unitcad.validation.advice import warnings
from unitcad.validation.load import from_data, load, override, put, read, templates

__all__ = ["from_data", "load", "override", "put", "read", "templates", "warnings"]
