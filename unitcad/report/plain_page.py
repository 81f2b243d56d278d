"""A page without programs: its own markup in the styles of every page, under a policy that forbids all else."""

from __future__ import annotations

import base64
import hashlib
import html
from importlib.resources import files

from unitcad import __version__

_STYLES = ("app/page.css", "app/print.css")


def plain_page(title: str, body: str) -> str:
    """Return the HTML of a page that contacts nothing; `body` is markup, whose texts are escaped already."""
    styles = [(files("unitcad") / "report" / name).read_text("utf-8") for name in _STYLES]
    hashes = " ".join(
        f"'sha256-{base64.b64encode(hashlib.sha256(style.encode()).digest()).decode()}'" for style in styles
    )
    policy = f"default-src 'none'; style-src {hashes}; img-src data:; base-uri 'none'; form-action 'none'"
    lines = [
        "<!doctype html>",
        '<html lang="en">',
        "<head>",
        '<meta charset="utf-8">',
        f'<meta http-equiv="Content-Security-Policy" content="{html.escape(policy)}">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f'<meta name="generator" content="unitcad {html.escape(__version__)}">',
        f"<title>{html.escape(title)}</title>",
        *(f"<style>{style}</style>" for style in styles),
        "</head>",
        "<body>",
        f'<main id="page">{body}</main>',
        "</body>",
        "</html>",
    ]
    return "\n".join([*lines, ""])


def drawing(svg: str, alt: str, narrow: str = "") -> str:
    """Return an SVG document as an image in the page, with what it shows in words; `narrow` stands in on a phone."""
    image = f'<img class="drawing" alt="{html.escape(alt)}" src="{_data(svg)}">'
    if not narrow:
        return image
    return f'<picture><source media="(max-width: 600px)" srcset="{_data(narrow)}">{image}</picture>'


def _data(svg: str) -> str:
    return f"data:image/svg+xml;base64,{base64.b64encode(svg.encode()).decode()}"
