"""Reading a result folder. Absent outputs stay absent; the page names the option that makes them.

A folder may be damaged, or made to do harm: nothing outside it is read, no link is followed, no special
file opened, and no code of a spec run. Unreadable files are named with the reason, and the rest is shown.
"""

from __future__ import annotations

import base64
import json
import os
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import msgspec
from msgspec import UNSET, Struct, UnsetType, structs

from unitcad import files
from unitcad.casting.cast_record import ENDING, read_cast_record
from unitcad.documents import read_json, read_toml
from unitcad.errors import Refusal, UnitcadError, misfit
from unitcad.files import TEMPORARY
from unitcad.moulds.mould_set import MouldSet
from unitcad.pipeline.manifest import PAGE, Manifest, level_columns
from unitcad.pipeline.plan import GEOMETRIC, build_key
from unitcad.report.html_page import REFERENCE
from unitcad.rooms import FileKind, file_kinds
from unitcad.spec import Spec, to_data, with_formats
from unitcad.validation import from_data

LARGEST_PICTURE = 1_000_000
"""Bytes of a step's picture, at most."""
MOST_PICTURES = 500
PNG = b"\x89PNG\r\n\x1a\n"


class ListedVariant(Struct):
    """A variant of a batch."""

    folder: str | None = None


class SweptLevels(Struct):
    """The swept keys that the level at the edge does not read.

    `not_measured`: swept lengths with the one value, mm, that every measured unit had.
    """

    unread: list[str]
    not_measured: dict[str, float] = {}


class BatchFile(Struct):
    """batch.json."""

    columns: list[str]
    variants: list[ListedVariant]
    estimate: SweptLevels | None = None


class VariantRecord(Struct, kw_only=True):
    """A variant on the page; a file that its folder lacks, or that can't be read, is None.

    `casts`: the cast records in it; `drawings`: SVG by path; `pictures`: those of the procedure's steps as data by
    path, only on the page of one variant; `files`: (path, bytes); `damaged`: unreadable files; `model`: the key of the
    geometry, and `no_model` the reason for none.
    """

    folder: str
    manifest: Manifest
    estimate: dict[str, Any] | None
    casting: dict[str, Any] | None
    drawings: dict[str, str]
    pictures: dict[str, str]
    casts: list[dict[str, Any]]
    files: list[tuple[str, int]]
    damaged: list[str]
    spec: dict[str, Any] | None = None
    model: str | None = None
    no_model: str | UnsetType = UNSET

    def as_dict(self) -> dict[str, Any]:
        """Return the record as plain data."""
        return {name: value for name, value in structs.asdict(self).items() if value is not UNSET}


class ResultsTable(Struct, frozen=True):
    """Table of a batch on the page: each row begins with the folder that its variant has, or can have, else "".

    `swept` are the columns that a person chose values for.
    """

    columns: list[str]
    rows: list[list[Any]]
    swept: list[str] = []


def expect(data: Any, kind: Any, path: Path) -> None:
    """Raise UnitcadError, naming file and place, for data of another kind, or with the page's own key."""
    level = [data]
    while level:
        tables = [node for node in level if isinstance(node, dict)]
        if any(REFERENCE in table for table in tables):
            raise UnitcadError(f"{path}: is not a result of unitcad: a key of it is a NUL")
        level = [item for table in tables for item in table.values()] + [
            item for node in level if isinstance(node, list) for item in node
        ]
    try:
        msgspec.convert(data, kind)
    except msgspec.ValidationError as error:
        raise UnitcadError(f"{path}: is not a result of unitcad: {misfit(error)}") from None


JSON, CSV = BATCH_TABLES = ("batch.json", "variants.csv")


def read_batch(folder: Path) -> dict[str, Any] | None:
    """Read the table of a batch's folder; None without one. Raises UnitcadError if it can't be read."""
    try:
        batch = read_json(folder / JSON, largest=files.LARGEST_TABLE, links=False)
    except files.NotThere:
        return None
    expect(batch, BatchFile, folder / JSON)
    return batch


MANIFEST = "manifest.json"
TABLES = ("estimate", "casting")
"""JSON files of a variant that the page shows, without their ending."""
TIMINGS = "timings.json"
"""Left out of the page: the duration of a build differs from run to run."""
OF_EVERY_BATCH = ("index", "status", "reason", "folder")
"""Columns that batch.json has before those that were swept, which end at `name`."""
DAMAGED = "damaged"
LARGEST_DRAWING = 4_000_000
"""Bytes of a drawing, at most."""
MOST_CASTS = 200
"""Cast records of a variant that the page shows, at most."""
STEPS = "steps/"
"""Place of the pictures of the procedure's steps in a variant's folder."""
MOST_FILES = 2000
"""Files of a variant that the page lists, at most."""


