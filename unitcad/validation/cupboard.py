"""The cupboard: a file of what a person owns, and entries of the catalogue that are his own.

[at_hand]
materials = ["ecoflex-00-10", "our-blend"]
printer = "mine"
[materials.our-blend]
like = "ecoflex-00-10"
[printers.mine]
like = "fdm-0.4"
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

from msgspec import Meta, Struct

from unitcad import catalogue, files
from unitcad.catalogue import MaterialEntry, MotorEntry, PrinterEntry
from unitcad.catalogue.entries import between
from unitcad.designs import shipped as designs
from unitcad.documents import line_of, parse_toml, read_toml
from unitcad.errors import Refusal, UnitcadError, unknown_name
from unitcad.spec import convert
from unitcad.spec.raw import DEFAULT_MOTOR
from unitcad.text import toml_key

Name = Annotated[str, Meta(min_length=1, max_length=60)]


class AtHandTable(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Silicones, motors, printer and bench at hand."""

    materials: Annotated[
        Annotated[tuple[Name, ...], Meta(min_length=1, max_length=20)] | None,
        Meta(description="silicones at hand, by name; default: all shipped ones"),
    ] = None
    designs: Annotated[
        Annotated[tuple[Name, ...], Meta(min_length=1, max_length=10)] | None,
        Meta(description="designs to try, by name; default: all shipped ones"),
    ] = None
    motors: Annotated[tuple[Name, ...], Meta(min_length=1, max_length=10, description="motors at hand, by name")] = (
        DEFAULT_MOTOR,
    )
    printer: Annotated[Name, Meta(description="printer of the catalogue")] = "fdm-0.4"
    scale_g: Annotated[float, between(1e-6, 1000, "smallest step of the scale")] = 0.01
    cupboard: Annotated[str | None, Meta(description="file of what you own: a table at_hand, and own entries")] = None
    room_c: Annotated[float, between(5, 45, "temperature of the room")] = 23.0
    vacuum: Annotated[bool, Meta(description="whether a vacuum chamber is at hand")] = True


class Cupboard(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """What a person owns: the table `at_hand` of his targets, and own entries."""

    at_hand: AtHandTable = AtHandTable()
    materials: dict[str, MaterialEntry] = {}
    motors: dict[str, MotorEntry] = {}
    printers: dict[str, PrinterEntry] = {}


def cupboard_of(data: Mapping[str, Any]) -> Cupboard:
    """Return the cupboard of a file's data. Raises Refusal for the first fault, and for an unknown name."""
    if not data:
        raise Refusal("at_hand", None, "is required, or an entry of your own")
    cupboard = convert(data, Cupboard)
    check_at_hand(cupboard.at_hand, cupboard.materials, cupboard.motors, cupboard.printers)
    if cupboard.at_hand.cupboard is not None:
        raise Refusal("at_hand.cupboard", cupboard.at_hand.cupboard, "a cupboard names no other one")
    return cupboard


def read_cupboard(path: str | os.PathLike[str]) -> Cupboard:
    """Return the cupboard of a file. Raises Refusal with the fault's file and line, or UnitcadError."""
    return _read(path)[1]


def _read(path: str | os.PathLike[str]) -> tuple[dict[str, Any], Cupboard]:
    """Return the data of a cupboard's file, and the cupboard. Raises as `read_cupboard`."""
    data = read_toml(Path(path))
    try:
        return data, cupboard_of(data)
    except Refusal as fault:
        if fault.file is None:
            fault.file, fault.line = os.fspath(path), line_of(files.read_text(path), fault.field)
        raise


def held(path: str | os.PathLike[str]) -> dict[str, dict[str, Any]]:
    """Return the silicones, motors and printers that a cupboard holds, by kind and name, its own entries among them.

    A kind that its table `at_hand` does not name is the whole catalogue; of printers, own entries are all he has.
    Raises as `read_cupboard`.
    """
    data, cupboard = _read(path)
    given, at_hand = data.get("at_hand", {}), cupboard.at_hand
    printers = (at_hand.printer,) if "printer" in given else tuple(cupboard.printers)
    named = {"materials": at_hand.materials, "motors": at_hand.motors, "printers": printers}
    narrowed = {"materials": "materials" in given, "motors": "motors" in given, "printers": bool(printers)}
    found = dict[str, dict[str, Any]]()
    for kind, names in named.items():
        own = getattr(cupboard, kind)
        known: dict[str, Any] = getattr(catalogue, kind)(own)
        kept = {*(names or known), *own} if narrowed[kind] else {*known}
        found[kind] = {name: entry for name, entry in known.items() if name in kept}
    return found


def add_entry(path: Path, kind: str, name: str, table: str) -> None:
    """Add a table of TOML, the entry [kind.name], to a cupboard; what is in the file stays as it is.

    A missing file is made. The file is replaced as a whole. Raises Refusal if it has such an entry, and if it can't be
    read or would no longer be read.
    """
    before = files.read_text(path) if path.exists() else ""
    there = read_cupboard(path) if before.strip() else Cupboard()
    known = {**getattr(there, kind), **getattr(catalogue, kind)()}
    if name in known:
        whose = "the cupboard" if name in getattr(there, kind) else "the catalogue"
        free = next(f"{name}-{i}" for i in range(2, len(known) + 3) if f"{name}-{i}" not in known)
        raise Refusal(f"{kind}.{name}", None, f"is in {whose} already; choose another name", free)
    text = f"{before.rstrip()}\n\n" if before.strip() else ""
    text += f"[{kind}.{toml_key(name)}]\n{table.rstrip()}\n"
    try:
        cupboard_of(parse_toml(text, str(path)))
    except UnitcadError as error:
        raise UnitcadError(f"{path}: takes no entry {kind}.{name}: {error}") from None
    path.parent.mkdir(parents=True, exist_ok=True)
    files.write(path, text.encode())


def check_at_hand(
    at_hand: AtHandTable,
    materials: Mapping[str, MaterialEntry],
    motors: Mapping[str, MotorEntry],
    printers: Mapping[str, PrinterEntry],
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the silicones at hand and the designs to try. Raises Refusal for an unknown name, and for one twice."""
    names = _named("at_hand.materials", at_hand.materials, catalogue.materials(materials))
    chosen = _named("at_hand.designs", at_hand.designs, {n: d for n, d in designs().items() if d.passes is not None})
    _named("at_hand.motors", at_hand.motors, catalogue.motors(motors))
    _named("at_hand.printer", [at_hand.printer], catalogue.printers(printers))
    return names, chosen


def _named(field: str, given: Sequence[str] | None, known: Mapping[str, Any]) -> tuple[str, ...]:
    names = tuple(known) if given is None else tuple(given)
    for i, name in enumerate(names):
        at = field if field.endswith("printer") else f"{field}.{i}"
        if name not in known:
            raise unknown_name(at, name, known)
        if name in names[:i]:
            raise Refusal(at, name, "is given twice")
    return names
