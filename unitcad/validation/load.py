"""From a TOML file, a template's name, plain data or another spec to a validated `Spec`."""

from __future__ import annotations

import copy
import os
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, TypeVar

from unitcad.designs import default_design
from unitcad.documents import line_of, parse_toml, read_toml
from unitcad.errors import Refusal, UnitcadError, UnknownKey, WrongArgument, unknown_name
from unitcad.files import read_text
from unitcad.rooms import FileKind, expect_none_but, file_kinds, of_other_kind
from unitcad.rooms import load as load_reference
from unitcad.spec import Spec, check_plain, to_data
from unitcad.spec.custom_code import is_body_file, is_custom, with_source
from unitcad.validation.defaults import resolved
from unitcad.validation.plain_data import ABSENT, Changes, Source, apply, at, changes_of, plain, requested_data
from unitcad.validation.suggestions import every_fault, suggest


def shipped_files(kind: str = "") -> dict[str, Path]:
    """Return the TOML files in the templates' folder, or in its folder `kind`, by name."""
    package = Path(str(files("unitcad")))
    folder = next((f for f in (package / "templates", package.parent / "templates") if f.is_dir()), package)
    return {file.stem: file for file in sorted((folder / kind).glob("*.toml"))}


def shipped_of(kind: FileKind) -> dict[str, Path]:
    """Return the shipped files of a kind by name."""
    return load_reference(kind.shipped)() if kind.shipped else shipped_files(kind.plural)


def is_path(text: str) -> bool:
    """Whether a text names a file by its path (a path separator in it, or .toml at its end), not by a bare name."""
    return os.sep in text or "/" in text or text.endswith(".toml")


def spell_path(text: str, known: Iterable[str]) -> str:
    """Return a text that names a file by its path, or one of `known`; for NAME of a file NAME.toml here, NAME.toml."""
    own = f"{text}.toml"
    return own if text not in known and not is_path(text) and os.path.isfile(own) else text


def expect_kind(data: Mapping[str, object], source: str, kind: str) -> None:
    """Raise WrongArgument for an empty file, and for one of another kind, with the command that takes it."""
    if not data:
        raise WrongArgument(kind, source, f"is empty; `unitcad schema {kind}` lists its keys")
    expect_none_but(kind, data, source, kind, WrongArgument)


def named_file(text: str, known: Mapping[str, Path], field: str, kind: type[Refusal] = Refusal) -> Path:
    """Return the file that a text names (`spell_path`), there or not. Raises `kind`, of that field, for other text."""
    text = spell_path(text, known)
    if text in known:
        return known[text]
    path = Path(text)
    if os.path.isdir(text):
        own = [file for file in (path / "spec.toml", path / "array.toml") if file.is_file()]
        raise kind(field, text, "is a folder; name a TOML file in it", str(own[0]) if own else None)
    if path.suffix != ".toml" and os.path.isfile(text) and (path.suffix or not is_path(text)):
        if is_body_file(text):
            raise kind(field, text, f'is a body: write design = "{text}" in a spec')
        raise kind(field, text, "is not a TOML file, whose name ends in .toml")
    if is_path(text) or path.suffix or not known:
        return path
    for other in file_kinds():
        if other.command and other.plural and text in shipped_of(other):
            raise of_other_kind(other, field, text, kind)
    raise unknown_name(field, text, known, kind)


T = TypeVar("T")


def load_file(source: str | os.PathLike[str], kind: str, judge: Callable[[dict[str, Any], Path], T]) -> T:
    """Return the result of `judge` for data and path of a TOML file of a kind: one by its path, or a shipped one.

    Raises Refusal with the file's other faults, each with file and line; WrongArgument for a file of another kind.
    """
    shipped = next(shipped_of(one) if one.plural else {} for one in file_kinds() if one.name == kind)
    path = named_file(os.fspath(source), shipped, kind, WrongArgument)
    data = read_toml(path)
    expect_kind(data, str(path), kind)
    try:
        return judge(data, path)
    except Refusal as first:
        sound = read_toml(next(iter(shipped.values()))) if shipped else {}
        every = every_fault(first, data, lambda data: judge(data, path), sound)
        text = read_text(path)
        for i, one in enumerate(every):
            if isinstance(one, UnknownKey):
                limit = one.limit.replace("`unitcad schema`", f"`unitcad schema {kind}`")
                every[i] = one = UnknownKey(one.field, one.value, limit, one.nearest, one.meant, one.root)
            one.file, one.line = os.fspath(path), line_of(text, one.field)
        every[0].others = tuple(every[1:])
        raise every[0] from None


