"""Errors for users: one clear sentence each, which the command line prints before it exits with `exit_code`."""

from __future__ import annotations

import copyreg
import math
import re
from collections.abc import Iterable
from difflib import SequenceMatcher, get_close_matches

from unitcad.text import some, toml

NEAREST = "; nearest accepted: "
"""The words before the nearest accepted value in a refusal."""
UNIT_ALONE = "; --only unit makes only the unit"
"""How a refusal of moulds ends that leaves the unit possible."""


class UnitcadError(Exception):
    """A request that can't be met, or a lack of the machine. The command line prints it and exits with code 2.

    Examples
    --------
    >>> import unitcad
    >>> try:
    ...     unitcad.check()
    ... except unitcad.UnitcadError as error:
    ...     print(error)
    check needs a file, a folder or a glob
    """

    exit_code = 2

    def as_dict(self) -> dict[str, object]:
        """Return the error as JSON-ready data."""
        return {"message": str(self)}

    def __reduce__(self) -> tuple[object, ...]:
        """Unpickle as it was, for any arguments of the class."""
        return copyreg.__newobj__, (type(self), *self.args), self.__dict__  # type: ignore[attr-defined]


class Missing(UnitcadError):
    """A lack of this machine or installation: a library of an extra, a folder that only a clone has."""


class Unfinished(UnitcadError):
    """A check that ran out of memory or time. It is no verdict: nothing of it is kept, and another try may succeed."""

    exit_code = 1


class Refusal(UnitcadError):
    """A value that is refused.

    Parameters
    ----------
    field : str
        Dotted path of the value, such as ``layers.0.wall_mm``.
    value : object
        The refused value; None for a missing one.
    limit : str
        The limit that it breaks, in words.
    nearest : object, optional
        The nearest value that meets this limit.

    Attributes
    ----------
    file, line : str and int, or None
        Place of the value.
    others : tuple of Refusal
        Further faults of the same data.

    Examples
    --------
    >>> import unitcad
    >>> try:
    ...     unitcad.load("encapsulating", set={"diameter_mm": 3})
    ... except unitcad.Refusal as refusal:
    ...     print(refusal.field, refusal.value, refusal.nearest)
    diameter_mm 3.0 12.2
    """

    file: str | None = None
    line: int | None = None
    others: tuple[Refusal, ...] = ()

    def __init__(self, field: str, value: object, limit: str, nearest: object = None) -> None:
        self.field, self.value, self.limit, self.nearest = field, value, limit, nearest
        text = f"{field}: {limit}" if value is None else f"{field} = {format_value(value)}: {limit}"
        if nearest is not None:
            text += NEAREST + format_value(nearest)
        super().__init__(text)

    def as_dict(self) -> dict[str, object]:
        return {
            "message": str(self),
            "field": self.field,
            "value": _plain(self.value),
            "limit": self.limit,
            "nearest": _plain(self.nearest),
            **({} if self.file is None else {"file": self.file, "line": self.line}),
            **({"others": [other.as_dict() for other in self.others]} if self.others else {}),
        }

    @property
    def located(self) -> str:
        """The message after the file and the line of the value."""
        place = "" if self.file is None else f"{self.file}: " if self.line is None else f"{self.file}:{self.line}: "
        return f"{place}{self}"


class WrongArgument(Refusal):
    """A refusal of a function's argument: `field` is the parameter's name, for which the command line has an option."""


class UnknownKey(Refusal):
    """A key that its table does not have; `nearest` is the whole path of the closest one that it has.

    `meant`: every path that it may mean; `root`: its own path, if `field` goes on to the only value below it;
    `settled`: the limit says what to do, so nothing else is meant.
    """

    def __init__(
        self,
        field: str,
        value: object,
        limit: str,
        nearest: object = None,
        meant: tuple[str, ...] = (),
        root: str = "",
        settled: bool = False,
    ) -> None:
        super().__init__(field, value, limit, nearest)
        self.meant, self.root, self.settled = meant, root or field, settled

    def under(self, table: str) -> UnknownKey:
        """Return the same refusal of a table that is below another one, `table`; "" for none."""
        before = f"{table}." if table else ""
        limit = self.limit
        for path in sorted(self.meant, key=len, reverse=True):
            limit = re.sub(rf"(?<![\w.]){re.escape(path)}\b", before + path, limit)
        nearest = f"{before}{self.nearest}" if isinstance(self.nearest, str) else self.nearest
        meant = tuple(before + path for path in self.meant)
        return UnknownKey(before + self.field, self.value, limit, nearest, meant, before + self.root, self.settled)


