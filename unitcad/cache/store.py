"""The interface of a cache, and the store that lasts one build."""

from __future__ import annotations

import hashlib
import os
from collections import Counter
from collections.abc import Callable
from typing import Any, Protocol, TypeVar

from unitcad.errors import UnitcadError
from unitcad.files import write_new

T = TypeVar("T")


class MissingContent(UnitcadError):
    """Content that was collected or is damaged. The next request makes it again."""

    exit_code = 1


class Store(Protocol):
    """A cache as a build uses it."""

    counts: Counter[str]
    """"built" and "reused" entries, by kind ("data", "file")."""

    def data(self, key: str, make: Callable[[], T], *, intact: Callable[[T], bool] = lambda data: True) -> T:
        """Return the JSON data under `key`, made if they are missing, damaged, or not `intact`.

        The store keeps nothing if `make` raises.
        """
        ...

    def file(self, key: str, make: Callable[[], bytes]) -> str:
        """Return the SHA-256 (hex) of the file under `key`, its content made if need be."""
        ...

    def has(self, sha256: str) -> bool:
        """Tell whether that content is there and whole."""
        ...

    def size(self, sha256: str) -> int:
        """Return a content's bytes, by its SHA-256. Raises MissingContent."""
        ...

    def content(self, sha256: str) -> bytes:
        """Return content by its SHA-256. Raises MissingContent."""
        ...

    def place(self, sha256: str, target: str | os.PathLike[str]) -> None:
        """Put content at `target`, which does not exist yet. Raises MissingContent or OSError."""
        ...


class MemoryStore:
    """A store that lasts one build."""

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self.contents: dict[str, bytes] = {}
        self._data: dict[str, Any] = {}
        self._files: dict[str, str] = {}

    def data(self, key: str, make: Callable[[], T], *, intact: Callable[[T], bool] = lambda data: True) -> T:
        found: T | None = self._data.get(key)
        if found is None or not intact(found):
            found = self._data[key] = make()
            self.counts["data built"] += 1
        else:
            self.counts["data reused"] += 1
        return found

    def file(self, key: str, make: Callable[[], bytes]) -> str:
        known = key in self._files
        self.counts["file reused" if known else "file built"] += 1
        if not known:
            content = make()
            self._files[key] = digest(content)
            self.contents[self._files[key]] = content
        return self._files[key]

    def has(self, sha256: str) -> bool:
        return sha256 in self.contents

    def size(self, sha256: str) -> int:
        return len(self.content(sha256))

    def content(self, sha256: str) -> bytes:
        if sha256 not in self.contents:
            raise MissingContent(f"content {sha256[:12]} is not here")
        return self.contents[sha256]

    def place(self, sha256: str, target: str | os.PathLike[str]) -> None:
        write_new(target, self.content(sha256), sync=True)


def digest(content: bytes) -> str:
    """Return the SHA-256 in hex digits."""
    return hashlib.sha256(content).hexdigest()
