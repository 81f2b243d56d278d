"""Validation: from a TOML file, a template or plain data to a resolved spec, or one refusal that names the field."""

from unitcad.validation.defaults import warnings
from unitcad.validation.load import (
    compound_kind,
    confirm_known,
    custom_templates,
    default_template,
    every_template,
    from_data,
    from_tables,
    load,
    override,
    read,
    templates,
)
from unitcad.validation.plain_data import Changes, Source, put

__all__ = [
    "Changes",
    "Source",
    "compound_kind",
    "confirm_known",
    "custom_templates",
    "default_template",
    "every_template",
    "from_data",
    "from_tables",
    "load",
    "override",
    "put",
    "read",
    "templates",
    "warnings",
]
