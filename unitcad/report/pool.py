"""Data without repetition: equal parts of a tree are kept in a pool, and referred to."""

from __future__ import annotations

import json
from typing import Any

import msgspec

REFERENCE = "\0"
"""The key of a reference, {REFERENCE: index in the pool}: no spec or result has it, since TOML and JSON names of ours
are text without a NUL."""
LEAST = 160
"""Bytes of JSON below which a part is not worth a reference."""
_ENCODER = msgspec.json.Encoder()


class Pool:
    """Parts kept once. `entries[i]` is plain data whose larger parts are references to earlier entries."""

    def __init__(self) -> None:
        self.entries: list[Any] = []
        self._index: dict[bytes, int] = {}

    def put(self, data: Any) -> Any:
        """Return `data` (of JSON's types) with every larger part replaced by a reference."""
        if not isinstance(data, dict | list | tuple | str):
            return data
        text = _encode(data)
        if len(text) < LEAST:
            return data
        if text not in self._index:
            if isinstance(data, dict):
                data = {key: self.put(value) for key, value in data.items()}
            elif isinstance(data, list | tuple):
                data = [self.put(value) for value in data]
            self._index[text] = len(self.entries)
            self.entries.append(data)
        return {REFERENCE: self._index[text]}


def _encode(data: Any) -> bytes:
    """Return data as JSON, by the encoder that is ten times as fast as Python's if it can write all of it."""
    try:
        return _ENCODER.encode(data)
    except UnicodeEncodeError:  # names of files that are no text
        return json.dumps(data).encode()
