"""Values by their dotted path in plain data: "layers.0.wall_mm"."""

from __future__ import annotations

from typing import Any

from unitcad.errors import Refusal
from unitcad.spec.fields import index_in

MOST_PARTS = 200
"""Parts of a path at most; a name may have dots of its own."""


def put(data: dict[str, Any], path: str, value: Any) -> None:
    """Set `value` at a dotted path, making tables on the way but no list entries. Raises Refusal if none can."""
    steps = path.split(".")
    if len(steps) > MOST_PARTS:
        raise Refusal(f"{path[:40]}...", value, f"a path has at most {MOST_PARTS} parts, not {len(steps)}")
    node: Any = data
    while (count := _steps(node, steps)) < len(steps):
        step = ".".join(steps[:count])
        if isinstance(node, list):
            node = node[_index(node, step, path, value)]
        elif isinstance(node, dict):
            node = node.setdefault(step, {})
        else:
            break
        del steps[:count]
    last = ".".join(steps)
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
    node, steps = data, path.split(".") if path else []
    while steps:
        count = _steps(node, steps)
        step = ".".join(steps[:count])
        del steps[:count]
        if isinstance(node, list):
            index = index_in(step, len(node))
            node = ABSENT if index is None else node[index]
        else:
            node = node.get(step, ABSENT) if isinstance(node, dict) else ABSENT
    return node


def drop(data: dict[str, Any], path: str) -> bool:
    """Take out the key at a dotted path; whether there was one. An entry of a list stays."""
    steps = path.split(".")
    for i in reversed(range(len(steps))):
        node = at(data, ".".join(steps[:i]))
        if isinstance(node, dict) and node.pop(".".join(steps[i:]), ABSENT) is not ABSENT:
            return True
    return False


def _steps(node: Any, steps: list[str]) -> int:
    """Return the number of steps that a table's key makes: a sweep has keys such as "layers.0.wall_mm"."""
    if not isinstance(node, dict):
        return 1
    return next((n for n in range(len(steps), 1, -1) if ".".join(steps[:n]) in node), 1)


def _index(node: list[Any], step: str, path: str, value: Any) -> int:
    index = index_in(step, len(node))
    if index is None:
        raise no_entry(path, value, step, len(node))
    return index


def no_entry(path: str, value: Any, step: str, count: int) -> Refusal:
    """Return the refusal of a path with a step that names no entry of a list of `count` entries."""
    has = f"has the entries 0 to {count - 1}" if count > 1 else "has the entry 0 alone" if count else "is empty"
    first = "; Layer 1 is layers.0" if path.startswith("layers.") else ""
    return Refusal(path, value, f"no entry {step}: the list {has}{first}")
