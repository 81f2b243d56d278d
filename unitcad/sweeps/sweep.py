"""The sweep file: which specs, over which values. Variants are expanded one at a time.

base = "unit.toml"                        # a template, a spec file next to this one, or a list of them
name = "walls"                            # default: the file's name
[set]                                     # the same for every variant
"output.formats" = ["stl"]
[sweep]
mode = "product"                          # product | zip | cases
"layers.0.material" = ["ecoflex-00-10", "ecoflex-00-50"]
"layers.0.wall_mm" = { start = 1.0, stop = 2.0, num = 5 }
"""

from __future__ import annotations

import difflib
import json
import os
import re
import typing
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal, TypeVar, get_args

from msgspec import Meta, Struct, field, structs

from unitcad.cache import digest
from unitcad.catalogue.entries import between
from unitcad.documents import parse_json
from unitcad.errors import Refusal, UnitcadError, UnknownKey, format_value
from unitcad.files import names_device, read_text
from unitcad.pipeline.subject import Subject
from unitcad.pipeline.subjects import compound, subject_of_data
from unitcad.rooms import load
from unitcad.spec import Spec, check_plain, convert
from unitcad.spec.fields import alternatives, entry_in, fields_of, index_in, table_in
from unitcad.spec.paths import in_words, meant, paths_of
from unitcad.spec.raw import RawSpec
from unitcad.text import some
from unitcad.validation import Changes, compound_kind, confirm_known, every_template, override, read
from unitcad.validation.load import all_faults, is_path, load_file
from unitcad.validation.plain_data import apply, changes_of


def check_path(path: str, base: dict[str, Any], place: str = "sweep") -> None:
    """Refuse a path that no spec has, or that names a list entry which `base` (a spec's data) lacks.

    `place` is the table of the sweep file that has it. "layers.0.wall_mm", "estimate.frequency_hz" and whole tables
    ("fpcb", "layers") are paths.
    """
    kind: Any = _kind(base)
    node: Any = base
    steps = path.split(".")
    for i, step in enumerate(steps):
        table, entry = table_in(kind), entry_in(kind)
        if table is not None:
            if step not in fields_of(table):
                raise _unknown(path, base, place)
            kind = fields_of(table)[step].type
        elif entry is not None:
            there = node if isinstance(node, list) else []
            if index_in(step, len(there)) is None:
                has = (
                    f"they are 0 to {len(there) - 1}" if there[1:] else "its only one is 0" if there else "it is empty"
                )
                limit = f"the base has no entry {step} of {'.'.join(steps[:i])}: {has}"
                raise UnknownKey(f"{place}.{path}".lstrip("."), None, limit)
            kind = entry
        elif any(typing.get_origin(k) is dict or k is Any for k in alternatives(kind)):
            return
        else:
            raise _unknown(path, base, place)
        node = node[int(step)] if isinstance(node, list) else node.get(step) if isinstance(node, dict) else None


_LABEL = 36
"""Characters of a label at most: a folder's name has 50 before its hash."""
_UNIT = re.compile(r"_(mm|deg|percent|hz|um|c|g|pct|kpa|kg_m3)$")


def label(values: Mapping[str, Any]) -> str:
    """Return the swept values as a variant's name has them, such as wall1.2-cap1: keys without units.

    A word, such as the name of a silicone, has no key. Keys that end alike have their entry's number: wall1-1.2.
    """
    short = {path: _UNIT.sub("", path.rpartition(".")[2]).replace("_", "-") for path in values}
    often = Counter(short.values())
    parts: list[str] = []
    for path, value in values.items():
        key, entry = short[path], re.search(r"\.([0-9]+)\.[^.]*$", path)
        if often[key] > 1 and entry:
            key = f"{key}{int(entry[1]) + 1}-"
        if isinstance(value, str):
            parts.append(value)
        elif isinstance(value, bool):
            parts.append(f"{'' if value else 'no-'}{short[path]}")
        elif isinstance(value, int | float):
            parts.append(f"{key}{value:.6g}")
        elif isinstance(value, list) and all(isinstance(each, int | float) for each in value):
            parts.append(f"{key}{'x'.join(f'{each:g}' for each in value)}")
        elif isinstance(value, dict):
            parts.append(f"{key}-{label(value)}".rstrip("-"))
    return "-".join(parts)[:_LABEL].rstrip("-.")


