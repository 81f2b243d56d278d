"""JSON out, and JSON as typed messages."""

from __future__ import annotations

import re
from collections.abc import Mapping
from math import isfinite
from typing import Any, TypeVar

import msgspec

from unitcad.documents import parse_json
from unitcad.errors import UnitcadError, misfit

T = TypeVar("T")


def parse_message(content: bytes | str, kind: type[T], name: str = "the message") -> T:
    """Return JSON as a `kind`. Raises UnitcadError for JSON that `parse_json` refuses, or of another kind."""
    data = parse_json(content, name)
    try:
        return msgspec.convert(data, kind)
    except msgspec.ValidationError as error:
        why = str(error)
        raise UnitcadError(f"{name}: {misfit(error)}: {why[:1].lower()}{why[1:]}") from None


_FAST = msgspec.json.Encoder()
_PACKED = msgspec.msgpack.Encoder()
_MAY_BE_INFINITE = re.compile(rb"\xcb[\x7f\xff][\xf0-\xff]", re.DOTALL)
"""How MessagePack begins a double whose exponent is all ones; other bytes may look so too."""


def json_bytes(data: Mapping[str, Any]) -> bytes:
    """Return JSON with a line a key, and a line an entry of a list or table.

    Raises ValueError for a number that is not finite.
    """
    lines, line = [], _FAST.encode
    for key, value in data.items():
        if isinstance(value, list) and value:
            text = b"[\n  " + b",\n  ".join([line(one) for one in value]) + b"\n ]"
        elif isinstance(value, dict) and value:
            text = b"{\n  " + b",\n  ".join([line(k) + b": " + line(v) for k, v in value.items()]) + b"\n }"
        else:
            text = line(value)
        if b"null" in text and not all_finite(value):  # msgspec writes what is not finite as null
            raise ValueError(f"a number that is not finite in {key}: {value!r:.200}")
        lines.append(b" " + line(key) + b": " + text)
    return b"{\n" + b",\n".join(lines) + b"\n}\n"


def rounded_json(data: Any) -> str:
    """Return JSON on indented lines, numbers to nine significant digits. Raises ValueError as `json_bytes`."""
    if not all_finite(data):  # msgspec writes numbers that are not finite as null
        raise ValueError("a number is not finite")
    rounded = _NINE_DIGITS.decode(msgspec.json.encode(data))
    return msgspec.json.format(msgspec.json.encode(rounded), indent=1).decode() + "\n"


def _nine_digits(text: str) -> float:
    """Return a number to nine significant digits; with its point or exponent a short text has no more."""
    return float(text) if len(text) <= 10 else float(f"{float(text):.9g}")


_NINE_DIGITS: msgspec.json.Decoder[Any] = msgspec.json.Decoder(float_hook=_nine_digits)


def all_finite(value: Any) -> bool:
    """Tell whether every number in lists and dicts is finite."""
    try:
        if not _MAY_BE_INFINITE.search(_PACKED.encode(value)):  # a tenth of the time of the walk
            return True
    except OverflowError:  # MessagePack has no whole numbers beyond 64 bits
        pass
    left = [value]
    while left:
        one = left.pop()
        if isinstance(one, dict):
            left.extend(one.values())
        elif isinstance(one, (list, tuple)):
            left.extend(one)
        elif isinstance(one, float) and one - one != 0.0:
            return False
    return True


SIGNIFICANT_DIGITS = 9


def rounded(data: Any, digits: int = SIGNIFICANT_DIGITS) -> Any:
    """Return `data` with its floats to `digits` significant digits, and None for floats that are not finite.

    So the last bits of a platform do not show.
    """
    if isinstance(data, str):  # the most frequent
        return data
    if isinstance(data, float):
        return float(f"{data:.{digits}g}") if isfinite(data) else None
    if isinstance(data, dict):
        return {key: rounded(value, digits) for key, value in data.items()}
    if isinstance(data, (list, tuple)):  # a union would be made anew at each call
        return [rounded(value, digits) for value in data]
    return data
