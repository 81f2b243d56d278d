"""Changes of a spec's text that keep its comments and its layout."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import tomlkit
from tomlkit.exceptions import TOMLKitError
from tomlkit.items import AoT, InlineTable

from unitcad.errors import Refusal, UnitcadError
from unitcad.serve.messages import Edit
from unitcad.spec import parse_toml
from unitcad.spec.fields import index_in
from unitcad.validation.dotted import no_entry


def edited(text: str, edits: Sequence[Edit]) -> str:
    """Return a TOML text after `edits`.

    Raises UnitcadError for a text that is no TOML, Refusal for a path through a missing key.
    """
    if not edits:
        return text
    try:
        document = tomlkit.parse(text)
    except (TOMLKitError, RecursionError, ValueError):
        parse_toml(text, "the text")  # whose words the page shows without an edit too
        raise UnitcadError("the text: has TOML that can't be edited value by value; change the text") from None
    for edit in edits:
        _apply(document, edit)
    return tomlkit.dumps(document)


def _apply(document: Any, edit: Edit) -> None:
    *way, last = edit.path.split(".")
    node = document
    for step in way:
        if isinstance(node, list):
            node = node[_index(node, step, edit)]
        elif isinstance(node, dict):
            if step == "unit" and isinstance(node.get(step), str):
                # A unit that an array names is the `like` of the table that changes it.
                named = tomlkit.inline_table()
                named["like"] = str(node[step])
                named.comment(node[step].trivia.comment)
                node[step] = named
            if step not in node:
                if edit.remove:
                    return
                node[step] = tomlkit.inline_table() if isinstance(node, InlineTable) else tomlkit.table()
            node = node[step]
        else:
            raise Refusal(edit.path, edit.value, "the path runs through a value, not a table")
    if isinstance(node, list):
        if edit.remove:
            del node[_index(node, last, edit)]
        elif isinstance(node, AoT) and not isinstance(edit.value, dict):
            raise Refusal(edit.path, edit.value, "the entries of this list are tables")
        elif last == str(len(node)):
            node.append(_item(_value(edit)))
        else:
            node[_index(node, last, edit)] = _value(edit)
    elif isinstance(node, dict):
        if edit.remove:
            node.pop(last, None)
        else:
            node[last] = _item(_value(edit))
    else:
        raise Refusal(edit.path, edit.value, "the path runs through a value, not a table")


def _index(node: Sequence[Any], step: str, edit: Edit) -> int:
    index = index_in(step, len(node))
    if index is None:
        raise no_entry(edit.path, edit.value, step, len(node))
    return index


def _value(edit: Edit) -> Any:
    """Return an edit's value, parsed if it is a text in TOML syntax."""
    if not edit.toml:
        return edit.value
    try:
        return tomlkit.value(str(edit.value))
    except (TOMLKitError, RecursionError, ValueError):
        raise Refusal(edit.path, edit.value, "is no TOML value; a list is [2, 3], a word in quotes") from None


def _item(value: Any) -> Any:
    """Return a value as TOML has it; a table comes on lines of its own."""
    if isinstance(value, dict):
        table = tomlkit.table()
        for key, each in value.items():
            table[key] = _item(each)
        return table
    return value
