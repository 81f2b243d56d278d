"""MATLAB files of versions 4 to 7.2, by scipy; those of version 7.3 and HDF5, by h5py."""

from __future__ import annotations

import functools
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from math import prod
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import loadmat, whosmat

from unitcad.lab.readers import TIME_NAMES, Channel, Layout, Unreadable
from unitcad.lab.units import TIMES, Scope, Stated, is_unit_key, plain, stated, text_of

ENDINGS = (".mat", ".h5", ".hdf5")
LIBRARY = "scipy"
DEEPEST = 3
"""Structs in structs that are looked into."""


def read(path: Path, layout: Layout) -> list[Channel]:
    """Return the numeric vectors and the columns of matrices, as their longer side runs."""
    with open(path, "rb") as file:
        first = file.read(16)
    if path.suffix.lower() != ".mat" or first.startswith((b"\x89HDF\r\n\x1a\n", b"MATLAB 7.3")):
        return _read_hdf5(path)
    kinds = ("int", "uint", "double", "single", "struct", "char", "cell")
    names = [name for name, _, kind in whosmat(str(path)) if kind.startswith(kinds)]
    data = loadmat(str(path), variable_names=names, struct_as_record=False, squeeze_me=False)
    return list(_variables({name: data[name] for name in names if name in data}, "", [], 0))


def _variables(values: Mapping[str, Any], path: str, above: list[Scope], depth: int) -> Iterator[Channel]:
    """Yield the channels of variables, or of a struct's fields; a struct array's elements are name(1), name(2)."""
    texts = {name: text for name, value in values.items() if (text := _texts(value)) is not None}
    for name, value in values.items():
        shown = f"{path}.{name}" if path else name
        scopes = [Scope("next to it", texts, (name,)), *(replace(one, names=(*one.names, name)) for one in above)]
        if not isinstance(value, np.ndarray) or value.ndim != 2:
            continue
        if value.dtype == object and depth < DEEPEST and value.size <= MOST_COLUMNS:
            for i, one in enumerate(value.flat, 1):
                fields = {field: getattr(one, field) for field in getattr(one, "_fieldnames", ())}
                element = shown if value.size == 1 else f"{shown}({i})"
                yield from _variables(fields, element, scopes, depth + 1)
        elif value.dtype.kind in "fiu" and max(value.shape) > 1:
            yield from _channels(shown, value, scopes)


def _texts(value: Any) -> Any:
    """Return the text of a variable, a list of a cell's, a table of a struct's; None for one without."""
    if isinstance(value, np.ndarray) and value.dtype.kind == "U":
        return text_of(value)
    if not isinstance(value, np.ndarray) or value.dtype != object or not 0 < value.size <= MOST_COLUMNS:
        return None
    first = value.flat[0]
    if value.size == 1 and hasattr(first, "_fieldnames"):
        fields = ((field, _texts(getattr(first, field))) for field in first._fieldnames)
        return {field: text for field, text in fields if text is not None} or None
    texts = [_texts(one) for one in value.flat]
    return texts if all(isinstance(one, str) for one in texts) else None


def _channels(name: str, table: np.ndarray, scopes: list[Scope]) -> Iterator[Channel]:
    """Yield the channels of a matrix along its longer side."""
    table = table if table.shape[0] >= table.shape[1] else table.T
    count = table.shape[1]
    is_time = re.split(r"[./]", name)[-1].lower() in TIME_NAMES
    for i, (column, unit) in enumerate(zip(table.T, stated(scopes, count), strict=True), 1):
        said = Stated() if is_time and plain(unit.unit) not in TIMES else unit  # of the group, and not of its time
        yield Channel(column, name if count == 1 else f"{name}:{i}", said.unit, None, said.doubt, said.likely)


MOST_COLUMNS = 4096
MOST_PACKED = 1100
"""Largest expansion of a compressed byte (deflate: 1,032)."""


