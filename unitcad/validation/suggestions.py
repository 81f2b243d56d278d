"""Every fault of plain data, each with a suggestion that was tried: a value that is accepted in its place.

Validation stops at the first fault. To find the next one, another value takes its place: the nearest accepted one, or
that of a sound file of the same kind. A fault counts if its value is as it was typed.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import islice
from typing import Any, TypeGuard

from unitcad.errors import Refusal, UnitcadError, UnknownKey, format_value
from unitcad.text import number
from unitcad.validation.plain_data import ABSENT, at, drop, put

Judge = Callable[[dict[str, Any]], object]
"""Validates plain data and may return it settled, as a mapping; raises Refusal for the first fault."""
Changes = Mapping[str, object]
"""Values by their paths; None takes a key out."""
MOST = 20
"""Faults that are looked for, at most."""
_MOST_CHANGES = 8
"""Values that are put in, one after the other, until data are accepted."""
_MOST_OTHERS = 12
"""Other keys that are tried in place of a refused one."""
_SIZES = (1 / 4, 1 / 16, 1 / 64, 4, 16, 64)
"""Factors on a refused number of which no sound file has another value, such as a parameter of a custom design."""
_HALVINGS = 60
_FINEST = 1e-7
"""Two numbers so near to each other, for their size, are one."""


def with_changes(data: Mapping[str, Any], changes: Changes) -> dict[str, Any]:
    """Return a copy of data after changes. Raises Refusal for a path that leads nowhere."""
    changed = copy.deepcopy(dict(data))
    for path, value in changes.items():
        if value is None:
            drop(changed, path)
        else:
            put(changed, path, value)
    return changed


def find_refusal(data: Mapping[str, Any], changes: Changes, judge: Judge) -> Refusal | None:
    """Return why data are refused after changes; None if they are accepted."""
    try:
        judge(with_changes(data, changes))
    except Refusal as refusal:
        return refusal
    except UnitcadError as error:
        return Refusal("", None, str(error))
    return None


def follow(refusal: Refusal, data: Mapping[str, Any], judge: Judge) -> tuple[dict[str, object], list[Refusal]]:
    """Put in the value that a refusal offers, then the one that the next refusal offers, and so on.

    Returns the changes with which data are accepted, {} if none are found, and the refusals on the way.
    """
    changes: dict[str, object] = {}
    met = [refusal]
    for _ in range(_MOST_CHANGES):
        last = met[-1]
        if last.nearest is None or isinstance(last, UnknownKey) or changes.get(last.field) == last.nearest:
            break
        changes[last.field] = last.nearest
        after = find_refusal(data, changes, judge)
        if after is None:
            return changes, met
        met.append(after)
    return {}, met


def nearest_number(data: Mapping[str, Any], path: str, good: float, bad: float, judge: Judge) -> float:
    """Return the accepted number nearest to a refused one, on the way from an accepted one; a short one if it can."""

    def taken(value: float) -> bool:
        return find_refusal(data, {path: value}, judge) is None

    whole = isinstance(good, int) and isinstance(bad, int) and not taken(good + (bad > good) - 0.5)
    low, high = good, bad
    for _ in range(_HALVINGS):
        if abs(high - low) <= (1 if whole else _FINEST * max(1.0, abs(low))):
            break
        middle = (low + high) // 2 if whole else (low + high) / 2
        low, high = (middle, high) if taken(middle) else (low, middle)
    if whole:
        return low
    least, most = sorted((good, bad))
    rounded = (round(low + shift, digits) for digits in (2, 3, 4) for shift in (0.0, -(10.0**-digits), 10.0**-digits))
    return next((value for value in rounded if least <= value <= most and taken(value)), low)


def suggest(refusal: Refusal, data: Mapping[str, Any], judge: Judge, sound: Mapping[str, Any]) -> Refusal:
    """Return the first refusal of data with a suggestion, whatever further faults the data have.

    `sound` is the data of a file without faults.
    """
    if isinstance(refusal, UnknownKey) or _does(refusal, data, judge):
        return refusal
    return next(one for one in every_fault(refusal, data, judge, sound) if one.field == refusal.field)


_SEARCHED = 2_000
"""Entries of data whose faults are all looked for: each is read a hundred times. A spec has some fifty."""


def _entries(data: object) -> int:
    """Return how many entries the tables and lists of data have."""
    values = data.values() if isinstance(data, Mapping) else data if isinstance(data, list | tuple) else ()
    return sum(1 + _entries(value) for value in values)


def every_fault(first: Refusal, data: Mapping[str, Any], judge: Judge, sound: Mapping[str, Any]) -> list[Refusal]:
    """Return the faults of data, `first` among them, the one that was met. `sound`: see `suggest`."""
    if _entries(data) > _SEARCHED:
        return [first]
    try:
        every = faults(data, judge, sound)
    except RecursionError:  # nested too deeply to be looked through again
        return [first]
    if any(one.field == first.field for one in every):
        return every
    return [suggest_value(first, data, judge, sound, not every), *every]


def faults(data: Mapping[str, Any], judge: Judge, sound: Mapping[str, Any]) -> list[Refusal]:
    """Return the faults of data, in the order in which they are met, each with a suggestion for when the others are
    gone. `sound`: see `suggest`.
    """
    typed: list[tuple[Refusal, Changes]] = []
    renamed, guessed = False, tuple[str, ...]()
    for refusal, passed in _refusals(data, judge, sound):
        missing, word = refusal.value is None, passed.get(refusal.field)
        # Another word, as of a kind, makes other keys necessary, or unknown.
        derived = (renamed and missing and refusal.nearest is not None) or (
            refusal.field.startswith(guessed) and (missing or isinstance(refusal, UnknownKey))
        )
        if not typed or (_is_wrong_by_itself(refusal, data, judge, sound) and not derived):
            typed.append((refusal, passed))
        if isinstance(refusal.value, str) and isinstance(word, str):
            renamed = True
            if word != refusal.nearest:
                guessed += (refusal.field.rpartition(".")[0],)
    if len(typed) > 1 and (culprit := culprit_of(data, judge, sound)):
        first = typed[0][0]
        if first.field in culprit:
            return [Refusal(first.field, first.value, first.limit, culprit[first.field])]
        return [Refusal(first.field, first.value, f"{first.limit}; {write_changes(culprit, 'and')} would do")]
    every = []
    for refusal, _ in typed:
        others = {path: value for other, passed in typed if other is not refusal for path, value in passed.items()}
        rest = with_changes(data, others)
        every.append(suggest_value(refusal, rest, judge, sound, len(typed) == 1))
    return every if len(every) < 2 else _accepted_together(every, typed, data, judge)


def _accepted_together(
    every: list[Refusal], typed: Sequence[tuple[Refusal, Changes]], data: Mapping[str, Any], judge: Judge
) -> list[Refusal]:
    """Return faults whose suggestions are accepted together, if there are any such."""
    passes = {path: value for _, passed in typed for path, value in passed.items()}
    offers = {one.field: one.nearest for one in every if not isinstance(one, UnknownKey) and one.nearest is not None}
    if find_refusal(data, {**passes, **offers}, judge) is None or find_refusal(data, passes, judge) is not None:
        return every
    return [
        one
        if isinstance(one, UnknownKey) or passes.get(one.field) is None
        else Refusal(one.field, one.value, refusal.limit, passes[one.field])
        for one, (refusal, _) in zip(every, typed, strict=True)
    ]


def write_changes(changes: Changes, word: str) -> str:
    """Write changes as a person types them."""
    texts = [
        f"no {path}"
        if value is None
        else f"{path} = {number(value, 6) if isinstance(value, float) else format_value(value)}"
        for path, value in changes.items()
    ]
    return f" {word} ".join(texts)


def is_number(value: object) -> TypeGuard[float]:
    """Tell whether a value is a number that a file can have."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < 1e300


