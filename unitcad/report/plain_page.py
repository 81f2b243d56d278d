"""A page of its own markup in the styles of every page, under a policy that forbids the rest; a 3D view is optional."""

from __future__ import annotations

import base64
import html
from typing import Any

from unitcad.report.html_page import asset, document, packed

_STYLES = ("app/page.css", "app/print.css")


_PROGRAMS = ("vendor/three.min.js", *(f"app/{name}.js" for name in ("dom", "glb", "viewer", "controls", "array")))
VIEW = '<div class="stage-host"><p class="absent">A script draws the 3D view.</p></div>'
"""The place of the 3D view in a page's markup."""


def plain_page(title: str, body: str, model: dict[str, Any] | None = None) -> str:
    """Return the HTML of a page that contacts nothing; `body` is markup, whose texts are escaped already.

    With a `model` it contains the programs of the 3D view, which draw it in the place of VIEW.
    """
    sheets, markup = [asset(name) for name in _STYLES], [f'<main id="page">{body}</main>']
    if model is None:
        return document(title, sheets, markup)
    licence = html.escape(asset("vendor/three.LICENSE.txt"), quote=False)
    markup += [
        f'<script type="text/plain" id="data">{packed(model)}</script>',
        f'<script type="text/plain" id="licences">{licence}</script>',
    ]
    return document(title, sheets, markup, [asset(name) for name in _PROGRAMS])


def drawing(svg: str, alt: str, narrow: str = "") -> str:
    """Return an SVG document as an image in the page, with a description in words; `narrow` replaces it on a phone."""
    image = f'<img class="drawing" alt="{html.escape(alt)}" src="{_data(svg)}">'
    if not narrow:
        return image
    return f'<picture><source media="(max-width: 600px)" srcset="{_data(narrow)}">{image}</picture>'


def picture(png: bytes, alt: str) -> str:
    """Return a PNG as an image in the page, with a description in words."""
    data = base64.b64encode(png).decode()
    return f'<img class="drawing" alt="{html.escape(alt)}" src="data:image/png;base64,{data}">'


def _data(svg: str) -> str:
    return f"data:image/svg+xml;base64,{base64.b64encode(svg.encode()).decode()}"
