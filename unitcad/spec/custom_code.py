"""A custom design: `design = "path/to/file.py:NAME"`, a function or a Design in that file, or a file of bodies.

The file's text becomes part of the resolved spec. So a result's spec.toml is complete, the result's hash covers the
code, and a worker elsewhere needs no file.
"""

from __future__ import annotations

import hashlib
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from unitcad.errors import Refusal, UnitcadError
from unitcad.files import read_text

_FORM = re.compile(r"(?P<file>.+\.py):(?P<name>[A-Za-z_][A-Za-z0-9_]*)", re.DOTALL)
LARGEST = 1_000_000
FILE_KEYS = (("design",), ("body", "file"), ("estimate", "fit"))
"""Keys of a spec whose values name files."""
BODIES = (".step", ".stp", ".stl", ".3mf")


def is_body_file(design: object) -> bool:
    """Tell whether a spec's `design` means a file of bodies."""
    return isinstance(design, str) and bool(Path(design).stem) and design.lower().endswith(BODIES)


def is_custom(design: object) -> bool:
    """Tell whether a spec's `design` means a file, or something in one."""
    return is_body_file(design) or (isinstance(design, str) and _FORM.fullmatch(design) is not None)


def files_named(data: Mapping[str, Any]) -> dict[str, str]:
    """Return the values of a spec that name files, by their paths; a shipped design's name is none."""
    found = {}
    for way in FILE_KEYS:
        node: Any = data
        for key in way:
            node = node.get(key) if isinstance(node, Mapping) else None
        if isinstance(node, str) and (way != ("design",) or is_custom(node)):
            found[".".join(way)] = node
    return found


def name_in_file(design: str) -> str:
    """Return NAME of "file.py:NAME"."""
    return design.rpartition(":")[2]


def with_source(data: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Return a spec's data with its custom design's text in `design_source`, and with its fit's text, if it names them.

    A relative path starts at `folder`. Such a file is the person's own: its code may run.
    Raises UnitcadError for a file that can't be read.
    """
    data = _with_body(_with_fit(data, folder), folder)
    design = data.get("design")
    if not is_custom(design) or data.get("design_source") is not None:
        return data
    if is_body_file(design):
        from unitcad.spec.body_file import body_text  # numpy and the mesh rules: most specs do without

        path = folder / str(design)
        return {**data, "design": path.name, "design_source": body_text(str(design), path)}
    file, _, name = str(design).rpartition(":")
    path = folder / file
    try:
        source = read_text(path, largest=LARGEST)
    except UnitcadError as error:
        raise Refusal("design", str(design), str(error)) from None
    named = f"{path.name}:{name}"
    allow({_digest(named, source)})
    return {**data, "design": named, "design_source": source}


def _with_body(data: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Return a spec's data with the text of the body that it names in `body.file_source`."""
    table = data.get("body")
    if not isinstance(table, dict) or not isinstance(table.get("file"), str) or table.get("file_source") is not None:
        return data
    if not is_body_file(table["file"]):
        raise Refusal("body.file", table["file"], f"is no file of a body: its name ends in {', '.join(BODIES)}")
    from unitcad.spec.body_file import body_text  # numpy and the mesh rules: most specs do without

    path = folder / table["file"]
    try:
        text = body_text(table["file"], path)
    except Refusal as refusal:
        raise Refusal("body.file", refusal.value, refusal.limit, refusal.nearest) from None
    return {**data, "body": {**table, "file": path.name, "file_source": text}}


def _with_fit(data: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Return a spec's data with the text of the lab's fit that it names in `estimate.fit_source`."""
    table = data.get("estimate")
    if not isinstance(table, dict) or not isinstance(table.get("fit"), str) or table.get("fit_source") is not None:
        return data
    path = folder / table["fit"]
    try:
        source = read_text(path, largest=LARGEST)
    except UnitcadError as error:
        raise Refusal("estimate.fit", table["fit"], str(error)) from None
    return {**data, "estimate": {**table, "fit": path.name, "fit_source": source}}


# Code runs only where somebody has allowed it: it came from a file that the command line led to, or with --allow-code.
# Text in a result or in a spec is data until then.
_allowed: set[str] = set()
ANY = "any"


def allow(codes: Iterable[str]) -> None:
    """Let this process run these codes, as `allowed` gives them; ANY: whatever a spec brings along."""
    _allowed.update(codes)


def allowed() -> frozenset[str]:
    """Return the code that this process may run, for its workers."""
    return frozenset(_allowed)


def allow_nothing() -> None:
    """Withdraw whatever was allowed."""
    _allowed.clear()


def is_allowed(design: str, source: str) -> bool:
    """Tell whether this process may run a design's code."""
    return ANY in _allowed or _digest(design, source) in _allowed


def _digest(design: str, source: str) -> str:
    return hashlib.sha256(f"{design}\0{source}".encode("utf-8", "surrogatepass")).hexdigest()
