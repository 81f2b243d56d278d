"""A store that several machines share: content by SHA-256, and entries by key, of which the first writer's stays.

    <address>/unitcad-store           marks the place as a store of unitcad
    <address>/content/ab/<sha256>     the bytes
    <address>/entries/ab/<key>        checksum, newline, JSON
    <address>/packs/ab/<sha256>       records of several variants in a row

All content is compared with its SHA-256 when it is read. Truncated content is read again.
"""

from __future__ import annotations

import contextlib
import errno
import json
import os
import re
import time
import uuid
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, Protocol, TypeVar

from unitcad.cache.store import MissingContent, digest
from unitcad.errors import UnitcadError, WrongArgument, missing_extra
from unitcad.files import write_new

S3 = "s3://"
_IMPATIENT = {"connect_timeout": 5, "read_timeout": 60, "retries": {"max_attempts": 2}}
"""Options of the S3 client, which otherwise tries for minutes to reach a server."""

_ALL = os.R_OK | os.W_OK | os.X_OK
_HALF = re.compile(r"([a-z][a-z0-9+.-]+):")


class Objects(Protocol):
    """A place for named bytes. Every method raises OSError if the place can't be reached, or refuses."""

    def get(self, name: str, start: int = 0, end: int | None = None) -> bytes:
        """Return an object, or its bytes from `start` to `end`. Raises FileNotFoundError."""
        ...

    def put(self, name: str, content: bytes) -> None:
        """Write an object whole, and replace an existing one."""
        ...

    def create(self, name: str, content: bytes) -> bool:
        """Write an object whole if there is none of that name: of several writers one gets True."""
        ...

    def size(self, name: str) -> int | None:
        """Return an object's bytes; None if there is none."""
        ...

    def sizes(self, below: str) -> dict[str, int]:
        """Return the bytes of all objects by their names, which start with the folder `below`."""
        ...


class FolderObjects:
    """Objects as files below a folder, on the disk when a write ends."""

    def __init__(self, root: Path) -> None:
        self.root = root

    def get(self, name: str, start: int = 0, end: int | None = None) -> bytes:
        with open(self.root / name, "rb") as file:
            file.seek(start)
            return file.read(-1 if end is None else end - start)

    def put(self, name: str, content: bytes) -> None:
        fresh = self._fresh(name, content)
        fresh.replace(self.root / name)

    def create(self, name: str, content: bytes) -> bool:
        if os.path.lexists(self.root / name):
            return False
        fresh = self._fresh(name, content)
        try:
            os.link(fresh, self.root / name)
        except FileExistsError:
            return False
        except OSError:  # no links here: the last writer wins, with the same bytes
            fresh.replace(self.root / name)
        finally:
            fresh.unlink(missing_ok=True)
        return True

    def size(self, name: str) -> int | None:
        with contextlib.suppress(FileNotFoundError, NotADirectoryError):
            return (self.root / name).stat().st_size
        return None

    def sizes(self, below: str) -> dict[str, int]:
        found = {}
        for here, _, names in os.walk(self.root / below):
            inside = Path(here).relative_to(self.root).as_posix()
            for name in names:
                with contextlib.suppress(FileNotFoundError):
                    found[f"{inside}/{name}"] = os.stat(os.path.join(here, name)).st_size
        return found

    def closed(self) -> Path | None:
        """Return the root or a folder right below it in which this process can't read and write; None without one."""
        below = [path for path in self.root.iterdir() if path.is_dir()] if os.access(self.root, _ALL) else []
        return next((path for path in (self.root, *below) if not os.access(path, _ALL)), None)

    def _fresh(self, name: str, content: bytes) -> Path:
        path = self.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        (self.root / "tmp").mkdir(exist_ok=True)
        fresh = self.root / "tmp" / uuid.uuid4().hex
        write_new(fresh, content, sync=True)
        return fresh


