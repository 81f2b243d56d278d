"""Result folders: named by content, written under a temporary name, then put in place whole."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import re
import shutil
from collections.abc import Iterator
from pathlib import Path

from msgspec import structs

from unitcad.errors import UnitcadError
from unitcad.spec import Spec, read_toml, to_json, with_formats

UNCHECKED = "--no-check"
TEMPORARY = ".tmp-"
PAGE = "report.html"
"""The page of a folder, made on request and kept up by every later build into it."""


def folder_name(spec: Spec) -> str:
    """<slug>-<hash12>, at most 63 characters; the hash covers the effective spec without name and formats."""
    slug = re.sub(r"[^a-z0-9]+", "-", spec.name.lower()).strip("-")[:50].rstrip("-") or "unit"
    return f"{slug}-{spec_hash(spec)[:12]}"


def spec_hash(spec: Spec) -> str:
    """SHA-256 of the effective spec without name and formats."""
    return hashlib.sha256(to_json(structs.replace(with_formats(spec), name="")).encode()).hexdigest()


def earlier_formats(folder: Path, spec: Spec) -> tuple[str, ...]:
    """The formats that an existing result has, to be kept.

    Raises UnitcadError for a folder that holds something else: no spec.toml of ours, or another spec.
    """
    if not folder.exists():
        return ()
    file = folder / "spec.toml"
    if not file.is_file():
        raise UnitcadError(f"{folder}: is not a result of unitcad (no spec.toml); choose another folder with -o")
    try:
        from unitcad.spec import from_data

        there = from_data(read_toml(file))
    except UnitcadError as error:
        raise UnitcadError(f"{folder}: its spec.toml can't be read ({error}); move the folder away") from None
    if spec_hash(there) != spec_hash(spec):
        raise UnitcadError(f"{folder}: holds the result of another spec (spec.toml differs); move it away or use -o")
    return tuple(there.output.formats)


def earlier_checked(folder: Path) -> bool:
    """Whether an existing result has laws judged and files checked: a later build keeps them up."""
    try:
        left_out = json.loads((folder / "manifest.json").read_text("utf-8"))["left_out"]
        return all(entry["why"] != UNCHECKED for entry in left_out)
    except (OSError, ValueError, KeyError, TypeError):
        return False


def earlier_outputs(folder: Path) -> tuple[str, ...]:
    """The outputs that an existing result has."""
    try:
        return tuple(json.loads((folder / "manifest.json").read_text("utf-8"))["outputs"])
    except (OSError, ValueError, KeyError, TypeError):
        return ()


@contextlib.contextmanager
def replacing(folder: Path) -> Iterator[Path]:
    """A fresh temporary folder that takes `folder`'s place when the block ends well, and goes when it does not.

    Files of the old result that the new one lacks are kept. An interruption at any point leaves the old result whole:
    at its place, or beside it under a temporary name from which the next run takes it back.
    """
    folder.parent.mkdir(parents=True, exist_ok=True)
    fresh = folder.parent / f"{TEMPORARY}{folder.name}-{os.getpid()}"
    aside = folder.parent / f"{TEMPORARY}{folder.name}-old"
    restore(folder)
    shutil.rmtree(fresh, ignore_errors=True)
    fresh.mkdir()
    try:
        yield fresh
        if folder.exists():
            _keep_others(folder, fresh)
            folder.rename(aside)
        fresh.rename(folder)
    except BaseException:
        shutil.rmtree(fresh, ignore_errors=True)
        restore(folder)
        raise
    shutil.rmtree(aside, ignore_errors=True)


def restore(folder: Path) -> None:
    """Put back an old result that an interrupted swap left aside."""
    aside = folder.parent / f"{TEMPORARY}{folder.name}-old"
    if aside.exists() and not folder.exists():
        aside.rename(folder)


def clear_leftovers(out: Path) -> None:
    """Remove what processes that are gone left half written in `out`, and put back what they had moved aside."""
    for left in out.glob(f"{TEMPORARY}*"):
        name, _, owner = left.name.removeprefix(TEMPORARY).rpartition("-")
        if owner == "old":
            restore(out / name)
            shutil.rmtree(left, ignore_errors=True)
        elif owner.isdigit() and not _alive(owner):
            shutil.rmtree(left, ignore_errors=True)


def _keep_others(old: Path, new: Path) -> None:
    for file in sorted(old.rglob("*")):
        copy = new / file.relative_to(old)
        if file.is_file() and not copy.exists():
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(file, copy)


def _alive(pid: str) -> bool:
    if not pid.isdigit():
        return False
    try:
        os.kill(int(pid), 0)
    except ProcessLookupError:
        return False
    except OSError:
        return True
    return True
