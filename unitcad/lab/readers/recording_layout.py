"""What a person may declare of a file's layout."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Layout:
    """A text file's delimiter ("" to find it; " " for any white space), decimal sign, lines before the numbers."""

    delimiter: str = ""
    decimal: str = ""
    skip_lines: int = 0
