"""Plain data, as TOML has it: values by dotted path, and tables from what a person types in Python."""

from __future__ import annotations

import copy
import datetime
import os
from collections.abc import Callable, Iterable, Mapping
from numbers import Integral, Real
from typing import Any, Protocol, cast

from msgspec import UNSET, Struct

from unitcad.arguments import confirm_form
from unitcad.documents import DEEPEST, expect_bounded, parse_value
from unitcad.errors import Refusal, UnitcadError
from unitcad.spec import Spec, to_data
from unitcad.spec.fields import fields_of, index_in, table_in, takes_none
from unitcad.spec.raw import DERIVED, RawSpec
from unitcad.spec.resolved import CastLayer, MotorSize

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
            if step not in node and len(steps) > DEEPEST:
                raise Refusal(f"{path[:40]}...", value, f"nests more than {DEEPEST} tables deep")
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


RIVALS = {"fpcb": "wires", "wires": "fpcb"}
"""Tables of a spec of which one takes the place of the other."""


def apply(data: dict[str, Any], changes: Mapping[str, Any]) -> None:
    """Put a person's changes into data. A circuit takes the place of wires, and wires that of a circuit.

    Raises Refusal as `put`, and for an empty table, which may be meant as none.
    """
    for path, value in changes.items():
        steps = path.split(".")
        i = next((i for i, one in enumerate(steps) if one in RIVALS and steps[max(i - 1, 0)] in ("unit", one)), None)
        if i is not None and value is not False:
            own, rival = (".".join([*steps[:i], table]) for table in (steps[i], RIVALS[steps[i]]))
            if path == own and value == {}:
                _refuse_empty(path, steps[i])
            if not any(f"{other}.".startswith(f"{rival}.") for other in changes if changes[other] is not False):
                drop(data, rival)
            if at(data, own) is False:
                drop(data, own)
        put(data, path, value)


def _refuse_empty(path: str, table: str) -> None:
    keys = fields_of(cast("type[Struct]", table_in(fields_of(RawSpec)[table].type)))
    required = [key for key, field in keys.items() if field.required]
    takes = f"a table with {required[0]}" if required else f"a table, with keys such as {', '.join([*keys][:3])}"
    raise Refusal(path, {}, f"an empty table; takes {takes}, or false for none")


_MOST_ENTRIES = 4
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
    first = "; Layer 1 is layers.0" if path.startswith("layers.") else ""
    if not step.isdigit() and count:
        every = " or ".join(f"{path[: path.rindex(step)]}{i}.{step}" for i in range(min(count, _MOST_ENTRIES)))
        return Refusal(path, value, f"{step} is a key of each entry: {every}{first}")
    has = f"has the entries 0 to {count - 1}" if count > 1 else "has the entry 0 alone" if count else "is empty"
    return Refusal(path, value, f"no entry {step}: the list {has}{first}")


class HasSpec(Protocol):
    """A variant, or anything else with a spec."""

    @property
    def spec(self) -> Spec: ...


Source = str | os.PathLike[str] | Mapping[str, object] | Spec | HasSpec
"""A template's name, a file, plain data, a spec or a variant."""
Changes = Mapping[str, object] | Iterable[str] | str
"""Values by their dotted path ("layers.0.wall_mm"), or texts "path=value" with a value in TOML syntax."""

_DERIVED = {
    name: [key for key, below in fields_of(table).items() if below.default is DERIVED and not takes_none(below.type)]
    for name, field in fields_of(RawSpec).items()
    if (table := table_in(field.type))
}
"""The keys of each table whose values validation works out if a spec leaves them out."""


def plain(node: object, field: str = "") -> Any:
    """Return a value as TOML has it: tables as dicts without what is None, lists, numbers, texts.

    Raises Refusal for a value of a class that no key takes, and for data out of bounds, such as a table in itself.
    """
    expect_bounded(node, field)
    return _plain(node, field)


def _plain(node: object, field: str) -> Any:
    if isinstance(node, MotorSize) and node.absent:
        return False
    if isinstance(node, Struct):
        named = {name: getattr(node, name) for name in node.__struct_fields__}
        if isinstance(node, CastLayer) and not node.cap_mm:  # an open ring, whose cap a file leaves out
            del named["cap_mm"]
        return _plain({key: value for key, value in named.items() if value not in (None, UNSET)}, field)
    if isinstance(node, Mapping):
        table = cast("Mapping[object, object]", node)
        return {str(key): _plain(value, f"{field}.{key}".lstrip(".")) for key, value in table.items()}
    if isinstance(node, list | tuple):
        entries = cast("Iterable[object]", node)
        return [_plain(value, f"{field}.{i}".lstrip(".")) for i, value in enumerate(entries)]
    if node is None or isinstance(node, bool | datetime.date | datetime.time):  # `convert` refuses times
        return node
    if isinstance(node, str):
        return str(node)
    if isinstance(node, Integral):
        return int(node)
    if isinstance(node, Real):
        return float(node)
    if isinstance(node, os.PathLike):
        return str(os.fspath(cast("os.PathLike[str]", node)))
    raise Refusal(field, None, f"takes no {type(node).__name__}: only numbers, texts, lists and tables")


def requested_data(spec: Spec, settle: Callable[[dict[str, Any]], Spec]) -> dict[str, Any]:
    """Return a spec's data without the values that `settle` works out alike, so that they follow a change of others."""
    data = to_data(spec)
    bare = copy.deepcopy(data)
    for table, keys in _DERIVED.items():
        for key in keys if table in bare and (table != "motor" or spec.motor.part) else ():
            bare[table].pop(key, None)
    try:
        again = to_data(settle(copy.deepcopy(bare)))
        for table in _DERIVED:
            bare.get(table, {}).update({k: v for k, v in data.get(table, {}).items() if again[table].get(k) != v})
        return bare if settle(copy.deepcopy(bare)) == spec else data
    except Refusal:  # one of these values was given because the one worked out can't be
        return data


def changes_of(changes: Changes) -> dict[str, Any]:
    """Return the plain value of each change by its path. Raises UnitcadError for anything but a dict or texts."""
    if isinstance(changes, Mapping):
        table = cast("Mapping[str, object]", changes)
        return {path: plain(value, path) for path, value in table.items()}
    given = cast("object", changes)
    entries = list(cast("Iterable[object]", given)) if isinstance(given, Iterable) else [given]
    texts = [given] if isinstance(given, str) else entries
    found = {}
    for text in texts:
        if not isinstance(text, str):
            raise UnitcadError(f'set takes a dict by path or texts "path=value", not {type(text).__name__}')
        path, _, value = confirm_form(text).partition("=")
        found[path.strip()] = _parse(value.strip(), path.strip())
    return found


def _parse(text: str, path: str) -> Any:
    try:
        return parse_value(text)
    except Refusal as refusal:
        raise Refusal(path + refusal.field.removeprefix("value"), refusal.value, refusal.limit) from None
    except UnitcadError:
        pass
    try:
        return float(text)
    except ValueError:
        return text
