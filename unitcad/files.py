"""Reading of files that others may have written, and writing of whole files.

Reading refuses files that are not regular, before they are opened, and files that are too large. Writing goes to a
fresh file in a scratch folder of an unpredictable name, then renames: nothing is written through a link at the target
or at a temporary name, and the target is the old file or the new one, never half of it.
"""

from __future__ import annotations

import contextlib
import errno
import hashlib
import os
import re
import secrets
import shutil
import stat
import time
from collections.abc import Callable, Iterator, Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import IO

from unitcad.errors import UnitcadError

LARGEST = 16_000_000
"""Bytes that a spec, a sweep, a manifest or another file of one variant may have."""
LARGEST_TABLE = 256_000_000
"""Bytes that a batch's table may have."""
_PIECE = 1 << 20
TEMPORARY = ".tmp-"
MARK, LOCK = "unitcad-scratch", "unitcad-lock"
"""Files in every scratch folder: the mark has FORMAT, the folder's token, a name; its running maker has the lock.

They are two files, since nobody can read a locked file on Windows.
"""
FORMAT = "unitcad scratch 1"
_TOKEN = re.compile(re.escape(TEMPORARY) + "[0-9a-f]{16}")
OLD, NEW = "old", "new"
EMPTY_S = 60.0
"""After this time an empty scratch folder belongs to no process that is just making or removing it."""
_LOOKED_AT = 5000
"""Names of a folder that are compared with a missing one."""
_DEVICE = re.compile(r"con|prn|aux|nul|com[0-9]|lpt[0-9]", re.IGNORECASE)


class NotThere(UnitcadError):
    """A file that does not exist; printed with the most similar path that does."""

    def __init__(self, path: str | os.PathLike[str]) -> None:
        super().__init__(path)
        self.path = path

    def __str__(self) -> str:
        return f"{self.path}: {no_such_file(self.path)}"


def no_such_file(path: str | os.PathLike[str]) -> str:
    """Return the words for a missing file, with the most similar path that exists."""
    near = _similar(Path(path))
    return f"no such file{f'; closest: {near}' if near else ''}"


def _similar(path: Path) -> Path | None:
    """Return the existing path whose parts are most like those of a missing one; None if there is none."""
    folder = path.parent if path.parent.is_dir() else _similar(path.parent)
    try:
        near = get_close_matches(path.name, os.listdir(folder)[:_LOOKED_AT], n=1, cutoff=0.81) if folder else []
    except OSError:
        return None
    return folder / near[0] if folder and near else None


def read(path: str | os.PathLike[str], *, largest: int = LARGEST, links: bool = True) -> bytes:
    """Return the content of a regular file of at most `largest` bytes; without `links` a symbolic link is refused.

    Raises NotThere if there is no such file, UnitcadError for any other reason.
    """
    try:
        with open(path, "rb", opener=regular(links)) as file:
            content = file.read(largest + 1)
    except (FileNotFoundError, NotADirectoryError):
        raise NotThere(path) from None
    except OSError as error:
        raise UnitcadError(f"{path}: {(error.strerror or 'unreadable').lower()}") from None
    except ValueError:
        raise UnitcadError(f"{os.fspath(path)!r}: is no name for a file") from None
    if len(content) > largest:
        raise UnitcadError(f"{path}: is larger than {largest / 1e6:g} MB")
    return content


def read_text(path: str | os.PathLike[str], *, largest: int = LARGEST, links: bool = True) -> str:
    """Return the text of a file in UTF-8; else as `read`."""
    try:
        return read(path, largest=largest, links=links).decode("utf-8")
    except UnicodeDecodeError as error:
        raise UnitcadError(f"{path}: not UTF-8 (byte {error.start})") from None


def sha256(path: str | os.PathLike[str]) -> str:
    """Return the SHA-256 of a file of any size, read in pieces. Raises UnitcadError if it can't be read."""
    found = hashlib.sha256()
    try:
        with open(path, "rb", opener=regular()) as file:
            while piece := file.read(_PIECE):
                found.update(piece)
    except OSError as error:
        raise UnitcadError(f"{path}: {(error.strerror or 'unreadable').lower()}") from None
    return found.hexdigest()


