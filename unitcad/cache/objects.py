"""Named bytes in a folder, or in an object store that fsspec knows: read, write whole, make if absent, list."""

from __future__ import annotations

import contextlib
import os
import re
import uuid
from pathlib import Path
from typing import Any, Protocol

from unitcad.errors import Missing, UnitcadError, WrongArgument, missing_extra
from unitcad.files import write_new

_IMPATIENT = {"s3": {"config_kwargs": {"connect_timeout": 5, "read_timeout": 60, "retries": {"max_attempts": 2}}}}
"""Options of file systems that else try for minutes to reach a server."""

_ALL = os.R_OK | os.W_OK | os.X_OK
_HALF = re.compile(r"([a-z][a-z0-9+.-]+):")


class Objects(Protocol):
    """A place for named bytes. Every method raises OSError where the place can't be reached, or refuses."""

    def get(self, name: str, start: int = 0, end: int | None = None) -> bytes:
        """Return an object, or its bytes from `start` to `end`. Raises FileNotFoundError."""
        ...

    def put(self, name: str, content: bytes) -> None:
        """Write an object whole, in place of what is there."""
        ...

    def create(self, name: str, content: bytes) -> bool:
        """Write an object whole if there is none of that name: of several writers one gets True."""
        ...

    def size(self, name: str) -> int | None:
        """Return an object's bytes; None where there is none."""
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


class FsspecObjects:
    """Objects of a file system of fsspec, such as an S3-compatible store. Its own settings say how it is reached.

    Where a file system can't make a file only if it is absent, the last of several writers at one moment wins.
    """

    def __init__(self, address: str) -> None:
        try:
            import fsspec
        except ImportError:
            raise missing_extra("store", f"--store {address}: needs fsspec") from None
        protocol = address.partition("://")[0]
        try:
            options = {"use_listings_cache": False, "skip_instance_cache": True, **_IMPATIENT.get(protocol, {})}
            self.fs: Any
            self.fs, self.root = fsspec.core.url_to_fs(address, **options)
        except ImportError as error:
            raise Missing(f"--store {address}: {error}") from None
        except OSError as error:
            raise UnitcadError(f"--store {address}: can't be reached ({error})") from None
        except (ValueError, TypeError) as error:
            raise UnitcadError(f"--store {address}: not an address of a store ({error})") from None

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
            except (NotImplementedError, ValueError, TypeError):
                if self.size(name) is not None:
                    return False
                self.put(name, content)
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
        start = len(self.fs._strip_protocol(self.root)) + 1
        return {path[start:]: info["size"] for path, info in found.items()}


def objects_at(address: str) -> Objects:
    """Return the objects at an address: a path, file://PATH, or what fsspec knows (s3://bucket/path).

    Raises UnitcadError for an address that is none, and Missing without the extra for it.
    """
    folder = _folder_of(address)
    return FsspecObjects(address) if folder is None else FolderObjects(Path(folder))


def absolute(address: str) -> str:
    """Return an address as every process may use it: that of a folder as its path from the root.

    Raises WrongArgument for half an address, such as s3:/bucket.
    """
    folder = _folder_of(address)
    if folder is None:
        return address
    if half := _HALF.match(folder):
        why = f"an address begins with {half[1]}://; a folder of that name is ./{folder}"
        raise WrongArgument("store", address, why, folder.replace(":", "://", 1).replace(":///", "://"))
    return str(Path(folder).absolute())


def _folder_of(address: str) -> str | None:
    """Return the folder of a path, file://PATH or local://PATH; None for what fsspec knows."""
    scheme, parted, path = address.partition("://")
    if not parted or len(scheme) == 1:
        return address
    return path if scheme in ("file", "local") else None


@contextlib.contextmanager
def _plain_errors():
    """Turn what a file system's library raises into OSError: each library has its own errors for a lost connection."""
    try:
        yield
    except (OSError, UnitcadError):
        raise
    except Exception as error:
        raise OSError(f"{type(error).__name__}: {error}") from error
