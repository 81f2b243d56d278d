"""The page: one HTML file with its data, its programs and their licences; nothing outside it is ever contacted.

All text from specs and results travels as compressed JSON in base 64 and is set as text, never as markup. A policy in
the page's head forbids every connection, and every script but those whose hashes it names.
"""

from __future__ import annotations

import base64
import gzip
import hashlib
import html
import json
import tomllib
from collections.abc import Callable, Iterable
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from msgspec import structs

from unitcad import __version__
from unitcad.check.findings import counted
from unitcad.errors import UnitcadError
from unitcad.files import write
from unitcad.pipeline.folder import PAGE
from unitcad.report import read_results
from unitcad.report.pool import Pool
from unitcad.report.records import VariantRecord
from unitcad.report.viewer_models import model
from unitcad.spec import Spec

VENDORED = ("three.min.js", "uplot.min.js")
PROGRAMS = (
    "dom.js", "glb.js", "viewer.js", "controls.js", "plots.js", "estimate.js", "sections.js", "casting.js",
    "filters.js", "rows.js", "compare.js", "table.js", "main.js",
)  # fmt: skip
MOST_DAMAGED = 20
"""Damaged results that are named when a page is written; the page names all."""
STYLES = ("vendor/uplot.min.css", "app/page.css", "app/print.css")


def write_report(folder: Path, warn: Callable[[str], None] = lambda line: None) -> Path:
    """Write `folder`/report.html for the variant or the batch in `folder`; returns its path.

    `warn` gets lines that say which results are damaged, and why. Raises UnitcadError where the folder holds none.
    """
    data, title, damage = page_data(folder)
    target = folder / PAGE
    if damage:
        of = max(len(data["variants"]), len(data["table"]["rows"]) if data["table"] else 0)
        warn(f"warning: {len(damage)} of {counted(of, 'result')} {'is' if len(damage) == 1 else 'are'} damaged:")
        for name, why in list(damage.items())[:MOST_DAMAGED]:
            warn(f"  {name}: {why}")
        if len(damage) > MOST_DAMAGED:
            warn(f"  and {len(damage) - MOST_DAMAGED} more: see the page")
    write(target, page(data, title).encode("utf-8", "replace"))
    return target


def page_data(folder: Path) -> tuple[dict[str, Any], str, dict[str, str]]:
    """Collect the page's data, its title, and why a result is damaged by its folder's name.

    Raises UnitcadError where the folder holds no result.
    """
    if not folder.is_dir():
        raise UnitcadError(f"{folder}: is not a folder")
    damaged: dict[str, str] = {}
    if read_results.is_variant(folder):
        record, spec = read_results.read_variant(folder, folder)
        records, specs, table, batch = [record], [spec], None, None
        title = record.manifest["name"] or folder.resolve().name
    else:
        records, specs, batch = [], [], None
        folders = read_results.variant_folders(folder)
        try:
            batch = read_results.read_batch(folder)
        except UnitcadError as error:
            damaged["batch.json"] = str(error)
        if not folders and not batch:
            why = damaged.get("batch.json") or "no manifest.json in it or right below it"
            raise UnitcadError(f"{folder}: holds no result of unitcad ({why})")
        for each in folders:
            try:
                record, spec = read_results.read_variant(each, folder)
            except UnitcadError as error:
                damaged[each.name] = str(error)
                continue
            records.append(record)
            specs.append(spec)
        table = read_results.results_table(
            batch, records, {name: why for name, why in damaged.items() if name != "batch.json"}
        )
        title = f"{(batch or {}).get('name') or folder.resolve().name}: {counted(len(table.rows), 'variant')}"
    models = _models(records, specs)
    pool = Pool()
    data = {
        "title": title,
        "version": __version__,
        "variants": [[record.folder, pool.put(record.as_dict())] for record in records],
        "table": structs.asdict(table) if table else None,
        "estimate": _of_all(batch, records),
        "batch": {key: value for key, value in batch.items() if key != "variants"} if batch else None,
        "damaged": sorted(damaged.items()),
        "pool": pool.entries,
        "models": models,
    }
    partly = {record.folder or folder.name: record.damaged for record in records if record.damaged}
    return data, title, damaged | {name: whys[0] for name, whys in partly.items()}


def _of_all(batch: dict[str, Any] | None, records: list[VariantRecord]) -> dict[str, Any]:
    """Return what holds for the levels of all variants: typical error by model, and swept keys that it does not read.

    As batch.json has them; of a folder without one the errors are those of the first estimate.
    """
    if batch and isinstance(batch.get("estimate"), dict):
        return batch["estimate"]
    for record in records:
        table = (record.estimate or {}).get("table_error")
        if isinstance(table, dict):
            found = {name: _typical(table.get(name)) for name in table}
            return {"typical_error": {name: one for name, one in found.items() if one}, "not_read": {}}
    return {"typical_error": {}, "not_read": {}}


def _typical(scores: Any) -> float | None:
    """Return a model's typical factor with the unit left out from its scores in an estimate; None for anything else."""
    try:
        typical = scores["leave_one_unit_out"]["levels"]["geometric_mean"]
    except (KeyError, TypeError):
        return None
    return typical if isinstance(typical, float) else None


def _models(records: list[VariantRecord], specs: Iterable[Spec | None]) -> dict[str, Any]:
    """Return each geometry once, by its key; a record whose geometry can't be made gets the reason."""
    models: dict[str, Any] = {}
    for record, spec in zip(records, specs, strict=True):
        if spec is None or record.model is None or record.model in models:
            continue
        try:
            models[record.model] = model(spec)
        except UnitcadError as error:
            record.model, record.no_model = None, str(error)
    return models


def page(data: dict[str, Any], title: str) -> str:
    """Return the HTML of a page with `data`."""
    scripts = [*(_asset(f"vendor/{name}") for name in VENDORED), *(_asset(f"app/{name}") for name in PROGRAMS)]
    styles = [_asset(name) for name in STYLES]
    licences = "\n\n".join(
        f"{name} {entry['version']}\n{_asset(f'vendor/{name}.LICENSE.txt')}" for name, entry in vendored().items()
    )
    text = json.dumps(data, separators=(",", ":"), allow_nan=False, ensure_ascii=False)
    packed = base64.b64encode(gzip.compress(text.encode("utf-8", "replace"), 9, mtime=0)).decode()
    policy = "; ".join(
        [
            "default-src 'none'",
            "script-src " + " ".join(_hash(script) for script in scripts),
            "style-src " + " ".join(_hash(style) for style in styles),
            "img-src data:",
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
        *(f"<style>{style}</style>" for style in styles),
        "</head>",
        "<body>",
        '<main id="page"><p>Reading ...</p></main>',
        "<noscript><p>A script draws this page. Without one, read casting.md and section.svg.</p></noscript>",
        f'<script type="text/plain" id="data">{packed}</script>',
        f'<script type="text/plain" id="licences">{html.escape(licences, quote=False)}</script>',
        *(f"<script>{script}</script>" for script in scripts),
        "</body>",
        "</html>",
    ]
    return "\n".join([*lines, ""])


def vendored() -> dict[str, dict[str, Any]]:
    """Return the libraries that every page carries, by name: version, licence, files, how they were made."""
    return tomllib.loads(_asset("vendor/versions.toml"))


@cache
def _asset(name: str) -> str:
    """Read a shipped file. No own script or style holds the end tag of its element; a test checks it."""
    return (files("unitcad") / "report" / name).read_text("utf-8")


@cache
def _hash(text: str) -> str:
    return f"'sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}'"
