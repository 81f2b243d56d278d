"""The page of a variant or a batch: its data, collected, and its models."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from html import escape
from pathlib import Path
from typing import Any

from msgspec import structs

from unitcad import __version__
from unitcad.documents import parse_toml
from unitcad.errors import UnitcadError
from unitcad.files import write
from unitcad.meshcheck.findings import counted
from unitcad.moulds.mould_set import MouldSet
from unitcad.pipeline.manifest import BENCH, PAGE
from unitcad.pipeline.plan import glb_content
from unitcad.pipeline.scenes import exploded_moves, moments, unit_apart
from unitcad.pipeline.subjects import compound
from unitcad.report import read_results
from unitcad.report.bench_page import write_bench
from unitcad.report.html_page import VIEW, Pool, asset, compress, html_page, plain_page
from unitcad.report.read_results import VariantRecord
from unitcad.spec import Spec

VENDORED = ("three.min.js", "uplot.min.js")
PROGRAMS = (
    "dom.js", "glb.js", "viewer.js", "controls.js", "plots.js", "estimate.js", "sections.js", "casting.js",
    "filters.js", "rows.js", "compare.js", "table.js", "batch.js", "main.js",
)  # fmt: skip
MOST_DAMAGED = 20
"""Damaged results that are named when a page is written; the page names all."""
STYLES = ("vendor/uplot.min.css", "app/page.css", "app/print.css")


Modelled = Callable[[Spec], dict[str, Any]]
"""Returns the result of `model` for a spec."""


def model(spec: Spec) -> dict[str, Any]:
    """Return a geometry for the page; GLB files compress and in base 64. Lengths in mm.

    Raises UnitcadError if the geometry can't be made any more.
    """
    moulds = MouldSet(spec)
    plan = moulds.plan
    return {
        "unit": compress(glb_content(moulds, moulds.unit)),
        "moulds": compress(glb_content(moulds, plan.tools)),
        "cells": cells(moulds),
        "moments": [{"title": moment.title, "parts": list(moment.parts)} for moment in moments(moulds)],
        "unit_apart": {name: list(offset) for name, offset in unit_apart(moulds).items()},
        "moulds_apart": {name: list(offset) for name, offset in exploded_moves(moulds).items()},
    }


def view(spec: Spec) -> str:
    """Return the 3D view of a unit and its moulds as an element for a notebook; "" if the moulds can't be made.

    It is a page in a frame that runs only its own programs and contacts nothing.
    """
    try:
        content = plain_page(spec.name, VIEW, model(spec))
    except UnitcadError:
        return ""
    style = "width: 100%; height: 640px; border: 0"
    title = escape(f"{spec.name} in 3D")
    return f'<iframe title="{title}" sandbox="allow-scripts" style="{style}" srcdoc="{escape(content)}"></iframe>'


def cells(moulds: MouldSet) -> list[list[float]]:
    """Return the places of the unit's layers in the moulds: x, y (mm) and quarter turns about z, a cell each."""
    one_sided = moulds.dimensions.sides == (1,)
    return [[cell.x, cell.y, 2 if one_sided and cell.sides == (-1,) else 0] for cell in moulds.plan.layout.cells]


def write_report(
    folder: Path,
    warn: Callable[[str], None] = lambda line: None,
    modelled: Modelled = model,
) -> Path:
    """Write report.html for the variant or the batch in a folder.

    `warn` takes a line for each damaged result; `modelled` returns the 3D models of a unit. Returns the page's path.
    Raises UnitcadError if the folder has no result.
    """
    if kind := read_results.compound_in(folder):
        for unit in sorted((folder / "units").glob("*")):
            if unit.is_dir() and not unit.is_symlink() and read_results.is_variant(unit):
                write_report(unit, warn)
        _write_bench(folder, warn)
        return compound(kind).write_page(folder, warn)
    if folder.is_dir() and read_results.is_variant(folder):
        _write_bench(folder, warn)
    data, title, damage = page_data(folder, modelled)
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


def _write_bench(folder: Path, warn: Callable[[str], None]) -> None:
    """Write the bench page; if its files are damaged, write none and warn why."""
    try:
        write_bench(folder)
    except UnitcadError as error:
        warn(f"warning: no {BENCH}: {error}")


def page_data(folder: Path, modelled: Modelled | None = model) -> tuple[dict[str, Any], str, dict[str, str]]:
    """Collect the page's data, its title, and why a result is damaged by its folder's name.

    Geometries are made by `modelled`, none without it. Raises UnitcadError if the folder has no result.
    """
    if not folder.is_dir():
        found = "is a file" if folder.exists() else "no such folder"
        raise UnitcadError(f"{folder}: {found}; name the folder of a build or of a batch")
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
            damaged[read_results.JSON] = str(error)
        if not folders and not batch:
            why = "; ".join(damaged.values()) or "no manifest.json in it or right below it"
            raise UnitcadError(f"{folder}: has no result of unitcad ({why})")
        for each in folders:
            try:
                record, spec = read_results.read_variant(each, folder)
            except UnitcadError as error:
                damaged[each.name] = str(error)
                continue
            records.append(record)
            specs.append(spec)
        of_variants = {name: why for name, why in damaged.items() if name not in read_results.BATCH_TABLES}
        table = read_results.results_table(batch, records, of_variants)
        title = f"{(batch or {}).get('name') or folder.resolve().name}: {counted(len(table.rows), 'variant')}"
    models = _models(records, specs, modelled) if modelled else {}
    pool = Pool()
    data = {
        "title": title,
        "version": __version__,
        "variants": [[record.folder, pool.put(record.as_dict())] for record in records],
        "table": structs.asdict(table) if table else None,
        "estimate": (batch or {}).get("estimate"),
        "batch": {key: value for key, value in batch.items() if key != "variants"} if batch else None,
        "damaged": sorted(damaged.items()),
        "pool": pool.entries,
        "models": models,
    }
    partly = {record.folder or folder.name: record.damaged for record in records if record.damaged}
    return data, title, damaged | {name: whys[0] for name, whys in partly.items()}


def _models(records: list[VariantRecord], specs: Iterable[Spec | None], modelled: Modelled) -> dict[str, Any]:
    """Return each geometry once, by its key; a record whose geometry can't be made gets the reason."""
    models: dict[str, Any] = {}
    for record, spec in zip(records, specs, strict=True):
        if spec is None or record.model is None or record.model in models:
            continue
        try:
            models[record.model] = modelled(spec)
        except UnitcadError as error:
            record.model, record.no_model = None, str(error)
    return models


def page(data: dict[str, Any], title: str) -> str:
    """Return the HTML of a page with `data`."""
    licences = "\n\n".join(
        f"{name} {entry['version']}\n{asset(f'vendor/{name}.LICENSE.txt')}" for name, entry in vendored().items()
    )
    without = "Without one, read casting.md and section.svg."
    return html_page(data, title, PROGRAMS, STYLES, VENDORED, without, licences)


def vendored() -> dict[str, dict[str, Any]]:
    """Return the libraries that every page carries, by name: version, licence, files, how they were made."""
    return parse_toml(asset("vendor/versions.toml"), "versions.toml")
