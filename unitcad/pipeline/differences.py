"""How built results differ: what was asked of them, and what came out."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Protocol

from unitcad.attenuation.edge.words import percent, spread
from unitcad.casting.steps import duration, grams_of
from unitcad.documents import read_json
from unitcad.pipeline.manifest import Manifest, row
from unitcad.spec import Spec
from unitcad.text import number, toml
from unitcad.validation import from_data
from unitcad.validation.plain_data import requested_data

MOST_KEYS = 12
"""Keys of specs that are listed; the results' spec.toml have all."""
_NOT_COMPARED = ("name", "output", "materials", "motors", "printers", "tissue", "design_source")
"""Keys that say nothing of a unit, or whole tables that another key chooses from."""


class Built(Protocol):
    """A built result."""

    @property
    def folder(self) -> Path:
        """Its folder."""
        ...

    @property
    def manifest(self) -> Manifest:
        """Its manifest."""
        ...

    @property
    def spec(self) -> Spec:
        """The spec of its unit."""
        ...


def differences(results: Sequence[Built]) -> list[dict[str, str]]:
    """Return a row for each value that differs between results; the first column names it, the others are results."""
    names = [one.manifest["name"] for one in results]
    heads = [name if names.count(name) == 1 else one.folder.name for name, one in zip(names, results, strict=True)]
    asked = [dict(_flat(requested_data(one.spec, from_data))) for one in results]
    made = [dict(_outcome(one)) for one in results]
    keys = [*_unlike(asked)]
    left = len(keys) - MOST_KEYS
    rows = [{"": key, **_cells(key, heads, asked)} for key in keys[:MOST_KEYS]]
    if left > 0:
        rows.append({"": f"and {left} more keys: see spec.toml", **dict.fromkeys(heads, "")})
    return rows + [{"": key, **_cells(key, heads, made)} for key in _unlike(made)]


def _unlike(each: Sequence[Mapping[str, str]]) -> Iterator[str]:
    """Yield the keys whose values differ, in their order."""
    for key in dict.fromkeys(key for one in each for key in one):
        if len({one.get(key) for one in each}) > 1:
            yield key


def _cells(key: str, heads: Sequence[str], each: Sequence[Mapping[str, str]]) -> dict[str, str]:
    return {head: one.get(key, "-") for head, one in zip(heads, each, strict=True)}


def _flat(node: Mapping[str, Any], path: str = "") -> Iterator[tuple[str, str]]:
    """Yield the values of a spec as text by their dotted path."""
    for key, value in node.items():
        if path or key not in _NOT_COMPARED:
            below = f"{path}{key}"
            if isinstance(value, Mapping):
                yield from _flat(value, f"{below}.")
            elif isinstance(value, list) and value and isinstance(value[0], Mapping):
                for i, entry in enumerate(value):
                    yield from _flat(entry, f"{below}.{i}.")
            elif not key.endswith("_source"):
                yield below, value if isinstance(value, str) else toml(value)


def _outcome(one: Built) -> Iterator[tuple[str, str]]:
    """Yield what came out of a build: size, masses, times, checks, level."""
    manifest = one.manifest
    columns = row(one.spec, manifest)
    yield from ((key, str(columns[key])) for key in ("array", "units", "pitch_mm") if key in columns)
    boxes = [part["bbox_mm"] for part in manifest["parts"] if part["role"] == "unit" and part["made"] != "bought"]
    if boxes:
        sides = (max(box[i + 3] for box in boxes) - min(box[i] for box in boxes) for i in range(3))
        yield "cast size, mm", " x ".join(number(side, 3) for side in sides)
    if (
        "silicone_mass_g" in columns and "array" not in columns
    ):  # an array's has its own silicone, not that of its units
        yield "silicone, g", number(columns["silicone_mass_g"], 3)
    if manifest["casting"]:
        procedure = read_json(one.folder / "casting.json")
        for name, mass in grams_of(procedure).items():
            yield f"{name} to mix, g", number(mass, 3)
        yield "print", duration(procedure["printing"]["minutes"])
        yield "filament, cm3", number(procedure["printing"]["cm3"], 2)
        yield "out of the mould after", duration(procedure["earliest_finish_min"])
        yield "at the bench", duration(procedure["bench_min"])
    if checks := manifest["mould_checks"]:
        failed = sorted({check["code"] for check in checks if not check["ok"]})
        yield "failed checks", " ".join(failed) or "none"
    if level := manifest["estimate"]:
        low, high = level["low"], level["high"]
        ends = "" if low is None or high is None else f" ({spread(low, high).removesuffix(' %')})"
        yield "level at the edge", "not known" if level["level"] is None else percent(level["level"]) + ends
        if level["measured"] is not None:
            yield "measured level", percent(level["measured"])
