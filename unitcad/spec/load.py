"""From a TOML file, a template's name or plain data to a `Spec` that has passed the door."""

from __future__ import annotations

import copy
import os
import tomllib
from collections.abc import Iterable, Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any

import msgspec

from unitcad.errors import Refusal, UnitcadError, UnknownKey, unknown_name
from unitcad.files import read_text
from unitcad.spec.convert import check_plain, convert
from unitcad.spec.door import checked
from unitcad.spec.fields import index_in
from unitcad.spec.models import Spec
from unitcad.spec.own import with_source
from unitcad.text import toml, toml_key

_MOST_LIMITS = 5
"""Limits of one field that are tried out in turn for a value to offer."""


def templates() -> dict[str, Path]:
    """The shipped templates by name."""
    package = Path(str(files("unitcad")))
    folder = next((f for f in (package / "templates", package.parent / "templates") if f.is_dir()), package)
    return {file.stem: file for file in sorted(folder.glob("*.toml"))}


def load(source: str | os.PathLike[str], overrides: Iterable[str] = ()) -> Spec:
    """The effective spec of a file (a path separator or .toml in `source`) or of a template (a bare name).

    `overrides` are "path=value" with a value in TOML syntax (a bare word counts as a string). Raises Refusal or
    UnitcadError, naming the field, for whatever can't be.
    """
    return from_data(override(read(source), overrides), Path())


def read(source: str | os.PathLike[str]) -> dict[str, Any]:
    """The data of a spec file or template, not checked. Raises UnitcadError for a file that can't be read as TOML.

    The code of a design that the file names may run from now on: see `unitcad.spec.own`.
    """
    text = os.fspath(source)
    if os.sep in text or "/" in text or text.endswith(".toml"):
        path = Path(text)
    else:
        known = templates()
        if text not in known:
            raise unknown_name("SPEC", text, known)
        path = known[text]
    return with_source(read_toml(path), path.parent)


def read_toml(path: Path, links: bool = True) -> dict[str, Any]:
    """A TOML file's data. Raises UnitcadError with line and column where it does not parse, for a special file, and for
    one that is larger than `unitcad.files.LARGEST`; without `links` for a symbolic link too.
    """
    text = read_text(path, links=links)
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise UnitcadError(f"{path}: not TOML: {error}") from None
    except RecursionError:
        raise UnitcadError(f"{path}: nests too deeply") from None
    except ValueError:
        raise UnitcadError(f"{path}: holds a number of thousands of digits") from None


def override(data: Mapping[str, Any], overrides: Iterable[str]) -> dict[str, Any]:
    """`data` with each "path=value" put in. Raises Refusal for a path that runs through something not there."""
    check_plain(data)
    result: dict[str, Any] = copy.deepcopy(dict(data))
    for text in overrides:
        path, equals, raw = text.partition("=")
        if not equals or not path.strip():
            raise Refusal("--set", text, "needs the form path=value, such as layers.0.wall_mm=1.0")
        put(result, path.strip(), _parsed(raw.strip()))
    return result


def put(data: dict[str, Any], path: str, value: Any) -> None:
    """Set `value` at a dotted path ("layers.0.wall_mm"), making tables on the way but no list entries."""
    *way, last = path.split(".")
    node: Any = data
    for step in way:
        if isinstance(node, list):
            node = node[_index(node, step, path)]
        elif isinstance(node, dict):
            node = node.setdefault(step, {})
        else:
            break
    if isinstance(node, list):
        node[_index(node, last, path)] = value
    elif isinstance(node, dict):
        node[last] = value
    else:
        raise Refusal(path, value, "the path runs through a value, not a table")


def from_data(data: Mapping[str, Any], folder: Path | None = None) -> Spec:
    """A checked, effective `Spec` of plain data.

    `folder` is where the path of a design of one's own starts, whose file is then read and may run; without one no
    file is. Raises Refusal for the first thing that can't be; the value that it offers is accepted in that field.
    """
    plain = with_source(dict(data), folder) if folder else dict(data)
    try:
        return checked(convert(plain, Spec))
    except UnknownKey:
        raise
    except Refusal as refusal:
        raise _settled(refusal, plain) from None


def _settled(refusal: Refusal, data: dict[str, Any]) -> Refusal:
    """The refusal, offering a value that passes every check of its field: one limit may lie beyond another."""
    nearest = refusal.nearest
    for _ in range(_MOST_LIMITS):
        if nearest is None:
            break
        tried = copy.deepcopy(data)
        try:
            put(tried, refusal.field, nearest)
            checked(convert(tried, Spec))
        except Refusal as other:
            if other.field == refusal.field:
                nearest = other.nearest
                continue
        return Refusal(refusal.field, refusal.value, refusal.limit, nearest)
    return Refusal(refusal.field, refusal.value, refusal.limit)


def to_data(spec: Spec) -> dict[str, Any]:
    """The spec as plain data, what is None left out: the same spec by `from_data`."""
    return _given(msgspec.to_builtins(spec))


def to_json(spec: Spec) -> str:
    """The spec as JSON, for keys and for another process. `from_json` makes it the same spec, unchecked."""
    return msgspec.json.encode(spec).decode()


def from_json(text: str) -> Spec:
    """The spec of a text by `to_json`."""
    return msgspec.json.decode(text, type=Spec)


def to_toml(spec: Spec) -> str:
    """The spec as TOML: the same spec when read again. Keys in the order of the models, None left out."""
    return text_of(to_data(spec))


def text_of(data: Mapping[str, Any]) -> str:
    """A spec's plain data as TOML."""
    return _table(dict(data), ())


def _table(data: Mapping[str, Any], path: tuple[str, ...]) -> str:
    def is_table(value: Any) -> bool:
        return isinstance(value, dict)

    def is_tables(value: Any) -> bool:
        return isinstance(value, list) and bool(value) and all(map(is_table, value))

    lines = [f"{toml_key(k)} = {toml(v)}\n" for k, v in data.items() if not is_table(v) and not is_tables(v)]
    for key, value in data.items():
        name = ".".join(map(toml_key, (*path, key)))
        if is_table(value) and value:
            lines.append(f"\n[{name}]\n" + _table(value, (*path, key)))
        elif is_tables(value):
            lines += [f"\n[[{name}]]\n" + _table(item, (*path, key)) for item in value]
    return "".join(lines)


def _parsed(raw: str) -> Any:
    try:
        return tomllib.loads(f"value = {raw}")["value"]
    except (ValueError, RecursionError):
        pass
    try:
        return float(raw)
    except ValueError:
        return raw


def _index(node: list[Any], step: str, path: str) -> int:
    index = index_in(step, len(node))
    if index is None:
        raise Refusal(path, step, f"needs an index from 0 to {len(node) - 1} here", len(node) - 1 if node else None)
    return index


def _given(node: Any) -> Any:
    if isinstance(node, dict):
        return {key: _given(value) for key, value in node.items() if value is not None}
    return [_given(value) for value in node] if isinstance(node, list | tuple) else node
