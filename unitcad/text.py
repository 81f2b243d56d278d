"""Text that somebody else may have chosen, made safe for where it goes: a terminal, Markdown, a spreadsheet."""

from __future__ import annotations

import re

_INVISIBLE = re.compile(
    "[\x00-\x1f\x7f-\x9f"  # control characters, escape among them
    "\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069"  # which turn the direction of what follows
    "\u2028\u2029\ufeff\ufff9-\ufffb\ufffe\uffff"
    "\ud800-\udfff\U000e0000-\U000e007f]"  # halves of characters, tags
)
_MARKUP = re.compile(r"[\\`*_\[\]|~]")


def invisible(text: str) -> str | None:
    """The first character of a text that no name needs and that deceives: control characters, turned directions."""
    found = _INVISIBLE.search(text)
    return found[0] if found else None


def without_invisible(text: str) -> str:
    """A text without such characters."""
    return _INVISIBLE.sub("", text)


def printable(text: str) -> str:
    """A text for a terminal, in one line: such characters as Python writes them in a string."""
    return _INVISIBLE.sub(lambda found: ascii(found[0])[1:-1], text)


def markdown(text: str) -> str:
    """A text in one line that Markdown shows as it is: no markup, no HTML."""
    plain = _INVISIBLE.sub(" ", text).replace("&", "&amp;").replace("<", "&lt;")
    return _MARKUP.sub(r"\\\g<0>", plain)


def cell(text: str) -> str:
    """A text for a cell of a CSV table: one that begins like a formula is one to a spreadsheet, so it gets a quote."""
    return f"'{text}" if text[:1] in ("=", "+", "-", "@", "\t", "\r") else text