def _does(refusal: Refusal, data: Mapping[str, Any], judge: Judge) -> bool:
    """Tell whether data are accepted with the value that a refusal offers."""
    return refusal.nearest is not None and find_refusal(data, {refusal.field: refusal.nearest}, judge) is None


def suggest_value(
    refusal: Refusal, data: Mapping[str, Any], judge: Judge, sound: Mapping[str, Any], alone: bool = True
) -> Refusal:
    """Return the only fault of data with a suggestion: another value, another key, or several together.

    `alone`: the file had no other fault. Only then is the blame looked for in other keys, which takes many trials.
    """
    if isinstance(refusal, UnknownKey):
        return _with_value(refusal, data, judge)
    if _does(refusal, data, judge):
        return refusal
    field, value, limit = refusal.field, refusal.value, refusal.limit
    together, met = follow(refusal, data, judge)
    own = [one for one in met if one.field == field]
    if own[-1].limit != limit:
        limit = f"{limit}, and {own[-1].limit}"
    if set(together) == {field}:
        return Refusal(field, value, limit, together[field])
    bad = next((one for one in (own[-1].nearest, value) if is_number(one)), None)
    if bad is not None:
        for good in good_numbers(data, field, judge, sound):
            if own[-1].nearest is not None and met[-1] is not own[-1]:
                limit = f"{limit}; at {format_value(bad)}, {bare(met[met.index(own[-1]) + 1])}"
            return Refusal(field, value, limit, nearest_number(data, field, good, bad, judge))
    if alone and (culprit := culprit_of(data, judge, sound)):
        return Refusal(field, value, f"{limit}; {write_changes(culprit, 'and')} would do")
    if field in together:
        rest = {path: other for path, other in together.items() if path != field}
        limit = f"{limit}; the value offered here also needs {write_changes(rest, 'and')}"
        return Refusal(field, value, limit, together[field])
    return Refusal(field, value, limit)