def unknown_name(field: str, value: str, known: Iterable[str], kind: type[Refusal] = Refusal) -> Refusal:
    """Return a refusal, of class `kind`, of a name that is not in `known`, with the closest names that are."""
    known = sorted(known)
    folded = {name.lower(): name for name in known}
    within = [name for name in folded if len(value) >= _PART_OF_NAME and value.lower() in name]
    within.sort(key=lambda name: (-SequenceMatcher(None, value.lower(), name).ratio(), name))
    close = [folded[name] for name in get_close_matches(value.lower(), folded, n=3, cutoff=0.6)]
    close = [folded[name] for name in within] or close
    names = f"closest: {some(close, _MOST_NAMES)}" if close else f"known: {some(known)}"
    return kind(field, value, f"unknown name; {names}", close[0] if close else None)


def unknown_key(
    field: str,
    value: object,
    known: Iterable[str],
    lists: str = "",
    instead: str = "",
) -> UnknownKey:
    """Return a refusal of a key that no table has; `field` is its whole path, `known` the keys of that table.

    The limit names the most similar keys first, and the command `lists`, which prints all, if it omits any. `instead`:
    the key that took its place, or a sentence of what to do.
    """
    table, _, key = field.rpartition(".")
    known = list(known)
    if instead in known:
        path = f"{table}.{instead}" if table else instead
        return UnknownKey(field, value, f"unknown key; {instead} took its place", path, settled=True)
    if instead:
        return UnknownKey(field, value, f"unknown key; {instead}", settled=True)
    close = get_close_matches(key, known, n=len(known) or 1, cutoff=_ALIKE)
    # Among equals the table's first: bed_x_mm before bed_z_mm.
    best = max(
        (name for name in known if name in close),
        key=lambda name: SequenceMatcher(None, name, key).ratio(),
        default=None,
    )
    nearest = f"{table}.{best}" if table and best else best
    alike = sorted(known, key=lambda name: -SequenceMatcher(None, key, name).ratio())
    rest = f" ({lists} lists all)" if lists and len(known) > _MOST_KEYS + 1 else ""
    names = (
        f"closest: {', '.join(alike[: min(len(close), 3)])}"
        if close
        else f"known here: {some(alike, _MOST_KEYS)}{rest}"
    )
    return UnknownKey(field, value, f"unknown key; {names}", nearest)


def misfit(error: Exception) -> str:
    """Return the difference of data from this program's format, from msgspec's error."""
    # msgspec gives the place only in its sentence. For typed files `unitcad.spec.convert` walks the types
    # instead; here the data is this program's own, and a sentence that reads otherwise only loses its detail.
    message, _, place = str(error).partition(" - at `$")
    if (byte := re.search(r"byte (\d+)", message)) or not re.match("Expected|Object|Invalid", message):
        return f"it is not JSON{f' (byte {byte[1]})' if byte else ''}"
    place = place.rstrip("`").lstrip(".").replace("[...]", ".*") or "its top level"
    if key := re.search(r"(missing|unknown)[^`]*`([^`]*)`", message):
        return f"{place} {'lacks the' if key[1] == 'missing' else 'has an unknown'} key {key[2]!r}"
    return f"{place} has a value of the wrong kind"


def format_value(value: object) -> str:
    """Return a value as a refusal's sentence has it."""
    if isinstance(value, float):
        return f"{value:.6g}"
    plain = _plain(value)
    return repr(plain) if isinstance(value, str) else toml(plain) if isinstance(plain, bool) else str(plain)


def _plain(value: object) -> bool | int | float | str | None:
    """Return a value for JSON, shortened: long values and numbers that JSON lacks become text."""
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    if isinstance(value, int) and not isinstance(value, bool) and abs(value) >= 10**_LONGEST:
        return f"a number of about {round(value.bit_length() * math.log10(2))} digits"
    if value is None or isinstance(value, bool | int | float):
        return value
    text = value if isinstance(value, str) else _text(value)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}..."


def _text(value: object) -> str:
    try:
        return toml(value)
    except (ValueError, RecursionError):  # a number of thousands of digits in it, or it is deeply nested
        return f"a {type(value).__name__}"


_PART_OF_NAME, _MOST_NAMES = 4, 10
"""Characters of a text from which names that contain it are meant, and the number of these that are listed."""
_ALIKE = 0.65
"""Least likeness of a key with the one that is offered for it."""
_MOST_KEYS = 5
"""Keys of a table that are named for one that it does not have."""
_LONGEST = 200
"""Characters of a value that are shown."""
