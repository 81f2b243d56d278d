"""Dotted paths into a spec: which there are, and the closest to one that isn't."""

from __future__ import annotations

import difflib
import types
import typing
from collections.abc import Iterator
from typing import Any

from pydantic import BaseModel

from unitcad.errors import Refusal
from unitcad.spec import Spec


def check_path(path: str, base: dict[str, Any]) -> None:
    """Refuse a path that no spec has, or that names a list entry which `base` (a spec's data) lacks.

    "layers.0.wall_mm", "estimate.frequency_hz" and whole tables ("fpcb", "layers") are paths.
    """
    kind: Any = Spec
    node: Any = base
    steps = path.split(".")
    for i, step in enumerate(steps):
        kinds = _alternatives(kind)
        model = next((k for k in kinds if isinstance(k, type) and issubclass(k, BaseModel)), None)
        entry = next((k for k in kinds if typing.get_origin(k) in (tuple, list)), None)
        if model is not None:
            if step not in model.model_fields:
                raise _unknown(path, base)
            kind = model.model_fields[step].annotation
        elif entry is not None:
            there = node if isinstance(node, list) else []
            if not step.isdigit() or int(step) >= len(there):
                known = ", ".join(str(n) for n in range(len(there))) or "none"
                raise Refusal(path, step, f"there is no such entry in the base's {'.'.join(steps[:i])} (has {known})")
            kind = typing.get_args(entry)[0]
        elif any(typing.get_origin(k) is dict or k is dict or k is Any for k in kinds):
            return
        else:
            raise _unknown(path, base)
        node = node[int(step)] if isinstance(node, list) else node.get(step) if isinstance(node, dict) else None


def known_paths(base: dict[str, Any]) -> list[str]:
    """Every path of a spec like `base`, tables and values, in the models' order."""
    return list(_walk(Spec, "", base))


def _walk(kind: Any, prefix: str, node: Any) -> Iterator[str]:
    for alternative in _alternatives(kind):
        if isinstance(alternative, type) and issubclass(alternative, BaseModel):
            for name, field in alternative.model_fields.items():
                yield f"{prefix}{name}"
                below = node.get(name) if isinstance(node, dict) else None
                yield from _walk(field.annotation, f"{prefix}{name}.", below)
        elif typing.get_origin(alternative) in (tuple, list):
            for i, below in enumerate(node if isinstance(node, list) else []):
                yield from _walk(typing.get_args(alternative)[0], f"{prefix}{i}.", below)


def _alternatives(kind: Any) -> tuple[Any, ...]:
    """The members of a union, annotations taken off."""
    if typing.get_origin(kind) is typing.Annotated:
        return _alternatives(typing.get_args(kind)[0])
    if typing.get_origin(kind) in (typing.Union, types.UnionType):
        return tuple(found for member in typing.get_args(kind) for found in _alternatives(member))
    return (kind,)


def _unknown(path: str, base: dict[str, Any]) -> Refusal:
    known = known_paths(base)
    close = difflib.get_close_matches(path, known, n=1, cutoff=0.0)
    return Refusal(f"sweep.{path}", path, "there is no such path in a spec", close[0] if close else None)
