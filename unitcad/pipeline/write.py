"""Results in folders: named by content, written under a temporary name, then put in place whole."""

from __future__ import annotations

import contextlib
import os
import re
import shutil
import stat
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from unitcad import cache, files
from unitcad.cache import MemoryStore, MissingContent, Store, digest
from unitcad.documents import read_json, read_toml
from unitcad.errors import UnitcadError
from unitcad.json_text import json_bytes
from unitcad.pipeline.make import make
from unitcad.pipeline.manifest import UNCHECKED, Manifest, failed_codes
from unitcad.pipeline.plan import check_outputs, code_version
from unitcad.pipeline.result import Product, Progress
from unitcad.pipeline.subject import Subject
from unitcad.pipeline.subjects import subject, subject_of_data
from unitcad.spec.raw import FORMATS, OUTPUTS, Format

LOCK = re.compile(r"\.[a-z0-9.-]+-[0-9a-f]{12}\.lock")
TRIES = 5
"""How often a result is made when content that it shares vanishes from the cache meanwhile."""


@dataclass(frozen=True)
class Built:
    """A built variant: its folder, its manifest, and the SHA-256 of manifest.json."""

    folder: Path
    manifest: Manifest
    sha256: str

    @property
    def ok(self) -> bool:
        """Whether every mould check passed, and every mesh rule that makes an error."""
        return not failed_codes(self.manifest)


class _Changed(Exception):
    """A folder whose content changed during the work."""


def build(
    of: object,
    out: Path = Path("out"),
    *,
    only: Sequence[str] = OUTPUTS,
    check: bool = True,
    say: Callable[[str], object] = lambda stage: None,
    store: Store | None = None,
) -> Built:
    """Build a spec, the loaded object of a room, or a subject into `out`/<slug>-<hash12>.

    `only` is a choice of OUTPUTS; without `check` mould checks and mesh checks are skipped. Formats and outputs that
    the folder has from before are made again. `say` gets the name of each stage.
    Raises Refusal or UnitcadError before anything is written; a failed check is no exception, see `Built.ok`.
    """
    wanted = subject(of)
    outputs = wanted.outputs(check_outputs(only))
    if any(os.path.lexists(path) and not path.is_dir() for path in (out, *out.parents)):
        raise files.in_the_way(out)
    folder, store = out / wanted.folder_name, store or MemoryStore()
    clear_leftovers(out)
    while True:
        there = earlier(folder, wanted)
        formats: tuple[Format, ...] = tuple(form for form in FORMATS if form in (*there.formats, *wanted.formats))
        every, checked = check_outputs((*outputs, *there.outputs)), check or there.checked
        with contextlib.suppress(_Changed):  # another build has put a result there: its outputs are made too
            maker = partial(make, wanted.with_formats(formats), every, checked)
            return write(folder, maker, store, say, unchanged=lambda there=there: earlier(folder, wanted) == there)


def write(
    folder: Path,
    maker: Callable[[Store, Progress], Product],
    store: Store,
    say: Callable[[str], object] = lambda stage: None,
    *,
    unchanged: Callable[[], bool] = lambda: True,
    scratch: Path | None = None,
) -> Built:
    """Put the product of `maker` into a folder, replacing its files; files that the new result lacks stay.

    `scratch`: see `placing`. Raises _Changed if the folder is not `unchanged` any more.
    """
    for left in reversed(range(TRIES)):
        if not left:
            store = MemoryStore()  # others clear the cache all the time
        progress, before = Progress(say), Counter(store.counts)
        try:
            product = maker(store, progress)
            progress("")
            timings = {
                "code": code_version(),
                "seconds": {stage: round(seconds, 4) for stage, seconds in progress.seconds.items()},
                "store": dict(sorted((store.counts - before).items())),
            }
            with placing(folder, scratch) if scratch else replacing(folder) as fresh:
                if not unchanged():
                    raise _Changed
                product.place(fresh, store)
                files.write_new(fresh / "timings.json", json_bytes(timings))
            return Built(folder, product.manifest, digest(product.own["manifest.json"]))
        except MissingContent:  # the cache is cleared meanwhile
            continue
    raise AssertionError