def known_paths(base: dict[str, Any]) -> list[str]:
    """List every path of a spec like `base`, tables and values, in the models' order."""
    return [path for path, _ in paths_of(_kind(base), base)]


def _kind(base: dict[str, Any]) -> Any:
    kind = compound_kind(base)
    return load(kind.model) if kind else RawSpec


def _unknown(path: str, base: dict[str, Any], place: str) -> Refusal:
    field = f"{place}.{path}".lstrip(".")
    if several := meant(path, None, _kind(base), base):
        only = several[0] if len(several) == 1 else None
        return UnknownKey(field, None, "unknown key" if only else f"unknown key; known: {in_words(several)}", only)
    known = known_paths(base)
    begun = sorted((name for name in known if path and name.startswith(path)), key=len)
    close = begun or difflib.get_close_matches(path, known, n=1, cutoff=0.0)
    return UnknownKey(field, None, "unknown key", close[0] if close else None)


T = TypeVar("T", bound=Struct)
Mode = Literal["product", "zip", "cases"]
_KEYS = {
    "mode": {"enum": list(get_args(Mode)), "default": "product"},
    "cases": {"type": "array", "items": {"type": "object"}},
}
EXPLAINED = 20
"""Of so many variants, the first ones, every fault is looked for: a base's own faults are then all listed."""
MOST = 1_000_000
"""Variants that a sweep may have without --limit."""


class Range(Struct, frozen=True, forbid_unknown_fields=True):
    """`num` values from `start` to `stop`, both included."""

    start: Annotated[float, between(-1e12, 1e12)]
    stop: Annotated[float, between(-1e12, 1e12)]
    num: Annotated[int, between(1, 1_000_000_000)]

    def __len__(self) -> int:
        return self.num

    def __getitem__(self, index: int) -> float:
        if self.num == 1:
            return self.start
        # Rounded, so that a step of a tenth reads as one and the same value has the same folder in every sweep.
        return round(self.start + (self.stop - self.start) * index / (self.num - 1), 9)


Values = Sequence[Any] | Range


