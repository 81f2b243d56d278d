"""Validation: from a TOML file, a template or plain data to an effective spec, or one refusal that names the field."""

from unitcad.validation.advice import warnings
from unitcad.validation.load import from_data, from_tables, load, override, put, read, templates
from unitcad.validation.tables import Changes, Source

__all__ = ["Changes", "Source", "from_data", "from_tables", "load", "override", "put", "read", "templates", "warnings"]