def earlier_formats(folder: Path, wanted: Subject, *, ours: bool = False) -> tuple[Format, ...]:
    """Return the formats that an existing result has. `ours`: it is known to be a result, perhaps damaged since.

    Raises UnitcadError for a folder that contains something else: no spec.toml of ours, or another spec.
    """
    expect_folder(folder)
    if not folder.exists():
        return ()
    file = folder / wanted.file
    if not file.is_file():
        if ours:
            return ()
        raise UnitcadError(f"{folder}: is not a result of unitcad (no {wanted.file}); choose another folder with -o")
    try:
        there = subject_of_data(read_toml(file, links=False))
    except UnitcadError as error:
        if ours:
            return ()
        raise UnitcadError(f"{folder}: its {wanted.file} can't be read ({error}); move the folder away") from None
    if there.hash != wanted.hash:
        other = f"{folder}: has the result of another {wanted.kind} ({wanted.file} differs)"
        raise UnitcadError(f"{other}; move it away or use -o")
    return there.formats


@dataclass(frozen=True)
class Earlier:
    """Content of an existing result, which a later build keeps up: formats, outputs, whether it was checked."""

    formats: tuple[Format, ...] = ()
    outputs: tuple[str, ...] = ()
    checked: bool = False


def earlier(folder: Path, wanted: Subject) -> Earlier:
    """Return the manifest of an existing folder. Raises UnitcadError if it is no result of this spec."""
    formats = earlier_formats(folder, wanted)
    try:
        manifest = read_json(folder / "manifest.json", links=False)
        outputs = tuple(name for name in manifest["outputs"] if isinstance(name, str))
        return Earlier(formats, outputs, all(entry["reason"] != UNCHECKED for entry in manifest["skipped"]))
    except (UnitcadError, KeyError, TypeError):
        return Earlier(formats)


def whole(folder: Path, *, hashes: bool = False) -> Manifest | None:
    """Return the manifest of a result that is whole, else None.

    A result is whole when its files are there with the sizes, with `hashes` the contents, that the manifest lists. A
    link counts as absent.
    """
    try:
        manifest = read_json(folder / "manifest.json", links=False)
        if any((folder / parent).is_symlink() for parent in {Path(path).parent for path in manifest["files"]}):
            return None
        for path, listed in manifest["files"].items():
            status = (folder / path).lstat()
            if not stat.S_ISREG(status.st_mode) or status.st_size != listed["bytes"]:
                return None
            if hashes and digest((folder / path).read_bytes()) != listed["sha256"]:
                return None
    except (OSError, UnitcadError, ValueError, KeyError, TypeError, AttributeError):
        return None
    return manifest


def sync(results: Iterable[Path]) -> None:
    """Bring the results' own files to the disk; shared files are on the disk since the cache wrote them.

    Raises OSError.
    """
    for result in results:
        for path in _own_files(result):
            handle = os.open(path, os.O_RDWR)
            try:
                os.fsync(handle)
            finally:
                os.close(handle)


def _own_files(folder: str | os.PathLike[str]) -> Iterator[str]:
    """Yield the regular files below a folder that no other folder shares."""
    with os.scandir(folder) as entries:
        for entry in entries:
            if entry.is_dir(follow_symlinks=False):
                yield from _own_files(entry.path)
            elif entry.is_file(follow_symlinks=False) and entry.stat(follow_symlinks=False).st_nlink == 1:
                yield entry.path


def hold_folder(folder: Path) -> contextlib.AbstractContextManager[None]:
    """Hold a lock on a result's folder, so that one process at a time changes it."""
    return cache.held(folder.parent / f".{folder.name}.lock")


