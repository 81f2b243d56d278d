"""A build's manifest.json against the files of its folder: M001 to M005, and which parts are tools (D and S rules)."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PureWindowsPath
from typing import Any

from unitcad import files
from unitcad.documents import read_json
from unitcad.errors import Refusal, UnitcadError
from unitcad.meshcheck.findings import FileReport, counted, merge
from unitcad.meshcheck.rules.inspection import Options, Printer
from unitcad.meshcheck.rules.m_manifest import M004, M005, ListedFile, check_listed

_MESHES = ("stl", "3mf")
Choice = Callable[[str], Options]


@dataclass(frozen=True)
class Listing:
    """Files of a manifest by absolute path, the printer it names, if any, and listed paths that are not to be followed.

    `path` is the manifest's own.
    """

    path: Path
    files: dict[str, ListedFile]
    printer: str | None
    outside: tuple[str, ...] = ()


def _items(value: Any, kind: type[dict[Any, Any]] | type[list[Any]], place: str) -> Any:
    """Return the value of a key that has a list or a table. Raises ValueError for another one."""
    if not isinstance(value, kind):
        raise ValueError(f"{place} has a value of the wrong kind")
    return value


def _value(table: dict[str, Any], key: str, kind: Any, place: str, *default: Any) -> Any:
    """Return the value of a table's key. Raises ValueError for another kind, and for a missing one without `default`."""
    if key not in table and not default:
        raise ValueError(f"{place} lacks the key {key!r}")
    value = table.get(key, *default)
    if (default and value == default[0]) or (isinstance(value, kind) and not isinstance(value, bool)):
        return value
    raise ValueError(f"{place}.{key} has a value of the wrong kind")


def read(where: str) -> Listing:
    """Read a manifest (its path or its folder). Raises `UnitcadError` if it is none."""
    path = Path(where)
    path = path / "manifest.json" if path.is_dir() else path
    try:
        manifest = read_json(path)
    except UnitcadError as error:
        raise Refusal("--manifest", str(where), f"cannot be read: {error}") from error
    try:
        listed, outside = _listed(path, _items(manifest, dict, "its top level"))
    except ValueError as error:
        raise UnitcadError(f"--manifest {where}: not a manifest of `unitcad build`: {error}") from error
    printer = manifest.get("printer")
    return Listing(path, listed, printer if isinstance(printer, str) else None, tuple(outside))


def _listed(path: Path, manifest: dict[str, Any]) -> tuple[dict[str, ListedFile], list[str]]:
    """Return the files of a manifest by absolute path, and the paths that lead outside its folder. Raises ValueError."""
    listed: dict[str, ListedFile] = {}
    outside: list[str] = []
    for i, entry in enumerate(_value(manifest, "parts", list, "its top level")):
        place = f"parts[{i}]"
        part = _items(entry, dict, place)
        name, role = (_value(part, key, str, place) for key in ("name", "role"))
        whole = _value(part, "volume_mm3", int | float, place, None)
        solids = _value(part, "solids", int, place, 1)
        for key, entry in _value(part, "files", dict, place).items():
            within = f"{place}.files.{key}"
            file = _items(entry, dict, within)
            shown = _value(file, "path", str, within)
            copies, digest = (
                _value(file, key, kind, within, default)
                for key, kind, default in (("copies", int, 1), ("sha256", str, None))
            )
            if leads_outside(path.parent, shown):
                outside.append(shown)
                continue
            at = os.path.abspath(path.parent / shown)
            volume = None if whole is None else copies * whole
            new = ListedFile((name,), role == "tool", digest, volume, copies * solids)
            listed[at] = _together(listed[at], new) if at in listed else new
    return listed, outside


def leads_outside(folder: Path, listed: str) -> bool:
    """Return whether a path of a manifest is absolute, has `..` in it, or leaves the manifest's folder through a link.

    Paths that are absolute or climb on any system are refused on all of them.
    """
    windows = PureWindowsPath(listed)
    if windows.drive or windows.root or ".." in windows.parts:
        return True
    home = os.path.realpath(folder)
    try:
        real = os.path.realpath(os.path.join(home, listed))
    except ValueError:  # a NUL or half a surrogate pair: no file has such a name
        return True
    return not real.startswith(os.path.join(home, ""))


def _together(old: ListedFile, new: ListedFile) -> ListedFile:
    volume = None if old.volume_mm3 is None or new.volume_mm3 is None else old.volume_mm3 + new.volume_mm3
    return ListedFile(old.names + new.names, old.tool and new.tool, old.sha256, volume, old.solids + new.solids)


def work(
    listing: Listing, paths: Sequence[str], options: Choice, printers: Mapping[str, Printer] | None
) -> list[tuple[str, Options]]:
    """Choose the files to check: the named ones, or all meshes of the manifest; only tools with a printer.

    `options` gives those of a path; `printers`: the known ones by name, None if the caller chose the printer.
    """
    chosen = list(paths) or [files.path_seen_from(path) for path in listing.files if path.lower().endswith(_MESHES)]
    pairs = []
    for path in chosen:
        part = listing.files.get(os.path.abspath(path))
        chosen_here = options(path)
        printer = chosen_here.printer
        if part is not None and printers is not None:
            printer = printers.get(listing.printer or "fdm-0.4") if part.tool else None
        elif part is not None and not part.tool:
            printer = None
        pairs.append((path, replace(chosen_here, printer=printer)))
    return pairs


def compare(listing: Listing, report: FileReport, options: Options) -> FileReport:
    """Return the report with the findings of the manifest."""
    part = listing.files.get(os.path.abspath(report.path))
    unlisted = [M004.finding("the manifest does not list this file")]
    findings = unlisted if part is None else check_listed(part, report)
    added = [item for item in findings if options.wants(item.code)]
    return replace(report, findings=merge([*report.findings, *added]))


def check_unread(listing: Listing, checked: Sequence[str], options: Choice) -> list[FileReport]:
    """Report the listed files that were not checked (STEP, drawings and others) and are gone or changed: M003, M004.

    One of the manifest itself comes last if it lists paths outside its folder (M005): nothing there is read.
    """
    seen = {os.path.abspath(path) for path in checked}
    left = [files.path_seen_from(path) for path in listing.files if path not in seen]
    reports = [compare(listing, FileReport(path), options(path)) for path in left]
    name = files.path_seen_from(listing.path)
    if listing.outside and options(name).wants("M005"):
        shown = ", ".join([*(repr(path[:80]) for path in listing.outside[:3]), *["..."][: len(listing.outside) > 3]])
        text = f"{counted(len(listing.outside), 'path')} outside the manifest's folder: {shown}"
        reports.append(FileReport(name, (M005.finding(text, len(listing.outside)),)))
    return [report for report in reports if report.findings]