def templates() -> dict[str, Path]:
    """Return the shipped templates.

    Returns
    -------
    dict of str to Path
        The TOML file of each template, by name.

    Examples
    --------
    >>> import unitcad
    >>> "encapsulating" in unitcad.templates()
    True
    """
    return shipped_files()


def custom_templates() -> dict[str, Path]:
    """Return the shipped specs of custom designs by name, such as custom/strap-lugs."""
    return {f"custom/{name}": file for name, file in shipped_files("custom").items()}


def every_template() -> dict[str, Path]:
    """Return the shipped files of everything that can be built, by name; a unit's name wins."""
    compounds = {name: path for kind in _compounds() for name, path in shipped_of(kind).items()}
    return compounds | custom_templates() | templates()


def _compounds() -> list[FileKind]:
    return [kind for kind in file_kinds() if kind.subject]


def compound_kind(source: object) -> FileKind | None:
    """Return the kind of compound that a name, a file or plain data means; None for a unit or an unreadable file."""
    if isinstance(source, Mapping):
        return next((kind for kind in _compounds() if all(key in source for key in kind.keys)), None)
    if not isinstance(source, str | os.PathLike):
        return None
    text = spell_path(os.fspath(source), every_template())
    if text in templates():
        return None
    if not is_path(text):
        return next((kind for kind in _compounds() if text in shipped_of(kind)), None)
    try:
        return compound_kind(read_toml(Path(text)))
    except (UnitcadError, OSError):
        return None


def confirm_known(name: str, field: str = "spec", kind: type[Refusal] = WrongArgument) -> str:
    """Return a name as `spell_path` does. Raises `kind`, of that field, if it names no template or file."""
    named_file(name, every_template(), field, kind)
    return spell_path(name, every_template())


def default_template() -> str:
    """Return the template to start from if none is named: the one with the default design's name."""
    return default_design().name


def load(source: Source, set: Changes = (), makeable: Callable[[Spec], object] | None = None) -> Spec:
    """Return the resolved spec of a template, a file, plain data, or another spec or variant.

    Parameters
    ----------
    source : str, path, dict, Spec or Variant
        Name of a template, path of a TOML file (with a path separator or ending in .toml), or a spec's data.
    set : dict or sequence of str, optional
        Changes by dotted path: ``{"layers.0.wall_mm": 1.2}`` or ``["layers.0.wall_mm=1.2"]``. Lengths in mm.
        Values that follow from others follow the changed ones.
    makeable : callable, optional
        Raises Refusal for a spec that can't be made. Suggested values then pass it too.

    Returns
    -------
    Spec
        The spec with every default written out.

    Raises
    ------
    Refusal
        For an invalid value: field, value, limit and nearest accepted value. Its ``others`` are the spec's further
        faults, each with ``file`` and ``line``.
    UnitcadError
        For a file that can't be read, and for a source of another type.

    Examples
    --------
    >>> import unitcad
    >>> spec = unitcad.load("encapsulating", set={"diameter_mm": 15})
    >>> spec.diameter_mm, spec.motor.thickness_mm
    (15.0, 2.0)
    """
    changes = changes_of(set)
    if kind := compound_kind(source):
        named = f"{os.fspath(source)} is" if isinstance(source, str | os.PathLike) else "this is"
        raise UnitcadError(f"{named} an {kind.name} of units, not the spec of one: unitcad.build makes it")
    if isinstance(source, str | os.PathLike):
        data = read(source)
    elif isinstance(source, Mapping):
        data = plain(source)
    else:
        spec = source if isinstance(source, Spec) else getattr(source, "spec", None)
        if not isinstance(spec, Spec):
            given = type(source).__name__
            raise UnitcadError(f"{given} is no spec: name a template or a file, or give a dict, a Spec or a Variant")
        if not changes and not makeable:
            return spec
        data = requested_data(spec, from_data)
    data = override(data, changes) if changes else data
    whole = with_source(data, Path())

    def settled(data: dict[str, Any]) -> Spec:
        spec = resolved(data)
        if makeable:
            makeable(spec)
        return spec

    try:
        return settled(whole)
    except Refusal as first:
        every = every_fault(first, whole, lambda data: to_data(settled(data)), sound_data(whole))
        raise _locate(every, data, source) from None


