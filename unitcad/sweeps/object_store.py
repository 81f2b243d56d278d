"""Results of a batch in an object store: s3://bucket/prefix, for workers that share no disk.

<prefix>/<variant>/...     the files of a variant, its manifest.json last
<prefix>/variants.csv      the tables, the counts and the journal, copied when the batch ends

Credentials, region and endpoint are those of the environment (AWS_ACCESS_KEY_ID, AWS_REGION, AWS_ENDPOINT_URL ...).
"""

from __future__ import annotations

import fnmatch
import os
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from datetime import timedelta
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import msgspec

from unitcad import files
from unitcad.cache import digest
from unitcad.errors import UnitcadError
from unitcad.extras import missing_extra
from unitcad.json_text import parse_message

_ADDRESS = re.compile(r"s3://[a-z0-9][a-z0-9.-]+(?:/[^/\s]+)*/?")
MANIFEST = "manifest.json"


class _Listed(msgspec.Struct):
    """The files of a manifest."""

    files: dict[str, dict[str, Any]]


def is_address(out: object) -> bool:
    """Tell whether `out` names a place in an object store."""
    return isinstance(out, str) and "://" in out


def confirm_address(address: str) -> None:
    """Raise UnitcadError for another address than s3://bucket/prefix."""
    if not _ADDRESS.fullmatch(address):
        raise UnitcadError(f"-o {address}: takes a folder, or s3://bucket/prefix")


@cache
def object_store(address: str) -> ObjectStore:
    """Return the store of an address. Raises UnitcadError for another address than s3://, and without the extra."""
    confirm_address(address)
    return ObjectStore(address)


class ObjectStore:
    """A prefix in a bucket. Every method raises UnitcadError if the store refuses or does not answer."""

    def __init__(self, address: str) -> None:
        try:
            import obstore
            from obstore.store import from_url
        except ImportError:
            raise missing_extra("s3", f"-o {address} needs obstore") from None
        self.address, self._obstore = address.rstrip("/"), obstore
        plain = os.environ.get("AWS_ENDPOINT_URL", "").startswith("http://")  # as a server of the lab's own has it
        with self._telling():
            self._store: Any = from_url(
                self.address,
                client_options={"timeout": "60s", "connect_timeout": "5s", "allow_http": plain},
                retry_config={"max_retries": 3, "retry_timeout": timedelta(seconds=30)},
            )

    @cached_property
    def sizes(self) -> dict[str, int]:
        """The sizes of all objects by path, as they were when they were first asked for."""
        with self._telling():
            return {entry["path"]: entry["size"] for batch in self._obstore.list(self._store) for entry in batch}

    def has(self, folder: str, *, manifest: str = "", verify: bool = False) -> bool:
        """Tell whether a variant is there whole, since its manifest was written last.

        `verify` compares the SHA-256 of the manifest and of every file that it lists.
        """
        if f"{folder}/{MANIFEST}" not in self.sizes:
            return False
        if not verify:
            return True
        content = self.read(f"{folder}/{MANIFEST}")
        if content is None or digest(content) != manifest:
            return False
        listed = parse_message(content, _Listed, f"{folder}/{MANIFEST}").files
        contents = ((self.read(f"{folder}/{path}"), file["sha256"]) for path, file in listed.items())
        return all(content is not None and digest(content) == sha256 for content, sha256 in contents)

    def read(self, path: str) -> bytes | None:
        """Return an object's content; None if there is none."""
        with self._telling():
            try:
                return bytes(self._obstore.get(self._store, path).bytes())
            except FileNotFoundError:
                return None

    def put(self, path: str, content: bytes) -> None:
        """Write an object."""
        with self._telling():
            self._obstore.put(self._store, path, content)

    def put_folder(self, folder: Path) -> None:
        """Write the files of a variant's folder, its manifest last."""
        others = sorted(path for path in folder.rglob("*") if path.is_file() and path != folder / MANIFEST)
        for path in (*others, folder / MANIFEST):
            self.put(path.relative_to(folder.parent).as_posix(), path.read_bytes())

    def fetch(self, out: Path, pattern: str) -> None:
        """Copy the objects of this name into a folder that lacks them: another machine may have begun the batch."""
        for path in fnmatch.filter(self.sizes, pattern):
            if "/" not in path and not (out / path).exists():
                out.mkdir(parents=True, exist_ok=True)
                files.write(out / path, self.read(path) or b"")

    def put_files(self, paths: Iterable[Path]) -> None:
        """Write files by their names."""
        for path in paths:
            self.put(path.name, path.read_bytes())

    @contextmanager
    def _telling(self) -> Iterator[None]:
        """Make an error of the store one line."""
        try:
            yield
        except FileNotFoundError as error:
            raise UnitcadError(f"-o {self.address}: no such bucket or object: {_first_line(error)}") from None
        except (self._obstore.exceptions.BaseError, ValueError, OSError) as error:
            raise UnitcadError(f"-o {self.address}: {_first_line(error)}") from None


def _first_line(error: Exception) -> str:
    """Return the server's own words of an error, or the first line of obstore's."""
    if said := re.search(r"<Message>(.*?)</Message>", str(error), re.DOTALL):
        return " ".join(said[1].split())[:300]
    return " ".join(str(error).partition("\n")[0].split())[:300]
