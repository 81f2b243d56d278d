"""A commented spec to start from: a template, and below it every further key with its default, commented out."""

from __future__ import annotations

import json
import re
from typing import Any

from pydantic import BaseModel

from unitcad.errors import UnitcadError
from unitcad.spec.load import read_toml, templates
from unitcad.spec.models import Spec

_NOT_OFFERED = ("design_source",)


def starter(name: str, template: str = "encapsulating") -> str:
    """The text of a spec file named `name`. Raises UnitcadError for an unknown template."""
    known = templates()
    if template not in known:
        raise UnitcadError(f"--template {template}: not known; one of {', '.join(known)}")
    there = read_toml(known[template])
    text = re.sub(
        r"^name = .*$",
        f"name = {json.dumps(name)}",
        known[template].read_text("utf-8"),
        count=1,
        flags=re.MULTILINE,
    )
    sections = re.split(r"\n(?=\[)", text)
    found = [section.rstrip() + "\n" + _further_keys(section, there) for section in sections]
    return "\n".join([*found, _further_tables(there)])


def _further_keys(section: str, there: dict[str, Any]) -> str:
    """The keys that a table of the template leaves out, commented out."""
    header = re.match(r"\[(\w+)\]", section)
    if not header or header[1] not in Spec.model_fields:
        return ""
    return "".join(
        f"{line}\n"
        for model in _models(Spec.model_fields[header[1]].annotation)
        for line in _keys(model, set(there[header[1]]))
    )


def _further_tables(there: dict[str, Any]) -> str:
    lines = ["# The tables below are as if left out: take the # away to change a value. ... means: from the catalogue."]
    for table, field in Spec.model_fields.items():
        if table in there or table in _NOT_OFFERED:
            continue
        models = _models(field.annotation)
        lines += [
            "",
            f"# [{table}]" + (f"  # {(models[0].__doc__ or '').splitlines()[0]}" if models else _meaning(field)),
        ]
        lines += [line for model in models for line in _keys(model, set())]
    return "\n".join(lines) + "\n"


def _keys(model: type[BaseModel], given: set[str]) -> list[str]:
    return [
        f"# {key} = {'...' if entry.is_required() else _shown(entry.default)}{_meaning(entry)}"
        for key, entry in model.model_fields.items()
        if key not in given
    ]


def _models(annotation: Any) -> list[type[BaseModel]]:
    from typing import get_args

    kinds = get_args(annotation) or (annotation,)
    return [kind for kind in kinds if isinstance(kind, type) and issubclass(kind, BaseModel)]


def _meaning(field: Any) -> str:
    return f"  # {field.description}" if field.description else ""


def _shown(value: Any) -> str:
    return json.dumps(list(value) if isinstance(value, tuple) else value).replace("null", "...")
