"""A spec as plain data, as JSON and as TOML that reads back as the same spec."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from typing import Any

import msgspec
import tomli_w
from msgspec import structs

from unitcad.json_text import parse_message
from unitcad.spec.convert import without_none
from unitcad.spec.resolved import Spec, with_formats


def to_data(spec: Spec) -> dict[str, Any]:
    """Return the spec as plain data without None values; validated again, it is the same spec."""
    data = without_none(msgspec.to_builtins(spec))
    for layer in data["layers"]:
        if not layer["cap_mm"]:
            del layer["cap_mm"]
    if spec.motor.absent:
        data["motor"] = False
    if spec.body:  # they follow from the body
        for table, keys in (
            (data, ("design", "diameter_mm")),
            *((one, ("wall_mm", "cap_mm")) for one in data["layers"]),
        ):
            for key in keys:
                table.pop(key, None)
    return data


def to_json(spec: Spec) -> str:
    """Return the spec as JSON, for keys and for another process. `from_json` makes it the same spec, unchecked."""
    return msgspec.json.encode(spec).decode()


def from_json(text: str) -> Spec:
    """Return the spec of a text by `to_json`."""
    return parse_message(text, Spec, "the spec")


def spec_hash(spec: Spec) -> str:
    """Return the SHA-256 of the resolved spec without name and formats; a result's folder ends in 12 digits of it."""
    return hashlib.sha256(to_json(structs.replace(with_formats(spec), name="")).encode()).hexdigest()


def to_toml(spec: Spec) -> str:
    """Return the spec as TOML: the same spec when read again."""
    return text_of(to_data(spec))


def text_of(data: Mapping[str, Any]) -> str:
    """Return a spec's plain data as TOML."""
    return tomli_w.dumps(data)
