"""Subjects of a build. A unit is one; rooms define those of several units.

A room names its `Compound` in the `FileKind` of its files. Its loaded object names it too, as the attribute `subject`.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Self

from unitcad.documents import parse_json
from unitcad.errors import Refusal
from unitcad.moulds.mould_set import MouldSet
from unitcad.pipeline.make import Subject
from unitcad.pipeline.manifest import Manifest
from unitcad.rooms import load
from unitcad.spec import Spec, from_json
from unitcad.validation import compound_kind, from_data
from unitcad.validation import load as load_spec
from unitcad.validation.plain_data import Changes, Source


class Compound(Subject):
    """A subject of several units, such as an array."""

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

    @staticmethod
    @abstractmethod
    def estimate(names: Sequence[str], sets: Sequence[str], hertz: float | None, details: bool, as_json: bool) -> None:
        """Print the estimate of one or several. `hertz`: the drive's frequency; None: the motor's. Raises Refusal."""

    @abstractmethod
    def summary(self, folder: Path, manifest: Manifest, given: Container[str] = ()) -> Iterator[str]:
        """Yield the lines that a person reads at the end of a build, from the result's folder and manifest.

        A length that is `given`, by its path, counts as measured.
        """


def subject(of: Any) -> Subject:
    """Return a spec, or the loaded object of a room, as the subject of a result."""
    return Subject(of) if isinstance(of, Spec) else load(of.subject)(of)


def load_subject(source: Source | Any, changes: Changes = (), only: Sequence[str] = ()) -> Subject:
    """Load the subject of a template's name, a file, plain data or a loaded object.

    Raises Refusal or UnitcadError, also for a unit without moulds if `only` names an output that needs them.
    """
    kind = compound_kind(source)
    named = kind.subject if kind else getattr(source, "subject", None)
    if named:
        return load(named).load(source, changes)
    moulded = {"moulds", "casting"} & set(only)
    return Subject(load_spec(source, changes, makeable=(lambda spec: MouldSet(spec).plan) if moulded else None))


def subject_of_data(data: Mapping[str, Any]) -> Subject:
    """Return the subject of plain data. Raises Refusal."""
    kind = compound_kind(data)
    return load(kind.subject).of_data(data) if kind else Subject(from_data(dict(data), Path()))


def subject_of_text(text: str) -> Subject:
    """Return the subject of `Subject.text`."""
    data = parse_json(text, "the subject")
    return subject_of_data(data) if compound_kind(data) else Subject(from_json(text))