def regular(links: bool = True) -> Callable[[str, int], int]:
    """Return an `opener` for `open` that opens or makes regular files only; without `links` no symbolic link.

    Raises UnitcadError for anything else, which is not opened.
    """

    def opened(path: str, flags: int) -> int:
        flags |= getattr(os, "O_CLOEXEC", 0) | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
        with contextlib.suppress(FileNotFoundError):
            _expect_regular(path, os.stat(path, follow_symlinks=links))
        try:
            handle = os.open(path, flags if links else flags | getattr(os, "O_NOFOLLOW", 0), 0o666)
        except OSError as error:
            if error.errno == errno.ELOOP and not links:
                raise UnitcadError(f"{path}: is a link, not a regular file") from None
            raise
        try:
            _expect_regular(path, os.fstat(handle))
        except BaseException:
            os.close(handle)
            raise
        return handle

    return opened


def in_the_way(folder: Path) -> UnitcadError:
    """Return the error for a folder that can't be made since it, or one above it, is a file."""
    above = (path for path in (*reversed(folder.parents), folder) if os.path.lexists(path) and not path.is_dir())
    file = next(above, folder)
    kind = "a file, not a folder" if file.exists() else "a link to a folder that is missing"
    return UnitcadError(f"{file}: is {kind}; choose another with -o")


def write(path: Path, content: bytes, *, sync: bool = False) -> None:
    """Write a file, replacing the one at `path`; with `sync` it is on the disk at the end. Raises OSError."""
    with writing(path, sync=sync) as file:
        file.write(content)


@contextlib.contextmanager
def writing(path: Path, *, sync: bool = False) -> Iterator[IO[bytes]]:
    """Open a new file that replaces what is at `path` when the block ends well, and is removed when it does not.

    With `sync` content and name are on the disk when the block has ended. Raises OSError, and UnitcadError for a
    device, a pipe or a folder at `path`, or behind a link there: root would replace /dev/null.
    """
    there = None
    with contextlib.suppress(OSError):
        there = os.stat(path)
    if there:
        _expect_regular(str(path), there)
    with scratch(path.parent) as folder:
        fresh = folder / NEW
        with open(fresh, "xb") as file:
            yield file
            if sync:
                _sync(file)
        fresh.replace(path)
    if sync:
        sync_folder(path.parent)


