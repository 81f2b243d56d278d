"""Tables and drawings in HTML, for the cell of a notebook. No scripts, and every text escaped."""

# pyright: strict
from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from html import escape


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


def shortened(text: str, most: int) -> str:
    """Return a text of at most `most` characters, what is left out as three dots."""
    return text if len(text) <= most else f"{text[: most - 3]}..."


def _row(tag: str, cells: Iterable[object]) -> str:
    return f"<tr>{''.join(f'<{tag}>{escape(shown(cell))}</{tag}>' for cell in cells)}</tr>"