def is_variant(folder: Path) -> bool:
    """Check whether a folder is one variant's result, damaged or not."""
    return os.path.lexists(folder / MANIFEST)


def compound_in(folder: Path) -> FileKind | None:
    """Return the kind of compound, such as an array, that a folder is the result of; None for a unit's."""
    kinds = [kind for kind in file_kinds() if kind.subject]
    named = {kind: folder / f"{kind.name}.toml" for kind in kinds}
    return next((kind for kind, path in named.items() if path.is_file() and not path.is_symlink()), None)


def variant_folders(folder: Path) -> list[Path]:
    """List the results directly below a folder, by name, without unfinished ones and links."""
    there = [Path(entry.path) for entry in os.scandir(folder) if entry.is_dir(follow_symlinks=False)]
    return sorted(path for path in there if not path.name.startswith(TEMPORARY) and is_variant(path))


def read_variant(folder: Path, root: Path) -> tuple[VariantRecord, Spec | None]:
    """Read a variant's folder, and its spec (None if it can't be read). Paths are relative to `root`.

    Raises UnitcadError for a manifest that can't be read.
    """
    manifest = read_json(folder / MANIFEST, links=False)
    expect(manifest, Manifest, folder / MANIFEST)
    where = folder.relative_to(root).as_posix()
    damage: list[str] = []
    tables = {name: read_sound(folder / f"{name}.json", read_table, damage.append) for name in TABLES}
    listed = list(_regular(folder, damage))
    drawings = [path for path in listed if path.endswith(".svg")]
    read = {path: read_sound(folder / path, _drawing, damage.append) for path in drawings}
    casts = [read_sound(folder / path, _cast, damage.append) for path in _casts(listed)]
    record = VariantRecord(
        folder="" if where == "." else where,
        manifest=manifest,
        **tables,
        drawings={path: text for path, text in read.items() if text is not None},
        # A page of many variants would be too large with all of them; bench.html of each has them.
        pictures=step_pictures(folder, (p for p in listed if p.startswith(STEPS))) if folder == root else {},
        casts=[cast for cast in casts if cast is not None],
        files=[(path, (folder / path).lstat().st_size) for path in listed if path not in (PAGE, TIMINGS)],
        damaged=damage,
    )
    try:
        spec = spec_in(folder)
        record.spec, record.model = to_data(spec), model_key(spec)
    except UnitcadError as error:
        record.no_model = str(error)
        return record, None
    return record, spec


def read_sound(path: Path, read: Callable[[Path], Any], say: Callable[[str], object]) -> Any:
    """Return the content of a file by `read`; None if it is missing, or damaged, which is said."""
    try:
        return read(path)
    except files.NotThere:
        return None
    except UnitcadError as error:
        say(str(error))
        return None


def _regular(folder: Path, damage: list[str]) -> Iterator[str]:
    """List regular files below a folder by their paths in it, sorted; `damage` gets links, special files and excess."""
    listed: list[str] = []
    left = [folder]
    while left and len(listed) < MOST_FILES:
        try:
            entries = list(os.scandir(left.pop()))
        except OSError as error:
            damage.append(f"{error.filename}: {error.strerror}")
            continue
        for entry in entries:
            if entry.is_dir(follow_symlinks=False):
                left.append(Path(entry.path))
            elif entry.is_file(follow_symlinks=False):
                listed.append(Path(entry.path).relative_to(folder).as_posix())
            else:
                damage.append(f"{entry.path}: is a link or a special file, skipped")
    if len(listed) >= MOST_FILES:
        damage.append(f"{folder}: has more than {MOST_FILES} files, the others are skipped")
    return iter(sorted(listed)[:MOST_FILES])


def _casts(listed: list[str]) -> list[str]:
    return [path for path in listed if path.endswith(ENDING) and "/" not in path][:MOST_CASTS]


def check_casts(folder: Path) -> None:
    """Raise UnitcadError, a line for each, for damaged cast records in a result, or in those of a batch."""
    damage: list[str] = []
    for path in [*sorted(folder.glob(f"*{ENDING}")), *sorted(folder.glob(f"*/*{ENDING}"))]:
        if is_variant(path.parent):
            read_sound(path, _cast, damage.append)
    if damage:
        raise UnitcadError("\n".join(damage))


def _cast(path: Path) -> dict[str, Any]:
    """Read a cast record, without the spec in it: the page has the variant's own."""
    try:
        record = read_cast_record(path, links=False)
    except Refusal as refused:
        raise UnitcadError(f"{path}: {refused}") from None
    return {"file": path.name, **msgspec.to_builtins(structs.replace(record, spec=None))}


