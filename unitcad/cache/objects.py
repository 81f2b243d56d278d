"""Named bytes in a folder or in a bucket of S3: read, write whole, make if absent, list."""

from __future__ import annotations

import contextlib
import os
import re
import uuid
from pathlib import Path
from typing import Any, Protocol

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
