"""One offline HTML file: its data, its programs, and a policy that forbids every connection.

All text from specs and results travels as compressed JSON in base 64 and is set as text, never as markup. A policy in
the page's head forbids every connection, and every script but those whose hashes it names.
"""

from __future__ import annotations

import base64
import hashlib
import html
import json
import re
import zlib
from collections.abc import Sequence
from functools import cache
from importlib.resources import files
from typing import Any

import msgspec

from unitcad import __version__

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
        try:
            text = _ENCODER.encode(data)
        except UnicodeEncodeError:  # names of files that are no text
            text = json.dumps(data).encode()
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


_EFFORT = 6
"""Of the compression: half the time of the greatest, pages a hundredth larger."""
_GZIP = bytes([0x1F, 0x8B, 8, 0, 0, 0, 0, 0, 0, 255])
"""The head of a gzip file without name and time (RFC 1952)."""
_BASE_64 = re.compile(rb"([A-Za-z0-9+/=]{1000,})")


def html_page(
    data: dict[str, Any],
    title: str,
    programs: Sequence[str],
    styles: Sequence[str],
    vendored: Sequence[str],
    without_script: str,
    licences: str = "",
) -> str:
    """Return the HTML of a page with `data`: `programs` of app/ run after the `vendored` ones, under `styles`."""
    scripts = [*(asset(f"vendor/{name}") for name in vendored), *(asset(f"app/{name}") for name in programs)]
    sheets = [asset(name) for name in styles]
    body = [
        '<main id="page"><p>Reading ...</p></main>',
        f"<noscript><p>A script draws this page. {html.escape(without_script)}</p></noscript>",
        f'<script type="text/plain" id="data">{pack(data)}</script>',
        f'<script type="text/plain" id="licences">{html.escape(licences, quote=False)}</script>',
    ]
    return document(title, sheets, body, scripts)


def pack(data: dict[str, Any]) -> str:
    """Return data as JSON, compressed and in base 64."""
    text = json.dumps(data, separators=(",", ":"), allow_nan=False, ensure_ascii=False)
    return compress(text.encode("utf-8", "replace"))


def compress(content: bytes) -> str:
    """Return content as a gzip file in base 64.

    Base 64 in it, such as pictures, has no repetitions. So it is coded without a search for them, which would take most
    of the time and make the file no smaller.
    """
    coded = [_GZIP]
    pieces = _BASE_64.split(content)
    for i, piece in enumerate(pieces):
        strategy = zlib.Z_HUFFMAN_ONLY if i % 2 else zlib.Z_DEFAULT_STRATEGY
        coder = zlib.compressobj(_EFFORT, zlib.DEFLATED, -zlib.MAX_WBITS, zlib.DEF_MEM_LEVEL, strategy)
        coded += [coder.compress(piece), coder.flush(zlib.Z_FULL_FLUSH if i < len(pieces) - 1 else zlib.Z_FINISH)]
    ending = zlib.crc32(content).to_bytes(4, "little") + (len(content) % 2**32).to_bytes(4, "little")
    return base64.b64encode(b"".join([*coded, ending])).decode()


def document(
    title: str, sheets: Sequence[str], body: Sequence[str], scripts: Sequence[str] = (), connects: bool = False
) -> str:
    """Return the HTML of a page that runs only `scripts`; `body` is markup, escaped already.

    It contacts nothing, or with `connects` the server that it came from.
    """
    policy = "; ".join(
        [
            "default-src 'none'",
            *(["script-src " + " ".join(_hash(script) for script in scripts)] if scripts else []),
            "style-src " + " ".join(_hash(style) for style in sheets),
            "img-src data:",
            *(["connect-src 'self'"] if connects else []),
            "base-uri 'none'",
            "form-action 'none'",
        ]
    )
    lines = [
        "<!doctype html>",
        '<html lang="en">',
        "<head>",
        '<meta charset="utf-8">',
        f'<meta http-equiv="Content-Security-Policy" content="{html.escape(policy)}">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f'<meta name="generator" content="unitcad {html.escape(__version__)}">',
        f"<title>{html.escape(title)}</title>",
        *(f"<style>{style}</style>" for style in sheets),
        "</head>",
        "<body>",
        *body,
        *(f"<script>{script}</script>" for script in scripts),
        "</body>",
        "</html>",
    ]
    return "\n".join([*lines, ""])


@cache
def asset(name: str) -> str:
    """Read a shipped file. No own script or style contains the end tag of its element; a test checks it."""
    return (files("unitcad") / "report" / name).read_text("utf-8")


@cache
def _hash(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"


_STYLES = ("app/page.css", "app/print.css")


_MAP = ("app/dom.js", "app/glb.js", "app/skinmap.js", "app/marked.js")
_VIEWER = ("vendor/three.min.js", *_MAP[:2], "app/viewer.js", "app/controls.js", *_MAP[2:])
MAP = '<div class="skin-map-host"><p class="absent">A script draws the map of the skin\'s motion.</p></div>'
VIEW = '<div class="stage-host"><p class="absent">A script draws the 3D view.</p></div>'


def plain_page(title: str, body: str, model: dict[str, Any] | None = None) -> str:
    """Return the HTML of a page that contacts nothing; `body` is markup, whose texts are escaped already.

    With a `model` it contains the programs that draw it: a 3D view in the place of VIEW, and the map of the skin's
    motion, the model's `skin_map`, in that of MAP.
    """
    sheets, markup = [asset(name) for name in _STYLES], [f'<main id="page">{body}</main>']
    if model is None:
        return document(title, sheets, markup)
    markup.append(f'<script type="text/plain" id="data">{pack(model)}</script>')
    if VIEW in body:
        licence = html.escape(asset("vendor/three.LICENSE.txt"), quote=False)
        markup.append(f'<script type="text/plain" id="licences">{licence}</script>')
    return document(title, sheets, markup, [asset(name) for name in (_VIEWER if VIEW in body else _MAP)])


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
