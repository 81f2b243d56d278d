"""A page's data, a batch's table as a page shows it, and pages with a table of a test's own."""

import base64
import gzip
import json
import re

from unitcad.report import page as pages


def data_of(html):
    """A page's data, as the page reads it; those of a live page are not compressed."""
    packed = re.search(r'<script type="text/plain" id="data">([A-Za-z0-9+/=]*)</script>', html)
    assert packed
    content = base64.b64decode(packed[1])
    return json.loads(gzip.decompress(content) if content.startswith(b"\x1f\x8b") else content)


def column(visit, name):
    """The cells of a column as shown."""
    heads = [
        text.replace("▲", "").replace("▼", "").strip()
        for text in visit.page.locator(".variants thead tr:first-child th").all_inner_texts()
    ]
    at = heads.index(name) + 1
    return visit.page.locator(f".variants tbody tr > :nth-child({at})").all_inner_texts()


def table_page(folder, columns, rows, swept=None, **more):
    """A page with a table of our own: each row the variant's folder and its cells."""
    data = {
        "title": "many",
        "version": "0",
        "variants": [],
        "pool": [],
        "models": {},
        "batch": None,
        "damaged": [],
        **more,
    }
    file = folder / "table.html"
    file.write_text(
        pages.page({**data, "table": {"columns": columns, "rows": rows, "swept": swept or []}}, "many"), "utf-8"
    )
    return file
