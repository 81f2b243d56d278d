"""What a result folder says, read back from its files. What is absent stays absent; the page says what to ask for."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

from unitcad.errors import UnitcadError
from unitcad.report.models import model_key, spec_in
from unitcad.spec import Spec

PAGE = "report.html"
TEMPORARY = ".tmp-"
MANIFEST = "manifest.json"


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
    found["spec"] = json.loads(spec.model_dump_json(exclude_none=True))
    return {**found, "model": model_key(spec)}, spec


def table(folder: Path, variants: list[dict[str, Any]]) -> dict[str, Any]:
    """A batch's table: `columns` and `rows`, each row with the folder of its variant first ("" for one that failed).

    From variants.csv where the batch wrote one, else from the manifests.
    """
    file = folder / "variants.csv"
    if file.is_file():
        with file.open(newline="", encoding="utf-8") as lines:
            rows = list(csv.DictReader(lines))
        if rows and "folder" in rows[0]:
            columns = [name for name in rows[0] if name != "folder"]
            return {"columns": columns, "rows": [[r["folder"] or "", *(_value(r[c]) for c in columns)] for r in rows]}
    rows = [_row(each) for each in variants]
    columns = list(dict.fromkeys(name for row in rows for name in row))
    return {
        "columns": columns,
        "rows": [[each["folder"], *(row.get(c) for c in columns)] for each, row in zip(variants, rows, strict=True)],
    }


def batch(folder: Path) -> dict[str, Any] | None:
    """What the batch says of itself: batch.json, or None."""
    return _json(folder / "batch.json")


def _row(each: dict[str, Any]) -> dict[str, Any]:
    manifest, spec = each["manifest"], each["spec"] or {}
    row: dict[str, Any] = {"name": manifest.get("name"), "design": manifest.get("design")}
    row["diameter_mm"] = spec.get("diameter_mm")
    for i, layer in enumerate(spec.get("layers", [])):
        row |= {f"layers.{i}.{key}": value for key, value in layer.items()}
    for part in manifest.get("parts", []):
        if part.get("made") == "cast":
            row[f"{part['name']}_mm3"] = part["volume_mm3"]
    laws = manifest.get("laws", [])
    row["laws"] = ("hold" if all(law["ok"] for law in laws) else "broken") if laws else None
    row["warnings"] = len(manifest.get("warnings", []))
    return row


def _value(text: str | None) -> Any:
    """A cell of a CSV file: a finite number where it reads as one, None where it is empty."""
    if text is None or text == "":
        return None
    try:
        number = float(text)
    except ValueError:
        return text
    return number if abs(number) < float("inf") else text


def _json(path: Path) -> Any:
    """The data of a JSON file, None without the file. Raises UnitcadError where it can't be read."""
    try:
        return json.loads(path.read_text("utf-8"))
    except FileNotFoundError:
        return None
    except (OSError, ValueError) as error:
        raise UnitcadError(f"{path}: can't be read ({error})") from None