def from_tables(keys: Mapping[str, object]) -> Spec:
    """Return the resolved spec of a spec's keys, tables as their classes or as dicts: what calling `Spec` does.

    Raises as `from_data`.
    """
    return from_data(plain(keys), Path())


def read(source: str | os.PathLike[str]) -> dict[str, Any]:
    """Return the data of a spec file or template, not checked. Raises UnitcadError for a file that is no TOML.

    The code of a design that the file names may run from now on: see `unitcad.spec.custom_code`.
    """
    path = named_file(os.fspath(source), templates() | custom_templates(), "spec", WrongArgument)
    data = read_toml(path)
    expect_kind(data, str(path), "spec")
    return with_source(data, path.parent)


def override(data: Mapping[str, Any], changes: Changes) -> dict[str, Any]:
    """Return `data` with changes put in. Raises Refusal for a path that runs through something not there."""
    check_plain(data)
    result: dict[str, Any] = copy.deepcopy(dict(data))
    apply(result, changes_of(changes))
    return result


def from_data(data: Mapping[str, Any], folder: Path | None = None) -> Spec:
    """Return the validated, resolved `Spec` of plain data.

    `folder` is where the path of a custom design starts, whose file is then read and may run; without one no
    file is. Raises Refusal for the first fault; the value that it offers is accepted in that field.
    """
    plain = with_source(dict(data), folder) if folder else dict(data)
    try:
        return resolved(plain)
    except UnknownKey:
        raise
    except Refusal as refusal:
        raise suggest(refusal, plain, judge, sound_data(plain)) from None


def judge(data: dict[str, Any]) -> dict[str, Any]:
    """Return a spec's plain data, everything settled. Raises Refusal."""
    return to_data(resolved(data))


def sound_data(data: Mapping[str, Any]) -> dict[str, Any]:
    """Return the settled data of the template of a spec's design, or of the default one.

    No other design replaces one in a file: it would refuse values that the file's accepts.
    """
    design = data.get("design")
    sound = _template_data(design if isinstance(design, str) and design in templates() else default_template())
    return {key: value for key, value in sound.items() if key != "design" or not is_custom(design)}


@cache
def _template_data(name: str) -> dict[str, Any]:
    return judge(read_toml(templates()[name]))


def _locate(every: list[Refusal], data: dict[str, Any], source: Source) -> Refusal:
    """Return the first of a spec's faults with the others, each with its file and line if it is in one."""
    path = _file(source)
    if path is not None:
        text = read_text(path)
        written = parse_toml(text, os.fspath(path))
        for one in every:
            # What an option or a caller changed, or validation worked out, stands on no line.
            if one.value is None or _same(at(written, one.field), at(data, one.field)):
                one.file, one.line = os.fspath(path), line_of(text, one.field)
    every[0].others = tuple(every[1:])
    return every[0]


def _same(written: object, asked: object) -> bool:
    """Tell whether a file contains the given value; what is nested too deeply to be compared counts as the same."""
    try:
        return written is not ABSENT and written == asked
    except RecursionError:
        return True


def all_faults(first: Refusal, data: Mapping[str, Any], text: str) -> list[Refusal]:
    """Return every fault of a text's plain data, `first` among them, each with its line; no file is read for it."""
    every = every_fault(first, dict(data), judge, sound_data(data))
    for one in every:
        one.line = line_of(text, one.field)
    return every


def _file(source: Source) -> Path | None:
    """Return the file that a text names by its path."""
    known = every_template()
    text = spell_path(os.fspath(source), known) if isinstance(source, str | os.PathLike) else ""
    return Path(text) if is_path(text) and text not in known else None
