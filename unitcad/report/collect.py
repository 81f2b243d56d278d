"""What a result folder says, read back from its files. What is absent stays absent; the page says what to ask for."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from unitcad.errors import UnitcadError
from unitcad.files import TEMPORARY
from unitcad.pipeline.folder import PAGE
from unitcad.report.models import model_key, spec_in
from unitcad.spec import Spec, to_data

MANIFEST = "manifest.json"
OF_EVERY_BATCH = ("index", "status", "reason", "folder")
"""Columns that batch.json has before those that were swept, which end at `name`."""


def is_variant(folder: Path) -> bool:
    """Whether a folder is one variant's result."""
    return (folder / MANIFEST).is_file()


def variant_folders(folder: Path) -> list[Path]:
    """The results directly below a folder, by name; unfinished ones are left out."""
    return sorted(f for f in folder.iterdir() if not f.name.startswith(TEMPORARY) and f.is_dir() and is_variant(f))


def variant(folder: Path, root: Path) -> tuple[dict[str, Any], Spec | None]:
    """What a variant's folder holds, and its spec (None where it can't be read). Paths are relative to `root`.

    Raises UnitcadError for a manifest that can't be read.
    """
    manifest = _json(folder / MANIFEST)
    if not isinstance(manifest, dict):
        raise UnitcadError(f"{folder / MANIFEST}: is not a manifest of unitcad")
    where = folder.relative_to(root).as_posix()
    found: dict[str, Any] = {
        "folder": "" if where == "." else where,
        "manifest": manifest,
        "estimate": _json(folder / "estimate.json"),
        "casting": _json(folder / "casting.json"),
        "slicer": _json(folder / "slicer.json"),
        "drawings": {
            file.relative_to(folder).as_posix(): file.read_text("utf-8") for file in sorted(folder.rglob("*.svg"))
        },
        "files": [
            [file.relative_to(folder).as_posix(), file.stat().st_size]
            for file in sorted(folder.rglob("*"))
            if file.is_file() and file.name != PAGE
        ],
    }
    try:
        spec = spec_in(folder)
    except UnitcadError as error:
        return {**found, "spec": None, "model": None, "no_model": str(error)}, None
    found["spec"] = to_data(spec)
    return {**found, "model": model_key(spec)}, spec


def table(folder: Path, variants: list[dict[str, Any]]) -> dict[str, Any]:
    """A batch's table: `columns` and `rows`, each row with the folder of its variant first ("" for one that failed).

    As batch.json lists them where there is one, else from the manifests. What was chosen comes first, then the levels
    at the edge, then the rest.
    """
    said = _json(folder / "batch.json")
    if isinstance(said, dict) and isinstance(said.get("variants"), list):
        entries, columns = said["variants"], [name for name in said.get("columns", []) if name != "folder"]
    else:
        entries = [{"folder": each["folder"], **_row(each)} for each in variants]
        columns = [name for name in dict.fromkeys(name for entry in entries for name in entry) if name != "folder"]
    columns = _in_order(columns)
    there = {each["folder"] for each in variants}
    return {
        "columns": columns,
        "rows": [
            [entry.get("folder") if entry.get("folder") in there else "", *(_cell(entry.get(c)) for c in columns)]
            for entry in entries
        ],
    }


def _in_order(columns: list[str]) -> list[str]:
    """Name, what was swept (before `name` in a batch, of the spec without one), the edge's levels, the rest."""
    before = columns[: columns.index("name")] if "name" in columns else []
    swept = {name for name in before if name not in OF_EVERY_BATCH} | {"design", "diameter_mm"}

    def place(name: str) -> int:
        if name == "name":
            return 0
        if name in swept or name.startswith("layers."):
            return 1
        return 2 if name.startswith("edge_") else 3

    return sorted(columns, key=place)


def batch(folder: Path) -> dict[str, Any] | None:
    """What the batch says of itself: batch.json without its variants, or None."""
    said = _json(folder / "batch.json")
    return {key: value for key, value in said.items() if key != "variants"} if isinstance(said, dict) else None


def _row(each: dict[str, Any]) -> dict[str, Any]:
    manifest, spec = each["manifest"], each["spec"] or {}
    row: dict[str, Any] = {"name": manifest.get("name"), "design": manifest.get("design")}
    row["diameter_mm"] = spec.get("diameter_mm")
    for i, layer in enumerate(spec.get("layers", [])):
        row |= {f"layers.{i}.{key}": value for key, value in layer.items()}
    for part in manifest.get("parts", []):
        if part.get("made") == "cast":
            row[f"{part['name']}_mm3"] = part["volume_mm3"]
    for model, said in ((manifest.get("estimate") or {}).get("models") or {}).items():
        row[f"edge_{model}"] = said.get("edge")
    laws = manifest.get("laws", [])
    row["laws"] = ("hold" if all(law["ok"] for law in laws) else "broken") if laws else None
    row["warnings"] = len(manifest.get("warnings", []))
    return row


def _cell(value: Any) -> Any:
    """A cell that the page can sort: a number, a text, or None."""
    if value is None or value == "":
        return None
    return value if isinstance(value, int | float | str) and not isinstance(value, bool) else json.dumps(value)


def _json(path: Path) -> Any:
    """The data of a JSON file, None without the file. Raises UnitcadError where it can't be read."""
    try:
        return json.loads(path.read_text("utf-8"))
    except FileNotFoundError:
        return None
    except (OSError, ValueError) as error:
        raise UnitcadError(f"{path}: can't be read ({error})") from None
