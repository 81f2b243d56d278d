"""Validation: from a TOML file, a template or plain data to an effective spec, or one refusal that names the field."""

from unitcad.validation.advice import warnings
from unitcad.validation.dotted import put
from unitcad.validation.load import (
    custom_templates,
    default_template,
    from_data,
    from_tables,
    load,
    override,
    read,
    templates,
)
from unitcad.validation.tables import Changes, Source

__all__ = [
    "Changes",
    "Source",
    "custom_templates",
    "default_template",
    "from_data",
    "from_tables",
    "load",
    "override",
    "put",
    "read",
    "templates",
    "warnings",
]
