"""Values by their dotted path in plain data: "layers.0.wall_mm"."""

from __future__ import annotations

from typing import Any

from unitcad.errors import Refusal
from unitcad.spec.fields import index_in


def put(data: dict[str, Any], path: str, value: Any) -> None:
    """Set `value` at a dotted path, making tables on the way but no list entries. Raises Refusal where none leads."""
    *way, last = path.split(".")
    node: Any = data
    for step in way:
        if isinstance(node, list):
            node = node[_index(node, step, path, value)]
        elif isinstance(node, dict):
            node = node.setdefault(step, {})
        else:
            break
    if isinstance(node, list):
        node[_index(node, last, path, value)] = value
    elif isinstance(node, dict):
        node[last] = value
        node.pop(f"{last}_source", None)  # the text of the file that stood there before
    else:
        raise Refusal(path, value, "the path runs through a value, not a table")


ABSENT = object()
"""What `at` returns where nothing stands."""


def at(data: Any, path: str) -> Any:
    """Return the value at a dotted path, or `ABSENT`."""
    node = data
    for step in path.split(".") if path else ():
        if isinstance(node, list):
            index = index_in(step, len(node))
            node = ABSENT if index is None else node[index]
        else:
            node = node.get(step, ABSENT) if isinstance(node, dict) else ABSENT
    return node


def drop(data: dict[str, Any], path: str) -> bool:
    """Take out the key at a dotted path; whether there was one. An entry of a list stays."""
    table, _, key = path.rpartition(".")
    node = at(data, table)
    return isinstance(node, dict) and node.pop(key, ABSENT) is not ABSENT


def _index(node: list[Any], step: str, path: str, value: Any) -> int:
    index = index_in(step, len(node))
    if index is None:
        raise no_entry(path, value, step, len(node))
    return index


def no_entry(path: str, value: Any, step: str, count: int) -> Refusal:
    """Return the refusal of a path with a step that names no entry of a list of `count` entries."""
    has = f"has the entries 0 to {count - 1}" if count > 1 else "has the entry 0 alone" if count else "is empty"
    return Refusal(path, value, f"no entry {step}: the list {has}")
