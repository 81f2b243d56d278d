"""The live page: the programs of the report, the form next to them, and the first data."""

from __future__ import annotations

import base64
import json
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from typing import Any

from unitcad import __version__
from unitcad.report.html_page import asset, document

SHARED = (
    "dom.js", "glb.js", "viewer.js", "controls.js", "plots.js", "estimate.js", "sections.js", "filters.js", "rows.js",
    "compare.js", "table.js", "batch.js",
)  # fmt: skip
"""Programs of the report that the page runs."""
PROGRAMS = ("server.js", "kept.js", "changes.js", "form.js", "pinned.js", "jobs.js", "refused_rows.js", "live.js")
HEADER_POLICY = "frame-ancestors 'none'"
"""The directives that a policy in the page itself can't have."""


def live_page(
    text: str,
    name: str,
    folder: str,
    starts: Mapping[str, str | None],
    batch: dict[str, Any] | None = None,
    known: str = "",
) -> str:
    """Return the HTML of the page that starts with a spec's `text`, the file `name` of `folder`.

    It has no token: the opened address has it, and the page takes it from there.
    `starts` are the texts to start from by their names, None for one that may not be used. `batch`: the data of a
    batch's page, whose rows then open live. `known`: the SHA-256 of the file, if a save may replace it.
    """
    data: dict[str, Any] = {
        "text": text,
        "name": name,
        "folder": folder,
        "known": known,
        "version": __version__,
        "batch": batch,
        "templates": starts,
    }
    packed = base64.b64encode(json.dumps(data, ensure_ascii=False).encode("utf-8", "replace")).decode()
    scripts = [
        *(asset(f"vendor/{each}") for each in ("three.min.js", "uplot.min.js")),
        *(asset(f"app/{each}") for each in SHARED),
        *(own_asset(each) for each in PROGRAMS),
    ]
    sheets = [asset("vendor/uplot.min.css"), asset("app/page.css"), own_asset("live.css")]
    body = [
        '<main id="page" class="live"><p>Starting ...</p></main>',
        "<noscript><p>A script draws this page.</p></noscript>",
        f'<script type="text/plain" id="data">{packed}</script>',
    ]
    return document(f"{name} - unitcad", sheets, body, scripts, connects=True)


@cache
def own_asset(name: str) -> str:
    """Read a program or a style of the live page."""
    return (files("unitcad") / "serve" / "app" / name).read_text("utf-8")