def replace_all(folder: Path, contents: Mapping[str, bytes], last: str) -> None:
    """Write files into a folder in place of those of a former run.

    All are written under another name first. The file `last` is removed before anything is changed and put in place
    at the end: it marks a whole result. Raises OSError.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with scratch(folder) as fresh:
        inside = fresh / NEW
        inside.mkdir()
        for name, content in contents.items():
            for where in (inside, folder):
                (where / name).parent.mkdir(parents=True, exist_ok=True)
            write_new(inside / name, content)
        (folder / last).unlink(missing_ok=True)
        for name in sorted(contents, key=lambda name: name == last):
            (inside / name).replace(folder / name)


def write_new(path: str | os.PathLike[str], content: bytes, *, sync: bool = False) -> None:
    """Make a file that is not there yet; none is left if that fails.

    Raises FileExistsError, also for a link, or OSError.
    """
    with open(path, "xb") as file:
        try:
            file.write(content)
            if sync:
                _sync(file)
            else:
                file.flush()
        except BaseException:
            with contextlib.suppress(OSError):
                file.close()
            with contextlib.suppress(FileNotFoundError):
                os.unlink(path)
            raise


def path_seen_from(path: str | os.PathLike[str], folder: str | os.PathLike[str] = ".") -> str:
    """Return a path as seen from a folder, with slashes; the whole path if that is on another drive of Windows."""
    try:
        return Path(os.path.relpath(path, folder)).as_posix()
    except ValueError:
        return Path(os.path.abspath(path)).as_posix()


def with_ending(path: Path, ending: str) -> str:
    """Return the name of a file nearest to a path that has an ending, such as ".svg"."""
    return str(path.with_suffix(ending) if path.name else path / f"file{ending}")


def names_device(name: str) -> bool:
    """Tell whether a file of this name would be a device on Windows, whatever its ending."""
    return _DEVICE.fullmatch(name.partition(".")[0].rstrip()) is not None


def sync_folder(folder: Path) -> None:
    """Bring a folder's names to the disk; nothing if the system can't. Raises OSError."""
    if os.name != "posix":
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


@contextlib.contextmanager
def scratch(parent: Path, name: str = "") -> Iterator[Path]:
    """Make a folder in `parent` with an unpredictable name and our mark inside, removed with the block.

    `name` is the entry of `parent` that the work is for; `leftovers` yields it with the folder of a killed process.
    """
    from filelock import FileLock, Timeout

    while True:
        token = secrets.token_hex(8)
        folder = parent / f"{TEMPORARY}{token}"
        try:
            folder.mkdir(0o700)
        except OSError as error:
            error.filename = str(parent)  # the name that the user knows
            raise
        lock = FileLock(folder / LOCK, thread_local=False)
        with contextlib.suppress(Timeout):  # another process takes the folder for a leftover and removes it
            lock.acquire(blocking=False)
            break
    try:
        write_new(folder / MARK, f"{FORMAT}\n{token}\n{name}\n".encode())
        yield folder
    finally:
        with contextlib.suppress(OSError):  # all but the lock, the mark last
            for path in sorted({*folder.iterdir()} - {folder / LOCK}, key=lambda path: path.name == MARK):
                shutil.rmtree(path, ignore_errors=True) if path.is_dir() else path.unlink()
        lock.release()
        with contextlib.suppress(OSError):  # `leftovers` of another process may remove it at the same time
            (folder / LOCK).unlink(missing_ok=True)
            folder.rmdir()


def leftovers(parent: Path) -> Iterator[tuple[Path, str]]:
    """Yield the scratch folders in `parent` whose process is gone, each with its name, locked meanwhile.

    Only real folders with our mark and their own token inside are yielded, and those without a mark that contain an
    empty lock, or nothing for EMPTY_S: their process ended before it wrote the mark, or after it had removed it.
    """
    from filelock import FileLock

    for folder in sorted(parent.glob(f"{TEMPORARY}*")):
        name = _marked(folder)
        if name is None:
            continue
        lock = FileLock(folder / LOCK, thread_local=False)
        try:
            lock.acquire(blocking=False)
        except OSError:  # it is held (Timeout is an OSError), or can't be
            continue
        try:
            if _marked(folder) in (name, ""):  # its process may have ended meanwhile
                yield folder, name
        finally:
            lock.release()


def _marked(folder: Path) -> str | None:
    """Return the name in a scratch folder's mark; None for a folder that is not ours."""
    try:
        if not stat.S_ISDIR(folder.lstat().st_mode):
            return None
        if _TOKEN.fullmatch(folder.name):
            inside = [(entry.name, entry.lstat().st_size) for entry in folder.iterdir()]
            if inside == [(LOCK, 0)] or (not inside and time.time() - folder.lstat().st_mtime > EMPTY_S):
                return ""
        form, token, name, rest = read_text(folder / MARK, largest=1000, links=False).split("\n")
    except (UnitcadError, ValueError, OSError):
        return None
    plain = name in ("", os.path.basename(name)) and name not in (".", "..") and "\\" not in name
    return name if form == FORMAT and folder.name == f"{TEMPORARY}{token}" and plain and not rest else None


def _expect_regular(path: str, status: os.stat_result) -> None:
    if stat.S_ISREG(status.st_mode):
        return
    kinds = {stat.S_IFLNK: "a link", stat.S_IFDIR: "a folder", stat.S_IFIFO: "a pipe", stat.S_IFSOCK: "a socket"}
    raise UnitcadError(f"{path}: is {kinds.get(stat.S_IFMT(status.st_mode), 'a device')}, not a regular file")


def _sync(file: IO[bytes]) -> None:
    file.flush()
    os.fsync(file.fileno())
