"""The protocol of a subject: what a result is made of. A unit is one; rooms define those of several units."""

from __future__ import annotations

import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Self

from unitcad import files
from unitcad.cache import Store
from unitcad.errors import Refusal
from unitcad.moulds.mould_set import MouldSet
from unitcad.pipeline.manifest import Manifest
from unitcad.pipeline.result import Progress, Result
from unitcad.spec import Spec
from unitcad.spec.raw import Format
from unitcad.validation.plain_data import Changes


class Subject(ABC):
    """A spec, or something made of several, as the source of a result.

    kind     its name in errors
    file     the file in a result's folder that makes the result again
    unit     the spec of the unit, of several units of the first
    hash     of everything but name and formats
    formats  the formats of the files
    given    paths of the values that a person gave: lengths among them count as measured
    """

    kind: ClassVar[str]
    file: ClassVar[str]
    unit: Spec
    name: str
    hash: str
    formats: tuple[Format, ...]
    given: frozenset[str] = frozenset()

    @property
    def folder_name(self) -> str:
        """Return <slug>-<hash12>, at most 63 characters; the hash covers neither name nor formats."""
        slug = re.sub(r"(?:(?!(?<=[0-9])\.[0-9])[^a-z0-9])+", "-", self.name.lower())  # 1.2 keeps its point
        slug = slug.strip("-")[:50].rstrip("-.") or "unit"
        slug = slug.replace(".", "-") if files.names_device(slug) else slug  # on Windows com1.5 is the device com1
        return f"{slug}-{self.hash[:12]}"

    @property
    @abstractmethod
    def moulds(self) -> MouldSet:
        """The bodies and tools that are made of it."""

    @property
    @abstractmethod
    def text(self) -> str:
        """A text from which `subject_of_text` makes the same."""

    @abstractmethod
    def toml(self) -> str:
        """Return the content of `file`."""

    @abstractmethod
    def key(self, only: Sequence[str], check: bool) -> str:
        """Return the key under which variants share their making."""

    @abstractmethod
    def outputs(self, only: Sequence[str]) -> tuple[str, ...]:
        """Return the outputs of `only` that this subject has. Raises Refusal if none is left."""

    @abstractmethod
    def with_formats(self, formats: Sequence[Format]) -> Self:
        """Return the same subject with other formats."""

    @abstractmethod
    def make(self, only: Sequence[str], check: bool, store: Store, progress: Progress) -> Result:
        """Make parts, files and findings of its outputs `only`, in memory and `store`. `make.make` completes them.

        Raises Refusal if the moulds can't be made, Unfinished if a check lacks memory or time.
        """

    @abstractmethod
    def summary(self, folder: Path, manifest: Manifest) -> Iterator[str]:
        """Yield the lines that a person reads at the end of a build, from the result's folder and manifest."""


class Compound(Subject):
    """A subject of several units, such as an array. A room names its class in the `FileKind` of its files."""

    of: ClassVar[type]
    """The class of the loaded objects that it is made of."""

    @abstractmethod
    def __init__(self, of: Any) -> None:
        """Make it of a loaded object."""

    @classmethod
    @abstractmethod
    def load(cls, source: Any, changes: Changes = ()) -> Self:
        """Load it from a template's name, a file, plain data or the loaded object. Raises Refusal or UnitcadError."""

    @classmethod
    @abstractmethod
    def of_data(cls, data: Mapping[str, Any]) -> Self:
        """Make it of plain data with whole specs of its units. Raises Refusal."""

    @classmethod
    @abstractmethod
    def read(cls, path: Path) -> dict[str, Any]:
        """Read a file as plain data with whole specs of its units. Raises Refusal or UnitcadError."""

    @staticmethod
    @abstractmethod
    def offered(refusal: Refusal, data: Mapping[str, Any]) -> Refusal:
        """Return the refusal of plain data with a nearest value that was tried and accepted."""

    @staticmethod
    @abstractmethod
    def write_page(folder: Path, warn: Callable[[str], None]) -> Path:
        """Write the page of a result's folder. Returns its path."""
