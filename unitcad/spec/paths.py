"""Paths of a file's keys, and those that a person may have meant by a wrong one."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from difflib import SequenceMatcher
from typing import Any

from unitcad.spec.fields import entry_in, fields_of, meaning, plain_kinds, table_in
from unitcad.text import measured, some

_UNIT = re.compile(r"_(mm|cm|m|um|in|deg|percent|pct|hz|c|g|kg|kpa|mpa|cps|min|h|s|v|ma|kg_m3|g_cm3)$")
_ALIKE = 0.8
"""Least likeness of a step with a key, or of a table's name in the singular with the table."""
_MOST_MEANT = 6
"""Paths that a refusal names."""
_BEGINNING = 4
"""Letters of a word's beginning that stand for the word: "thick" for "thickness_mm"."""
EXACT = 3
"""Score of a key that differs from the typed one by its unit, or not at all."""


def paths_of(kind: Any, node: Any, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield every path of a file, tables and values, in the order of its tables, with the kind of its value.

    Entries of lists are those of `node`, the file's data.
    """
    table, entry = table_in(kind), entry_in(kind)
    if table is not None:
        for name, field in fields_of(table).items():
            yield f"{prefix}{name}", field.type
            below = node.get(name) if isinstance(node, Mapping) else None
            yield from paths_of(field.type, below, f"{prefix}{name}.")
    elif entry is not None:
        for i, below in enumerate(node if isinstance(node, list) else []):
            yield from paths_of(entry, below, f"{prefix}{i}.")


def bare(key: str) -> str:
    """Return a key without its unit."""
    return _UNIT.sub("", key)


def meant(path: str, value: object, kind: Any, node: Any, least: int = 1) -> list[str]:
    """Return the paths of a file that a wrong one may mean, for a value that they can take: the likeliest ones.

    A path is compared step by step: `layers[0].wall`, `Layer.0.wall_mm` and `wall` all mean layers.0.wall_mm. A number
    of a list that no entry has stands for every entry. `least` is the score from which a path counts: `EXACT`, or less
    for words that a key or its description has.
    """
    *tables, key = _steps(path) or [""]
    without = [step for step in tables if not step.strip("_").isdigit()]
    found = _likeliest(tables, key, value, kind, node, least)
    return found if found or without == tables else _likeliest(without, key, value, kind, node, least)


def _likeliest(tables: list[str], key: str, value: object, kind: Any, node: Any, least: int) -> list[str]:
    """Return the likeliest paths for the steps of a typed one: of its tables, and of its key."""
    scores: dict[str, int] = {}
    for known, takes in paths_of(kind, node):
        *above, own = known.split(".")
        score = _score(key, own, takes) if _within(tables, above) else 0
        if score >= least and _takes(takes, value, own):
            scores[known] = score
    best = [known for known, score in scores.items() if score == max(scores.values())]
    same_depth = [known for known in best if known.count(".") == len(tables)]
    return same_depth or best


def in_words(paths: Iterable[str]) -> str:
    """Write paths as a refusal lists them: all, if they are few."""
    every = list(paths)
    return " or ".join(every) if len(every) <= _MOST_MEANT else some(every, _MOST_MEANT)


def lone_path(key: str, value: object) -> tuple[str, object]:
    """Return the path of the only value below a key, and the value: what a person typed after --set."""
    while isinstance(value, Mapping) and len(value) == 1:
        ((below, value),) = value.items()
        key = f"{key}.{below}"
    return key, value


def _steps(path: str) -> list[str]:
    return [step for step in re.split(r"[.\[\]/]+", path.lower().replace("-", "_").replace(" ", "_")) if step]


def _score(typed: str, key: str, kind: Any) -> int:
    if typed in (key, bare(key)):
        return EXACT + (typed == key)
    if _same(bare(typed), bare(key)):
        return EXACT - 1
    words = {word for word in typed.split("_") if word}
    if words and _stand_for(words, bare(key).split("_")):
        return 2
    return int(len(words) > 0 and _stand_for(words, re.findall(r"[a-z]+", meaning(kind).lower()), _ALIKE))


def _stand_for(typed: Iterable[str], words: list[str], alike: float = 1.0) -> bool:
    """Tell whether each typed word is one of the words, the beginning of one, or as much alike."""

    def stands(word: str, each: str) -> bool:
        begins = len(word) >= _BEGINNING and each.startswith(word)
        return word == each or begins or (alike < 1.0 and SequenceMatcher(None, word, each).ratio() > alike)

    return all(any(stands(word, each) for each in words) for word in typed)


def _within(tables: list[str], above: list[str]) -> bool:
    """Tell whether the steps of a typed path are among those above a key, in their order."""
    rest = iter(above)
    return all(any(_same(typed, step) for step in rest) for typed in tables)


def _same(typed: str, step: str) -> bool:
    return typed == step or (not step.isdigit() and SequenceMatcher(None, typed, step).ratio() > _ALIKE)


def _takes(kind: Any, value: object, key: str) -> bool:
    """Tell whether a value is of a kind that a key takes, or a text with a number that it means, such as "200Hz"."""
    known = plain_kinds(kind)
    if value is None or type(value) in known or (isinstance(value, int | float) and float in known):
        return True
    unit = key.rpartition("_")[2]
    return isinstance(value, str) and bool(known & {int, float}) and measured(value, unit) is not None