class S3Objects:
    """Objects of a bucket of S3 or of a compatible server, which s3fs finds by its settings and the environment."""

    def __init__(self, address: str) -> None:
        try:
            import s3fs
        except ImportError:
            raise missing_extra("store", f"--store {address}: needs s3fs") from None
        self.fs: Any = s3fs.S3FileSystem(use_listings_cache=False, skip_instance_cache=True, config_kwargs=_IMPATIENT)
        self.root = address.removeprefix(S3)

    def get(self, name: str, start: int = 0, end: int | None = None) -> bytes:
        with _plain_errors():
            if start or end is not None:
                return self.fs.cat_file(f"{self.root}/{name}", start=start, end=end)
            return self.fs.cat_file(f"{self.root}/{name}")

    def put(self, name: str, content: bytes) -> None:
        with _plain_errors():
            self.fs.pipe_file(f"{self.root}/{name}", content)

    def create(self, name: str, content: bytes) -> bool:
        with _plain_errors():
            try:
                self.fs.pipe_file(f"{self.root}/{name}", content, mode="create")
            except FileExistsError:
                return False
            return True

    def size(self, name: str) -> int | None:
        with _plain_errors():
            try:
                return self.fs.info(f"{self.root}/{name}")["size"]
            except FileNotFoundError:
                return None

    def sizes(self, below: str) -> dict[str, int]:
        with _plain_errors():
            found = self.fs.find(f"{self.root}/{below}", detail=True)
        start = len(self.root) + 1
        return {path[start:]: info["size"] for path, info in found.items()}


def objects_at(address: str) -> Objects:
    """Return the objects at an absolute address. Raises Missing without the extra for S3."""
    return S3Objects(address) if address.startswith(S3) else FolderObjects(Path(address))


def absolute(address: str) -> str:
    """Return the address of a store for every process: the path of a folder from the root, or s3://bucket/path.

    Raises WrongArgument for another kind of address.
    """
    scheme, parted, rest = address.partition("://")
    if not address or (parted and len(scheme) > 1 and (scheme != "s3" or not rest.strip("/"))):
        raise WrongArgument("store", address, "takes a folder, or a bucket of S3 such as s3://bucket/path", "store")
    if scheme == "s3" and parted:
        return address.rstrip("/")
    if half := _HALF.match(address):
        why = f"an address begins with {half[1]}://; a folder of that name is ./{address}"
        raise WrongArgument("store", address, why, address.replace(":", "://", 1).replace(":///", "://"))
    return str(Path(address).absolute())


@contextlib.contextmanager
def _plain_errors():
    """Turn the errors of a file system's library into OSError: libraries differ in them."""
    try:
        yield
    except (OSError, UnitcadError):
        raise
    except Exception as error:
        raise OSError(f"{type(error).__name__}: {error}") from error


T = TypeVar("T")
MARK = "unitcad-store"
_MARKED = b"unitcad keeps content and results of batches here\n"
TRIES = 4
"""How often a read or a write is tried, with pauses of PAUSE_S, twice that, and so on between."""
PAUSE_S = 0.2
_FINAL = (errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EISDIR)
_AT_ONCE = 8
"""Contents that are written at the same time."""