def _with_value(refusal: UnknownKey, data: Mapping[str, Any], judge: Judge) -> UnknownKey:
    """Return the refusal of a key that may mean others with what its value would be there, if it is not taken."""
    if not refusal.meant or at(data, refusal.field) is ABSENT:
        return refusal
    path = refusal.meant[0]
    after = find_refusal(data, {refusal.root: None, path: refusal.value}, judge)
    if after is None or after.field != path:
        return refusal
    there = bare(after) if after.nearest is None or isinstance(after.nearest, str) else f"{path} = {after.nearest}"
    limit = f"{refusal.limit}; {there}"
    return UnknownKey(refusal.field, refusal.value, limit, refusal.nearest, refusal.meant, refusal.root)


def culprit_of(data: Mapping[str, Any], judge: Judge, sound: Mapping[str, Any]) -> dict[str, object]:
    """Return another value for the one key that is to blame: with it data are accepted; {} if there is none."""
    unusual = ((path, given) for path, given in numbers(data) if given != at(sound, path))
    for path, given in islice(unusual, _MOST_OTHERS):
        for good in good_numbers(data, path, judge, sound):
            return {path: nearest_number(data, path, good, given, judge)}
    return {}


def bare(refusal: Refusal) -> str:
    """Write a refusal without its suggestion."""
    return str(Refusal(refusal.field, refusal.value, refusal.limit))


def good_numbers(data: Mapping[str, Any], path: str, judge: Judge, sound: Mapping[str, Any]) -> Iterator[float]:
    """Yield an accepted number for a path: the sound file's, the default, or for a key of neither one of other size."""
    known, given = at(sound, path), at(data, path)
    changes = [{path: known}, {path: None}]
    if known is ABSENT and is_number(given):
        changes = [{path: None}, *({path: given * size} for size in _SIZES)]
    for change in changes:
        if change[path] is not None and not is_number(change[path]):
            continue
        try:
            settled = judge(with_changes(data, change))
        except UnitcadError:
            continue
        good = change[path] if change[path] is not None else at(settled, path) if isinstance(settled, Mapping) else None
        if is_number(good):
            yield good


def numbers(node: object, path: str = "") -> Iterator[tuple[str, float]]:
    """Yield the numbers in data by their paths."""
    entries: Iterable[tuple[object, object]] = ()
    if isinstance(node, Mapping):
        entries = node.items()
    elif isinstance(node, list | tuple):
        entries = enumerate(node)
    for key, value in entries:
        below = f"{path}.{key}" if path else str(key)
        if is_number(value):
            yield below, value
        else:
            yield from numbers(value, below)


def _is_typed(refusal: Refusal, data: Mapping[str, Any]) -> bool:
    """Tell whether a refused value is as it was typed, or a key is missing."""
    there = at(data, refusal.field)
    if refusal.value is None and there is ABSENT:
        return True
    return isinstance(refusal, UnknownKey) or (there is not ABSENT and there == refusal.value)


def _is_wrong_by_itself(refusal: Refusal, data: Mapping[str, Any], judge: Judge, sound: Mapping[str, Any]) -> bool:
    """Tell whether a sound file is refused with this value, or without this key: it is no consequence of another."""
    if not _is_typed(refusal, data):
        return False
    given, table = at(data, refusal.field), refusal.field.rpartition(".")[0]
    if given is not ABSENT and table and at(data, table) is ABSENT:  # a key with dots in it, as a sweep has them
        return True
    return find_refusal(sound, {refusal.field: None if given is ABSENT else given}, judge) is not None


def _refusals(data: Mapping[str, Any], judge: Judge, sound: Mapping[str, Any]) -> Iterator[tuple[Refusal, Changes]]:
    """Yield one refusal after the other, each with the change that passes it over; stops at one that can't be."""
    changes: dict[str, object] = {}
    seen = set[str]()
    while len(seen) < MOST:
        refusal = find_refusal(data, changes, judge)
        if refusal is None or not refusal.field or refusal.field in seen:
            return
        seen.add(refusal.field)
        passed = _pass_over(refusal, data, judge, sound, changes)
        yield refusal, passed
        if not passed:
            return
        changes |= passed


def _pass_over(
    refusal: Refusal, data: Mapping[str, Any], judge: Judge, sound: Mapping[str, Any], changes: Changes
) -> Changes:
    """Return a change that passes a refusal over: one with which data are accepted, or the first one; {} for none."""
    field = refusal.field
    ways: list[Changes] = []
    table = field.rpartition(".")[0]
    if isinstance(refusal, UnknownKey):
        right = refusal.nearest
        if isinstance(right, str) and right.rpartition(".")[0] == table and at(data, right) is ABSENT:
            ways = [{field: None, right: at(data, field)}]
        ways.append({refusal.root: None})
    else:
        ways = [{field: value} for value in (at(sound, field), refusal.nearest) if value not in (None, ABSENT)]
    # A word of a list of words: the list's default takes its place.
    ways += [{path: None} for path in (field, table) if path]
    first: Changes = {}
    for way in ways:
        after = find_refusal(data, {**changes, **way}, judge)
        if after is None:
            return way
        if after.field != field:
            first = first or way
    return first
