"""A page without programs: its own markup in the styles of every page, under a policy that forbids all else."""

from __future__ import annotations

import base64
import html

from unitcad.report.html_page import asset, document

_STYLES = ("app/page.css", "app/print.css")


def plain_page(title: str, body: str) -> str:
    """Return the HTML of a page that contacts nothing; `body` is markup, whose texts are escaped already."""
    return document(title, [asset(name) for name in _STYLES], [f'<main id="page">{body}</main>'])


def drawing(svg: str, alt: str, narrow: str = "") -> str:
    """Return an SVG document as an image in the page, with what it shows in words; `narrow` stands in on a phone."""
    image = f'<img class="drawing" alt="{html.escape(alt)}" src="{_data(svg)}">'
    if not narrow:
        return image
    return f'<picture><source media="(max-width: 600px)" srcset="{_data(narrow)}">{image}</picture>'


def picture(png: bytes, alt: str) -> str:
    """Return a PNG as an image in the page, with what it shows in words."""
    data = base64.b64encode(png).decode()
    return f'<img class="drawing" alt="{html.escape(alt)}" src="data:image/png;base64,{data}">'


def _data(svg: str) -> str:
    return f"data:image/svg+xml;base64,{base64.b64encode(svg.encode()).decode()}"
