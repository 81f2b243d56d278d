"""Loaders: from a template's name, a file, plain data or a loaded object to the subject of a result."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from unitcad.documents import parse_json, read_toml
from unitcad.errors import UnitcadError
from unitcad.moulds.mould_set import MouldSet
from unitcad.pipeline.subject import Compound, Subject
from unitcad.pipeline.unit import Unit
from unitcad.rooms import FileKind, file_kinds, load
from unitcad.spec import Spec, from_json
from unitcad.validation import compound_kind, every_template, from_data
from unitcad.validation import load as load_spec
from unitcad.validation.load import spell_path
from unitcad.validation.plain_data import Changes, Source, changes_of
from unitcad.validation.suggestions import numbers


def compound(kind: FileKind) -> type[Compound]:
    """Return the class of a kind of file that describes several units."""
    return load(kind.subject)


def subject(of: object) -> Subject:
    """Return a spec, the loaded object of a room, or a subject itself, as the subject of a result."""
    if isinstance(of, Subject):
        return of
    if isinstance(of, Spec):
        return Unit(of)
    found = _made_of(of)
    if found is None:
        raise UnitcadError(f"{type(of).__name__} is nothing to build: give a Spec or an array")
    return found(of)


def _made_of(of: object) -> type[Compound] | None:
    """Return the class for the loaded object of a room; None for any other, without a look at the rooms."""
    if isinstance(of, str | os.PathLike | Mapping | Spec | MouldSet):
        return None
    known = (compound(kind) for kind in file_kinds() if kind.subject)
    return next((one for one in known if isinstance(of, one.of)), None)


def load_subject(source: Source | Any, changes: Changes = (), only: Sequence[str] = ()) -> Subject:
    """Load the subject of a template's name, a file, plain data or a loaded object.

    Raises Refusal or UnitcadError, also for a unit without moulds if `only` names an output that needs them.
    """
    kind = compound_kind(source)
    if found := compound(kind) if kind else _made_of(source):
        made: Subject = found.load(source, changes)
    else:
        moulded = {"moulds", "casting"} & set(only)
        made = Unit(load_spec(source, changes, makeable=(lambda spec: MouldSet(spec).plan) if moulded else None))
    made.given = _given(source, changes)
    return made


def _given(source: object, changes: Changes) -> frozenset[str]:
    """Return the paths of the numbers that a person gave, by a change or in data or a file of their own.

    Templates and the files of results do not count.
    """
    own: Mapping[str, Any] = source if isinstance(source, Mapping) else {}
    if isinstance(source, str | os.PathLike):
        text = spell_path(os.fspath(source), every_template())
        shipped = text in every_template() or (Path(text).parent / "manifest.json").exists()
        own = {} if shipped else read_toml(Path(text))
    return frozenset({*changes_of(changes), *(path for path, _ in numbers(own))})


def subject_of_data(data: Mapping[str, Any]) -> Subject:
    """Return the subject of plain data. Raises Refusal."""
    kind = compound_kind(data)
    return compound(kind).of_data(data) if kind else Unit(from_data(dict(data), Path()))


def subject_of_text(text: str) -> Subject:
    """Return the subject of `Subject.text`."""
    data = parse_json(text, "the subject")
    return subject_of_data(data) if compound_kind(data) else Unit(from_json(text))