class SweepFile(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A sweep: which specs, over which values."""

    base: Annotated[
        str | Annotated[list[str], Meta(min_length=1)],
        Meta(description="a template, a spec or array file next to this one (./mine.toml), or a list of them"),
    ]
    name: Annotated[
        Annotated[str, Meta(min_length=1, max_length=60)] | None,
        Meta(description="a name of the sweep; default: that of the file"),
    ] = None
    fixed: Annotated[dict[str, Any], Meta(description="values by path, the same for every variant")] = field(
        name="set", default_factory=dict
    )
    sweep: Annotated[
        dict[str, Any],
        Meta(
            description="mode (product, zip or cases), and the values by path", extra_json_schema={"properties": _KEYS}
        ),
    ]


class SweepTable(Struct, frozen=True):
    """Keys of `sweep` that are no paths."""

    mode: Mode = "product"
    cases: tuple[dict[str, Any], ...] = ()


class CaseKeys(Struct, frozen=True):
    """Keys of a case that are no paths: its base if it is not the file's first one, a name for its folder."""

    base: str | None = None
    name: str | None = None


@dataclass(frozen=True)
class Sweep:
    """A validated sweep: the data of each base; `cases` as (base, value by path), or `axes` as values by path.

    `written` are the bases that come from a file; `fixed` the paths that the sweep, or an option, sets in every base.
    """

    name: str
    bases: dict[str, dict[str, Any]]
    mode: str
    axes: dict[str, Values]
    cases: tuple[tuple[str, dict[str, Any]], ...]
    written: Mapping[str, Path]
    fixed: tuple[str, ...]

    @property
    def slug(self) -> str:
        """Name of the batch's folder."""
        slug = re.sub(r"[^a-z0-9]+", "-", self.name.lower()).strip("-") or "batch"
        return f"{slug}-batch" if names_device(slug) else slug

    def overridden(self, set: Changes) -> Sweep:
        """Return the sweep with changes put into every base; swept values win. Raises Refusal."""
        changes = changes_of(set)
        if not changes:
            return self
        for path in changes:
            for data in self.bases.values():
                check_path(path, data, place="")
        bases = {name: override(data, changes) for name, data in self.bases.items()}
        return replace(self, bases=bases, fixed=(*self.fixed, *changes))

    @cached_property
    def count(self) -> int:
        """Number of variants."""
        if self.mode == "cases":
            return len(self.cases)
        per_base = 1
        for values in self.axes.values():
            per_base = per_base * len(values) if self.mode == "product" else max(per_base, len(values))
        return per_base * len(self.bases)

    @cached_property
    def paths(self) -> tuple[str, ...]:
        """Swept paths, in the file's order."""
        if self.mode == "cases":
            return tuple(dict.fromkeys(path for _, values in self.cases for path in values))
        return tuple(self.axes)

    @property
    def hash(self) -> str:
        """Hash over everything that decides which variants there are."""
        axes = [
            (path, structs.asdict(values) if isinstance(values, Range) else list(values))
            for path, values in self.axes.items()
        ]
        return digest(json.dumps([self.name, [*self.bases.items()], self.mode, axes, self.cases]).encode())

    def values(self, index: int) -> tuple[str, dict[str, Any]]:
        """Return (base, value by path) of variant `index`: the last axis runs fastest, the bases slowest."""
        if self.mode == "cases":
            return self.cases[index]
        per_base = self.count // len(self.bases)
        base, rest = divmod(index, per_base)
        chosen: dict[str, Any] = {}
        for path, values in reversed(self.axes.items()):
            if self.mode == "product":
                rest, here = divmod(rest, len(values))
            else:
                here = rest if len(values) > 1 else 0
            chosen[path] = values[here]
        return list(self.bases)[base], {path: chosen[path] for path in self.axes}

    def subject(self, index: int) -> Subject:
        """Return variant `index`, a unit or an array of units, everything settled. Raises Refusal."""
        return subject_of_data(self.data(index))

    def spec(self, index: int) -> Spec:
        """Return the resolved spec of variant `index`, of an array its unit's. Raises Refusal."""
        return self.subject(index).unit

    def faults(self, index: int, first: UnitcadError) -> str:
        """Return the faults of a refused variant in one line; `first` is its refusal."""
        kind = compound_kind(self.data(index))
        if isinstance(first, Refusal) and kind:
            if index < EXPLAINED:
                return str(compound(kind).offered(first, self.data(index)))
            return str(Refusal(first.field, first.value, first.limit))  # without an offer, which nobody tried
        if index >= EXPLAINED or not isinstance(first, Refusal):
            return str(first)
        base, values = self.values(index)
        file = self.written.get(base)
        text = read_text(file) if file else ""
        every = all_faults(first, self.data(index), text)
        for fault in every:
            if file and fault.field not in (*values, *self.fixed):
                fault.file = str(file)
        return "; and ".join(fault.located for fault in every)

    @property
    def of_compounds(self) -> bool:
        """Whether any base is built of several units, such as an array."""
        return any(map(compound_kind, self.bases.values()))

    def data(self, index: int) -> dict[str, Any]:
        """Return the plain data of variant `index`. Raises Refusal for a path that leads nowhere."""
        base, values = self.values(index)
        data = parse_json(self._texts[base], base)
        apply(data, values)
        swept = {path: value for path, value in values.items() if path not in self._alone}
        if "name" not in values and isinstance(data.get("name"), str) and (named := label(swept)):
            data["name"] = f"{data['name'][: 49 - len(named)]}-{named}"
        return data

    @cached_property
    def _alone(self) -> set[str]:
        """Paths of one value."""
        return {path for path, values in self.axes.items() if len(values) == 1}

    @cached_property
    def _texts(self) -> dict[str, str]:
        return {name: json.dumps(data) for name, data in self.bases.items()}


def load_sweep(source: str | os.PathLike[str]) -> Sweep:
    """Load a sweep.

    Parameters
    ----------
    source : str or path
        A file (a path separator or .toml in it), or the name of a shipped sweep.

    Returns
    -------
    Sweep

    Raises
    ------
    Refusal, UnitcadError
        For an unknown base or path, lists of unequal lengths in a zip, an empty sweep.

    Examples
    --------
    >>> from unitcad.sweeps import load_sweep
    >>> load_sweep("published").name
    'published'
    """
    return load_file(source, "sweep", lambda data, path: from_file(data, path.parent, path.stem))


def from_file(data: dict[str, Any], folder: Path, name: str) -> Sweep:
    """Return a validated sweep of a sweep file's data; its relative paths start at `folder`."""
    file = convert(data, SweepFile)
    table, values = _split(file.sweep, SweepTable, "sweep")
    typed = [_split(case, CaseKeys, f"sweep.cases.{i}") for i, case in enumerate(table.cases)]
    named = [file.base] if isinstance(file.base, str) else list(file.base)
    named += [case.base for case, _ in typed if case.base is not None]
    bases: dict[str, dict[str, Any]] = {}
    for base in dict.fromkeys(named):
        bases[base] = _read_base(base, folder)
        for path in file.fixed:
            check_path(path, bases[base], "set")
        apply(bases[base], file.fixed)
    axes = {path: _values(path, given, table.mode) for path, given in values.items()}
    cases = tuple(
        (case.base or named[0], {"name": case.name, **values} if case.name else values) for case, values in typed
    )
    _check_mode(table.mode, axes, cases)
    for base, values in cases or [(base, axes) for base in bases]:
        for path in values:
            check_path(path, bases[base])
    written = {base: folder / base for base in bases if is_path(base)}
    return Sweep(file.name or name, bases, table.mode, axes, cases, written, tuple(file.fixed))


def _split(data: dict[str, Any], kind: type[T], field: str) -> tuple[T, dict[str, Any]]:
    """Split a table into the keys that `kind` has and the other ones, which are paths of a spec."""
    own = fields_of(kind)
    return (
        convert({key: value for key, value in data.items() if key in own}, kind, field),
        {key: value for key, value in data.items() if key not in own},
    )


def _read_base(base: str, folder: Path) -> dict[str, Any]:
    place = folder / base if is_path(base) else base
    confirm_known(base, "base", Refusal)
    kind = compound_kind(place)
    data = compound(kind).read(every_template().get(base) or Path(place)) if kind else read(place)
    check_plain(data)
    return data


def _values(path: str, given: Any, mode: Mode) -> Values:
    """Return the values of an axis: a scalar or a table counts as one, a table with a range's keys as a range.

    In a product all differ. In a zip a value may repeat, combined with another value of another axis.
    """
    if isinstance(given, dict) and given.keys() & fields_of(Range).keys():
        given = convert(given, Range, f"sweep.{path}")
    values = given if isinstance(given, list | Range) else [given]
    if not len(values):
        raise Refusal(f"sweep.{path}", [], "an axis needs a value: the sweep is empty")
    if isinstance(values, Range):
        if values.num > 1 and values.start == values.stop:
            raise Refusal(f"sweep.{path}.num", values.num, "start and stop are the same value", 1)
        return values
    seen = [json.dumps(value) for value in values]
    counts = Counter(seen)
    if mode != "zip" and len(counts) < len(seen) and len(seen) <= 10_000:
        first: dict[str, Any] = {}
        for text, value in zip(seen, values, strict=True):
            first.setdefault(text, value)
        twice = next(value for value, text in zip(values, seen, strict=True) if counts[text] > 1)
        raise Refusal(
            f"sweep.{path}", values, f'has {format_value(twice)} twice; only mode = "zip" may repeat', [*first.values()]
        )
    return values


def _check_mode(mode: str, axes: dict[str, Values], cases: tuple[Any, ...]) -> None:
    if mode == "cases":
        if axes:
            raise Refusal("sweep", next(iter(axes)), "mode = cases takes its values from [[sweep.cases]] only")
        if not cases:
            raise Refusal("sweep.cases", [], "the sweep is empty: it needs a [[sweep.cases]] table or more")
        return
    if cases:
        raise Refusal("sweep.mode", mode, "[[sweep.cases]] goes with another mode", "cases")
    if not axes:
        raise Refusal("sweep", None, 'the sweep is empty: it needs a path with values, such as "diameter_mm"')
    lengths = {path: len(values) for path, values in axes.items() if len(values) > 1}
    if mode == "zip" and len(set(lengths.values())) > 1:
        counts = some(f"{path} has {count}" for path, count in lengths.items())
        raise Refusal("sweep.mode", "zip", f"the lists are of unequal lengths: {counts}")