@contextlib.contextmanager
def replacing(folder: Path) -> Iterator[Path]:
    """Yield a fresh folder that takes `folder`'s place when the block ends well; lock the place meanwhile.

    Files of the old result that the new one lacks are kept. An interruption at any point leaves the old result whole:
    at its place, or in a marked scratch folder from which the next run takes it back. Raises UnitcadError if a link
    or a file is in the folder's place.
    """
    expect_folder(folder)
    folder.parent.mkdir(parents=True, exist_ok=True)
    with hold_folder(folder), files.scratch(folder.parent, folder.name) as scratch:
        fresh, aside = scratch / files.NEW, scratch / files.OLD
        fresh.mkdir()
        try:
            yield fresh
            while not _in_place(fresh, folder):
                _keep_others(folder, fresh)
                shutil.rmtree(aside, ignore_errors=True)
                folder.rename(aside)
        except BaseException:
            _restore(aside, folder)
            raise


@contextlib.contextmanager
def placing(folder: Path, scratch: Path) -> Iterator[Path]:
    """Yield a fresh folder that takes `folder`'s place, as `replacing`; if it can, in the caller's `scratch`.

    One scratch folder then serves many results: ext4 looks at every inode that was removed lately before it gives out a
    new one, so removing three files for each result makes the files of all others slow.
    """
    if folder.exists():
        with replacing(folder) as fresh:
            yield fresh
        return
    fresh = scratch / folder.name
    fresh.mkdir()
    try:
        yield fresh
        if not _in_place(fresh, folder):
            with replacing(folder) as there:
                for path in fresh.iterdir():
                    path.rename(there / path.name)
    finally:
        shutil.rmtree(fresh, ignore_errors=True)


def _in_place(fresh: Path, folder: Path) -> bool:
    """Rename `fresh` to `folder`, or return False if a result is there. Raises OSError."""
    if folder.exists():
        return False
    try:
        fresh.rename(folder)
    except OSError:
        if folder.exists():  # another process has put it there meanwhile
            return False
        raise
    return True


def clear_leftovers(out: Path) -> None:
    """Remove half-written files of ended processes from `out`, and put back folders that they had moved aside.

    Only scratch folders that carry our mark are touched, and empty files of the name that a result's lock has.
    """
    for scratch, name in files.leftovers(out):
        if name:
            _restore(scratch / files.OLD, out / name)
        shutil.rmtree(scratch, ignore_errors=True)
    for path in out.glob(".*.lock"):
        with contextlib.suppress(OSError):  # it has been released meanwhile
            status = path.lstat()
            if LOCK.fullmatch(path.name) and stat.S_ISREG(status.st_mode) and not status.st_size:
                cache.is_free(path)


def expect_folder(folder: Path) -> None:
    """Raise UnitcadError if the place of a result is no real folder, so that nothing is written through a link."""
    with contextlib.suppress(FileNotFoundError, NotADirectoryError):
        mode = folder.lstat().st_mode  # once: another process may swap the folder at any time
        if not stat.S_ISDIR(mode):
            kind = "link" if stat.S_ISLNK(mode) else "file"
            raise UnitcadError(f"{folder}: is a {kind}, not a folder; remove it or choose another folder with -o")


def _restore(aside: Path, folder: Path) -> None:
    """Put back an old result that an interrupted swap left aside."""
    if aside.is_dir() and not aside.is_symlink() and not os.path.lexists(folder):
        aside.rename(folder)


def _keep_others(old: Path, new: Path) -> None:
    """Copy the files and links that the new folder lacks, but no folder over a file."""
    for here, below, names in os.walk(old):
        place = new / Path(here).relative_to(old)
        for name in (*below, *names):
            file, copy = Path(here, name), place / name
            if (file.is_file() or file.is_symlink()) and not os.path.lexists(copy):
                place.mkdir(parents=True, exist_ok=True)
                shutil.copy2(file, copy, follow_symlinks=False)
        below[:] = [name for name in below if not (place / name).is_file()]