class SharedStore:
    """A store at an address that any number of processes on any number of machines use at once.

    `claim` makes the place a store, or refuses one with other contents. All methods raise OSError if the place can't be
    reached after TRIES tries.
    """

    def __init__(self, address: str) -> None:
        self.address = address
        self.objects = objects_at(address)
        self._there: set[str] = set()
        self._damaged: set[tuple[str, int]] = set()

    @property
    def in_folder(self) -> bool:
        """Whether it is a folder, which another machine may have of its own."""
        return isinstance(self.objects, FolderObjects)

    def claim(self) -> None:
        """Make the place a store. Raises UnitcadError if it can't be reached, or has other contents."""
        try:
            if _retry(lambda: self.objects.size(MARK), 2) is None:
                if isinstance(self.objects, FolderObjects) and self.objects.root.is_dir():
                    others = {path.name for path in self.objects.root.iterdir()} - {"tmp"}
                    if others and self.objects.size(MARK) is None:
                        raise UnitcadError(f"{self.address}: is not a store of unitcad, and not empty; choose another")
                _retry(lambda: self.objects.create(MARK, _MARKED), 2)
            if isinstance(self.objects, FolderObjects) and (closed := self.objects.closed()):
                raise UnitcadError(f"--store {self.address}: {closed} can't be read and written here")
        except (FileExistsError, NotADirectoryError):
            raise UnitcadError(f"{self.address}: is a file, not a folder; choose another for --store") from None
        except PermissionError:
            raise UnitcadError(f"--store {self.address}: can't be read and written here") from None
        except OSError as error:
            raise UnitcadError(f"--store {self.address}: can't be reached ({_line(error)})") from None

    def expect(self) -> None:
        """Raise UnitcadError if there is no store at the address, or it can't be reached."""
        try:
            if _retry(lambda: self.objects.size(MARK), 2) is None:
                raise UnitcadError(f"{self.address}: there is no store of unitcad")
        except OSError as error:
            raise UnitcadError(f"{self.address}: can't be reached ({_line(error)})") from None

    def keep(self, content: bytes, *, kind: str = "content", anew: bool = False) -> str:
        """Keep content; return its SHA-256 (hex). Existing content is not written again, unless `anew`."""
        sha256 = digest(content)
        name = _name(kind, sha256)
        if anew:
            _retry(lambda: self.objects.put(name, content))
            self._damaged.discard((name, 0))
        elif name not in self._there:
            _retry(lambda: self.objects.create(name, content))
        self._there.add(name)
        return sha256

    def size(self, sha256: str, kind: str = "content") -> int | None:
        """Return the stored bytes of a kind; None if there is nothing."""
        return _retry(lambda: self.objects.size(_name(kind, sha256)))

    def noted(self, sha256: str) -> bool:
        """Tell whether this process knows that content is there, without asking."""
        return _name("content", sha256) in self._there

    def note(self, sha256s: Iterable[str]) -> None:
        """Take it as known that contents are there."""
        self._there.update(_name("content", sha256) for sha256 in sha256s)

    def keep_all(self, contents: Iterable[bytes], *, anew: bool = False) -> None:
        """Keep several contents, some at the same time."""
        waiting = list(contents)
        if waiting:
            with ThreadPoolExecutor(_AT_ONCE) as pool:
                list(pool.map(lambda content: self.keep(content, anew=anew), waiting))

    def content(self, sha256: str) -> bytes:
        """Return content by its SHA-256. Raises MissingContent if it is not there, or damaged."""
        return self._whole(_name("content", sha256), lambda found: digest(found) == sha256)

    def part(self, pack: str, start: int, end: int, sha256: str) -> bytes:
        """Return the bytes of a pack from `start` to `end`, whose SHA-256 is known. Raises MissingContent."""
        return self._whole(_name("packs", pack), lambda found: digest(found) == sha256, start, end)

    def entry(self, key: str) -> Any:
        """Return the data under a key; None if there are none, or damaged ones."""
        try:
            found = self._whole(_name("entries", key), lambda found: _unpack(key, found) is not None)
        except MissingContent:
            return None
        return _unpack(key, found)

    def enter(self, key: str, data: Any, *, anew: bool = False) -> bool:
        """Write data under a key, if there are none: False if another writer was first. `anew` replaces them."""
        payload = json.dumps(data, ensure_ascii=False, allow_nan=False).encode()
        packed = digest(f"{key}\n".encode() + payload).encode() + b"\n" + payload
        name = _name("entries", key)
        if not anew and _retry(lambda: self.objects.create(name, packed)):
            return True
        if anew or self.entry(key) is None:  # the stored entry is damaged
            _retry(lambda: self.objects.put(name, packed))
            return True
        return False

    def sizes(self, kind: str) -> dict[str, int]:
        """Return the bytes of all that there is of a kind ("content", "packs") by SHA-256."""
        return {name.rpartition("/")[2]: size for name, size in _retry(lambda: self.objects.sizes(kind)).items()}

    def _whole(self, name: str, whole: Callable[[bytes], bool], start: int = 0, end: int | None = None) -> bytes:
        # Content that stayed damaged is read once from then on: many variants share a content.
        for left in reversed(range(1 if (name, start) in self._damaged else TRIES)):
            try:
                found = _retry(lambda: self.objects.get(name, start, end))
            except FileNotFoundError:
                break
            if whole(found):
                self._damaged.discard((name, start))
                return found
            if left:
                time.sleep(PAUSE_S * (TRIES - left))
            else:
                self._damaged.add((name, start))
        raise MissingContent(f"{name} is not in {self.address}, or damaged there")


def _retry(work: Callable[[], T], tries: int = TRIES) -> T:
    """Return what `work` returns, tried again after an OSError; MissingContent and a full store are not tried again."""
    for left in reversed(range(tries)):
        try:
            return work()
        except (FileNotFoundError, NotADirectoryError, PermissionError):
            raise
        except OSError as error:
            if not left or error.errno in _FINAL:
                raise
            time.sleep(PAUSE_S * (tries - left))
    raise AssertionError


def _name(kind: str, key: str) -> str:
    return f"{kind}/{key[:2]}/{key}"


def _unpack(key: str, packed: bytes) -> Any:
    checksum, _, payload = packed.partition(b"\n")
    return json.loads(payload) if digest(f"{key}\n".encode() + payload).encode() == checksum else None


def _line(error: BaseException) -> str:
    return " ".join(str(error).split()) or type(error).__name__