def _drawing(path: Path) -> str:
    return files.read_text(path, largest=LARGEST_DRAWING, links=False)


def results_table(batch: dict[str, Any] | None, variants: list[VariantRecord], damaged: dict[str, str]) -> ResultsTable:
    """Return a batch's table, as `batch` (its batch.json) lists it, else from the manifests.

    The levels at the edge come first, then chosen values, then the rest. `damaged` says by folder why a result
    can't be read.
    """
    if batch:
        entries, columns = batch["variants"], [name for name in batch["columns"] if name != "folder"]
    else:
        entries = [{"folder": each.folder, **_row(each)} for each in variants]
        entries += [{"folder": name, "name": name} for name in damaged]
        columns = [name for name in dict.fromkeys(name for entry in entries for name in entry) if name != "folder"]
    if damaged:
        entries = [
            {**entry, "status": DAMAGED, "reason": damaged[entry["folder"]]}
            if entry.get("folder") in damaged
            else entry
            for entry in entries
        ]
        columns = [*(name for name in ("status", "reason") if name not in columns), *columns]
    swept = swept_columns(columns)
    columns = in_order(columns, swept)
    there = {each.folder for each in variants}
    rows = [
        [folder if (folder := entry.get("folder")) in there else "", *(cell(entry.get(c)) for c in columns)]
        for entry in entries
    ]
    return ResultsTable(columns, rows, [name for name in columns if name in swept])


def swept_columns(columns: list[str]) -> set[str]:
    """Return the columns of chosen values: those before `name` in a batch; else the spec's."""
    before = columns[: columns.index("name")] if "name" in columns else []
    given = {name for name in columns if name in ("design", "diameter_mm") or name.startswith("layers.")}
    return {name for name in before if name not in OF_EVERY_BATCH} | given


def in_order(columns: list[str], swept: set[str]) -> list[str]:
    """Order columns: name, the edge's levels, swept values, the rest, the index."""

    def place(name: str) -> int:
        if name == "name":
            return 0
        if name.startswith("edge_"):
            return 1
        if name in swept:
            return 2
        return 4 if name == "index" else 3

    return sorted(columns, key=place)


def _row(record: VariantRecord) -> dict[str, Any]:
    """Return a variant's columns in the table of a folder without batch.json."""
    manifest, spec = record.manifest, record.spec or {}
    row: dict[str, Any] = {
        "name": manifest["name"],
        "design": manifest["design"],
        "diameter_mm": spec.get("diameter_mm"),
    }
    for i, layer in enumerate(spec.get("layers", [])):
        row |= {f"layers.{i}.{key}": value for key, value in layer.items()}
    row |= {f"{part['name']}_mm3": part["volume_mm3"] for part in manifest["parts"] if part["made"] == "cast"}
    row |= level_columns(manifest["estimate"])
    checks = manifest["mould_checks"]
    row["mould_checks"] = ("hold" if all(check["ok"] for check in checks) else "broken") if checks else None
    row["warnings"] = len(manifest["warnings"])
    return row


def cell(value: Any) -> Any:
    """Return a cell that the page can sort: a number, a text, or None."""
    if value is None or value == "":
        return None
    return value if isinstance(value, int | float | str) and not isinstance(value, bool) else json.dumps(value)


def read_table(path: Path) -> dict[str, Any]:
    """Read a JSON file with a table."""
    data = read_json(path, links=False)
    expect(data, dict[str, Any], path)
    return data


def step_pictures(folder: Path, paths: Iterable[str]) -> dict[str, str]:
    """Return the pictures of these paths in a folder as data, without files that are missing or no PNG."""
    read: dict[str, str] = {}
    for path in list(dict.fromkeys(path for path in paths if path))[:MOST_PICTURES]:
        parts = Path(path).parts
        if Path(path).is_absolute() or ".." in parts or any((folder / p).is_symlink() for p in Path(path).parents):
            continue
        try:
            content = files.read(folder / path, largest=LARGEST_PICTURE, links=False)
        except UnitcadError:
            continue
        if content.startswith(PNG):
            read[path] = f"data:image/png;base64,{base64.b64encode(content).decode()}"
    return read


def spec_in(folder: Path) -> Spec:
    """Read the resolved spec of a result folder. Raises UnitcadError if it can't be read."""
    return from_data(read_toml(folder / "spec.toml", links=False))


def model_key(spec: Spec) -> str:
    """Return the key of a geometry, without silicones and formats: sixteen hex digits."""
    return build_key(MouldSet(with_formats(spec)), GEOMETRIC, False)[:16]
