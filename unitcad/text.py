"""Text from others, made safe for a terminal, Markdown, XML or a spreadsheet; values as TOML."""

from __future__ import annotations

import base64
import json
import math
import re
from collections.abc import Iterable, Sequence
from functools import lru_cache
from html import escape
from typing import Any, SupportsFloat

_INVISIBLE = re.compile(
    "[\x00-\x1f\x7f-\x9f"  # control characters, escape among them
    "\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069"  # which turn the direction of the following text
    "\u2028\u2029\ufeff\ufff9-\ufffb\ufffe\uffff"
    "\ud800-\udfff\U000e0000-\U000e007f]"  # halves of characters, tags
)
_quoted = json.JSONEncoder(ensure_ascii=False).encode
_MARKUP = re.compile(r"[\\`*_\[\]|~]")


def invisible(text: str) -> str | None:
    """Return the first character of a text that no name needs and that deceives, such as a control character."""
    match = _INVISIBLE.search(text)
    return match[0] if match else None


def without_invisible(text: str) -> str:
    """Return a text without such characters."""
    return _INVISIBLE.sub("", text)


def printable(text: str) -> str:
    """Return a text for a terminal, in one line: such characters as Python writes them in a string."""
    return _INVISIBLE.sub(lambda match: ascii(match[0])[1:-1], text)


@lru_cache(maxsize=4096)
def markdown(text: str) -> str:
    """Return a text in one line that Markdown shows unchanged: no markup, no HTML."""
    plain = _INVISIBLE.sub(" ", text).replace("&", "&amp;").replace("<", "&lt;")
    return _MARKUP.sub(r"\\\g<0>", plain)


def cell(text: str) -> str:
    """Return a text for a cell of a CSV table, quoted if a spreadsheet would take it for a formula."""
    return f"'{text}" if text[:1] in ("=", "+", "-", "@", "\t", "\r") else text


@lru_cache(maxsize=4096)
def toml_key(key: str) -> str:
    """Write a key as TOML has it: in quotes if needed."""
    plain = key.isascii() and key.replace("-", "").replace("_", "").isalnum()
    return key if plain else toml(key)


def toml(value: Any) -> str:
    """Write a value as TOML has it, in one line: tables and lists inline; other values as text.

    tomli-w writes whole files, and lists over several lines.
    """
    if isinstance(value, dict):
        return f"{{ {', '.join(f'{toml_key(str(k))} = {toml(v)}' for k, v in value.items())} }}" if value else "{}"
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(toml, value))}]"
    if isinstance(value, str):
        return _quoted(value).replace("\x7f", "\\u007f")
    return str(value).lower() if isinstance(value, bool) else repr(value) if isinstance(value, float) else str(value)


def number(value: SupportsFloat, digits: int = 6, zeros: bool = False) -> str:
    """Return a number as a person reads it, to so many significant digits: never -0, no power of ten.

    `zeros` keeps those at its end, as an instrument shows them: 1.00. Numbers below a millionth are 0; from 1e15 on a
    power of ten has to say it.
    """
    return _number(float(value), digits, zeros)


@lru_cache(maxsize=4096)  # variants of a batch say most numbers again
def _number(size: float, digits: int, zeros: bool) -> str:
    if not 1e-6 <= abs(size) < 1e15:
        return "0" if abs(size) < 1e-6 else f"{size:.{digits}g}"
    rounded = float(f"{size:.{digits}g}")
    text = f"{rounded:.{max(0, digits - 1 - math.floor(math.log10(abs(rounded))))}f}"
    return text.rstrip("0").rstrip(".") if "." in text and not zeros else text


def join_words(words: Iterable[str]) -> str:
    """Return words as a list in a sentence: "base, cups and lids"."""
    *first, last = words
    return f"{', '.join(first)} and {last}" if first else last


def with_article(noun: str) -> str:
    """Return a noun after a or an."""
    return f"{'an' if noun[0] in 'aeiou' else 'a'} {noun}"


_MEASURE = re.compile(r"\s*([-+]?\d*[.,]?\d+)\s*([A-Za-z%]*)\s*")
_SCALES: dict[str, dict[str, float]] = {
    "mm": {"cm": 10, "m": 1000, "um": 0.001, "in": 25.4},
    "hz": {"khz": 1000},
    "g": {"mg": 0.001, "kg": 1000},
    "min": {"s": 1 / 60, "h": 60},
    "h": {"min": 1 / 60, "d": 24},
    "kpa": {"pa": 0.001, "mpa": 1000},
}
"""For a unit, others that are read in its place, and how many of it each is."""


def measured(text: Any, unit: str) -> float | None:
    """Return the number that a text means in a unit: 14.5 for "14,5", "14.5 mm" or "1.45 cm"; None if it means none."""
    parts = _MEASURE.fullmatch(text) if isinstance(text, str) else None
    if not parts:
        return None
    given = parts[2].lower()
    scale = 1.0 if given in ("", unit) else _SCALES.get(unit, {}).get(given)
    if scale is None:
        return None
    value = float(parts[1].replace(",", ".")) * scale
    return int(value) if value.is_integer() else value if math.isfinite(value) else None


def some(words: Iterable[object], most: int = 10) -> str:
    """Return the first words of a list, each cut at 60 characters, and the number of the others: "a, b and 7 more"."""
    every = list(words)
    shown = [str(word) for word in (every if len(every) <= most + 1 else every[:most])]
    more = f" and {len(every) - len(shown)} more" if len(every) > len(shown) else ""
    return ", ".join(word if len(word) <= 63 else f"{word[:60]}..." for word in shown) + more


def spaced(name: str) -> str:
    """Return a body's name as it is read: "cup1" as "cup 1", which stays, and "cup1a" as "cup 1a"."""
    return re.sub(r"(?<=[^\d\s])(?=\d+[a-d]?$)", " ", name)


# As xml.sax.saxutils has them; importing that loads urllib, http and ssl.
def xml_text(text: str) -> str:
    """Return a text as the content of an XML element."""
    return text.replace("&", "&amp;").replace(">", "&gt;").replace("<", "&lt;")


def xml_attribute(text: str) -> str:
    """Return a text as the value of an XML attribute, with its quotation marks."""
    value = xml_text(text).replace("\n", "&#10;").replace("\r", "&#13;").replace("\t", "&#9;")
    if '"' in value and "'" not in value:
        return f"'{value}'"
    return '"' + value.replace('"', "&quot;") + '"'


def table(head: Sequence[str], rows: Iterable[Sequence[object]], caption: str = "") -> str:
    """Return a table; numbers are shown to four digits, None as a dash."""
    lines = [f"<caption>{escape(caption)}</caption>"] if caption else []
    if head:
        lines.append(_row("th", head))
    return f"<table>{''.join(lines)}{''.join(_row('td', row) for row in rows)}</table>"


def drawing(svg: str, alt: str) -> str:
    """Return a drawing as an image, so that its style stays its own."""
    content = base64.b64encode(svg.encode()).decode()
    return f'<img alt="{escape(alt)}" src="data:image/svg+xml;base64,{content}">'


def shown(value: object) -> str:
    """Return a value as text: a number to four digits, None as a dash."""
    return "-" if value is None else f"{value:.4g}" if isinstance(value, float) else str(value)


def shorten(text: str, most: int) -> str:
    """Return a text of at most `most` characters, what is left out as three dots."""
    return text if len(text) <= most else f"{text[: most - 3]}..."


def _row(tag: str, cells: Iterable[object]) -> str:
    return f"<tr>{''.join(f'<{tag}>{escape(shown(cell))}</{tag}>' for cell in cells)}</tr>"