def _read_hdf5(path: Path) -> list[Channel]:
    """Return the numeric data sets of one or two dimensions. Raises Unreadable for data in other files."""
    import h5py

    found: list[Channel] = []

    @functools.cache
    def properties(group: str) -> dict[str, Any]:
        """Return the attributes of a group, and the texts that it contains."""
        node: Any = file[group]
        texts = {key: text for key in node for text in [_stored_text(node, key)] if text is not None}
        return {**texts, **_attributes(node)}

    def scopes_of(name: str, node: Any) -> list[Scope]:
        parts = name.split("/")
        scopes = [Scope("its attributes", _attributes(node))]
        for i in reversed(range(len(parts))):
            place = "its group" if i == len(parts) - 1 else "/".join(parts[:i]) or "the file"
            scopes.append(Scope(place, properties("/".join(parts[:i]) or "/"), (parts[i], parts[-1])))
        return scopes

    def add(name: str, node: Any, scopes: Callable[[], list[Scope]]) -> None:
        if node.ndim not in (1, 2) or node.dtype.kind not in "fiu" or not node.shape or max(node.shape) < 2:
            return
        if _matlab_class(node) == "char":
            return
        if node.is_virtual or node.external:
            raise Unreadable(str(path), None, f"{name} is in another file")
        _expect_stored(path, name, node)
        if node.id.get_type() not in (h5py.h5t.py_create(node.dtype), h5py.h5t.py_create(node.dtype.newbyteorder())):
            raise Unreadable(str(path), None, f"the numbers of {name} have no standard layout: it is damaged")
        table = node[:].reshape(len(node), -1)
        if min(table.shape) <= MOST_COLUMNS:
            found.extend(_channels(name, table, scopes()))

    def visit(name: str, node: Any) -> None:
        if not isinstance(node, h5py.Dataset) or name.startswith("#"):
            return
        if _is_struct_array(node):
            group, _, field = name.rpartition("/")
            for i, one in enumerate(node[()].ravel()):
                element = file[one]
                if isinstance(element, h5py.Dataset):
                    texts = _texts_of_element(file[group or "/"], i)
                    near = [Scope("its element", texts, (field,)), *scopes_of(name, node)]
                    add(f"{group}({i + 1})/{field}", element, lambda near=near: near)
            return
        add(name, node, lambda: scopes_of(name, node))

    with h5py.File(path, "r") as file:
        file.visititems(visit)
    return found


def _is_struct_array(node: Any) -> bool:
    """Tell whether a data set is a field of MATLAB's struct array: references to the elements' values."""
    import h5py

    if node.dtype.kind != "O" or node.shape is None or not 0 < prod(node.shape) <= MOST_COLUMNS:
        return False
    return h5py.check_ref_dtype(node.dtype) is h5py.Reference and _matlab_class(node) != "cell"


def _texts_of_element(group: Any, i: int) -> dict[str, str]:
    """Return the texts of element `i` of a struct array, by field."""
    import h5py

    found = {}
    for key in group:
        if isinstance(group.get(key, getlink=True), h5py.HardLink) and isinstance(field := group[key], h5py.Dataset):
            references = field[()].ravel() if _is_struct_array(field) else ()
            if i < len(references) and (text := _characters(group.file[references[i]])) is not None:
                found[key] = text
    return found


def _expect_stored(path: Path, name: str, node: Any) -> None:
    """Raise Unreadable if a data set states more than its stored bytes can expand to."""
    stated = prod(node.shape) * node.dtype.itemsize
    most = node.id.get_storage_size() * MOST_PACKED ** node.id.get_create_plist().get_nfilters()
    if stated > most:
        limit = f"{name} states {stated} bytes and stores {most} at most: it is damaged"
        raise Unreadable(str(path), None, limit)


def _attributes(node: Any) -> dict[str, Any]:
    """Return the attributes of an object, arrays of text as lists; a text of no length is empty."""
    return {key: "" if value.__class__.__name__ == "Empty" else text_of(value) for key, value in node.attrs.items()}


def _stored_text(group: Any, key: Any, deep: bool = True) -> Any:
    """Return the text in a data set of a group, a list of several or of a cell's, a table of the texts in a group."""
    import h5py

    if not isinstance(group.get(key, getlink=True), h5py.HardLink):
        return None
    node: Any = group[key]
    if isinstance(node, h5py.Group):
        texts = {one: _stored_text(node, one, False) for one in node} if deep and is_unit_key(key) else {}
        return {one: text for one, text in texts.items() if text is not None} or None
    if not isinstance(node, h5py.Dataset) or node.shape is None or not 0 < prod(node.shape) <= MOST_COLUMNS:
        return None
    if node.is_virtual or node.external:
        return None
    if _matlab_class(node) == "cell" and node.dtype.kind == "O":
        texts = [_characters(group.file[one]) for one in node[()].ravel()]
        return texts if all(text is not None for text in texts) else None
    if h5py.check_string_dtype(node.dtype) is not None:
        return text_of(node[()])
    return _characters(node)


def _characters(node: Any) -> str | None:
    """Return the text that MATLAB stores as numbers of characters; None if a data set has none."""
    if (
        not hasattr(node, "dtype")
        or _matlab_class(node) != "char"
        or node.dtype.kind != "u"
        or prod(node.shape) > MOST_COLUMNS
    ):
        return None
    empty = "MATLAB_empty" in node.attrs
    return "" if empty else "".join(map(chr, np.ravel(node[()]).tolist())).strip()


def _matlab_class(node: Any) -> str:
    kind = node.attrs.get("MATLAB_class", "")
    return kind.decode("latin-1") if isinstance(kind, bytes) else str(kind)
