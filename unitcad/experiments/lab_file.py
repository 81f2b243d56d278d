"""The file that says what a lab has: units at hand, frequencies, bodies, how well it measures, what it has measured.

frequencies_hz = [60, 125, 200]
bodies = ["rigid-plate", "gel-50kpa"]      # of the catalogue, or [tissue.NAME.layer] below
[units.stiff-inside]                       # a template or a spec file beside this one, and what is changed in it
base = "unit.toml"
"layers.0.material" = "dragon-skin-10-medium"
[[measured]]                               # a ratio that is known already
above = { unit = "stiff-inside", frequency_hz = 200, body = "gel-50kpa" }
below = { unit = "stiff-inside", frequency_hz = 60, body = "gel-50kpa" }
ratio = 1.4
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from msgspec import Meta, Struct, field
from msgspec.structs import replace

from unitcad.attenuation.edge.variant_units import MANY_LAYERS, MOST_LAYERS
from unitcad.attenuation.inputs import EstimateInput, Quantity
from unitcad.catalogue import MaterialEntry, TissueEntry, tissue
from unitcad.catalogue.entries import Frequency
from unitcad.errors import Refusal, WrongArgument, unknown_name
from unitcad.estimating import estimate_input
from unitcad.experiments.protocol import Condition, Factor, Ratio
from unitcad.spec import Spec, check_plain, convert, read_toml, to_data
from unitcad.validation import from_data, put, read
from unitcad.validation.shipped_files import is_path, named_file, shipped_files

Name = Annotated[str, Meta(min_length=1, max_length=60)]
_MOST_CONDITIONS = 200


class ConditionTable(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A reading: a unit of the file, a frequency and a body."""

    unit: str
    frequency_hz: Frequency
    body: str


class MeasuredTable(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A measured ratio of two readings."""

    above: ConditionTable
    below: ConditionTable
    ratio: Annotated[float, Meta(ge=1e-6, le=1e6)]


class LabFile(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A lab as typed. `noise` and `discrepancy` are standard deviations of a reading's logarithm: 0.1 is 10 %."""

    units: Annotated[dict[str, dict[str, Any]], Meta(min_length=1)]
    frequencies_hz: Annotated[list[Frequency], Meta(min_length=1, max_length=20)]
    bodies: Annotated[list[Name], Meta(min_length=1, max_length=20)]
    compare: Annotated[list[Factor], Meta(min_length=1)] = field(default_factory=lambda: ["unit", "frequency", "body"])
    rivals: list[str] = []
    noise: Annotated[float, Meta(ge=0.001, le=2)] = 0.1
    discrepancy: Annotated[float, Meta(ge=0, le=2)] = 0.15
    smallest_um: Annotated[float, Meta(ge=1e-6, le=1000, description="amplitude that is told from none")] = 0.1
    modulus_factor: Annotated[float, Meta(ge=1, le=10)] = 1.5
    draws: Annotated[int, Meta(ge=10, le=2000)] = 200
    element_draws: Annotated[int, Meta(ge=10, le=2000, description="of rivals by finite elements")] = 40
    seed: Annotated[int, Meta(ge=0, le=2**32 - 1)] = 1
    held_to_levels: Annotated[bool, Meta(description="draws weigh by the nine measured levels")] = True
    tissue: dict[str, dict[str, TissueEntry]] = {}
    materials: dict[str, MaterialEntry] = {}
    measured: list[MeasuredTable] = []


@dataclass(frozen=True)
class Lab:
    """A validated lab: its settings, and the estimate's input for every condition."""

    name: str
    settings: LabFile
    variants: Mapping[Condition, EstimateInput]
    measured: tuple[tuple[Ratio, float], ...] = ()

    @property
    def conditions(self) -> tuple[Condition, ...]:
        return tuple(self.variants)


def shipped() -> dict[str, Path]:
    """Return the shipped labs by name."""
    return shipped_files("experiments")


def load_lab(source: str | os.PathLike[str], changes: Mapping[str, Any] | None = None) -> Lab:
    """Load the lab of a file (a path separator or .toml in `source`) or a shipped one (a bare name).

    `changes` stand in for keys of the file. Raises Refusal or UnitcadError for the first value that is not valid.
    """
    path = named_file(os.fspath(source), shipped(), "LAB")
    return lab_of_data({**read_toml(path), **(changes or {})}, path.parent, path.stem)


def lab_of_data(data: Mapping[str, Any], folder: Path, name: str) -> Lab:
    """Return the lab of a file's data; `folder` is where its relative paths start. Raises as `load_lab`."""
    settings = convert(data, LabFile)
    _check_twice(settings)
    own = {f"{key}.{name}": entry for key in ("tissue", "materials") for name, entry in data.get(key, {}).items()}
    specs = {
        unit: spec_with(
            f"units.{unit}", table.get("base"), {k: v for k, v in table.items() if k != "base"}, folder, own
        )
        for unit, table in settings.units.items()
    }
    return lab_of_specs(specs, settings, name)


def lab_of_specs(specs: Mapping[str, Spec], settings: LabFile, name: str = "lab") -> Lab:
    """Return the lab of specs by unit's name; `settings.units` is not read.

    Raises Refusal for a unit that can't be estimated, an unknown body or a measured ratio that is none of the lab's.
    """
    count = len(specs) * len(settings.frequencies_hz) * len(settings.bodies)
    if count > _MOST_CONDITIONS:
        limit = f"units x frequencies x bodies are {count} readings; at most {_MOST_CONDITIONS}"
        raise Refusal("frequencies_hz", settings.frequencies_hz, limit)
    variants = {}
    for unit, spec in specs.items():
        for i, body in enumerate(settings.bodies):
            try:
                tissue(body, spec.tissue)
            except Refusal as refusal:
                raise Refusal(f"bodies.{i}", body, refusal.limit, refusal.nearest) from None
            asked = from_data(_on(spec, body)) if spec.estimate.tissue != body else spec
            for hertz in settings.frequencies_hz:
                variant = estimate_input(asked, hertz)
                if len(variant.layers) > MOST_LAYERS:
                    raise Refusal(f"units.{unit}.layers", len(spec.layers), MANY_LAYERS)
                for at, layer in enumerate(variant.layers):
                    if not layer.youngs_modulus.known:
                        raise Refusal(f"units.{unit}.layers.{at}", layer.material, layer.youngs_modulus.note)
                variants[Condition(unit, hertz, body)] = with_ranges(variant, settings.modulus_factor)
    measured = tuple(_measured(one, variants, f"measured.{i}") for i, one in enumerate(settings.measured))
    return Lab(name, settings, variants, measured)


def with_ranges(variant: EstimateInput, factor: float) -> EstimateInput:
    """Give every modulus of a silicone that has none a range: its value over and its value times a factor."""

    def ranged(modulus: Quantity) -> Quantity:
        middle = modulus.middle
        return modulus if modulus.low is not None else replace(modulus, low=middle / factor, high=middle * factor)

    layers = tuple(replace(layer, youngs_modulus=ranged(layer.youngs_modulus)) for layer in variant.layers)
    return replace(variant, layers=layers)


def spec_with(
    field: str,
    base: object,
    changes: Mapping[str, Any],
    folder: Path,
    entries: Mapping[str, Any],
    base_key: str = "base",
) -> Spec:
    """Return the spec `base` names, a template or a file that starts at `folder`, with `entries` and `changes` by path.

    Raises Refusal whose field begins with `field`.
    """
    where = f"{field}.{base_key}"
    if not isinstance(base, str):
        raise Refusal(where, base, "must name a template or a spec file")
    named = folder / base if is_path(base) else base
    try:
        data = read(named)
    except WrongArgument as refusal:
        raise Refusal(where, base, refusal.limit, refusal.nearest) from None
    check_plain(data)
    for path, entry in entries.items():
        put(data, path, entry)
    try:
        for path, value in changes.items():
            put(data, path, value)
        return from_data(data, folder)
    except Refusal as refusal:
        raise type(refusal)(f"{field}.{refusal.field}", refusal.value, refusal.limit, refusal.nearest) from None


def _on(spec: Spec, body: str) -> dict[str, Any]:
    data = to_data(spec)
    put(data, "estimate.tissue", body)
    return data


def _measured(table: MeasuredTable, variants: Mapping[Condition, Any], path: str) -> tuple[Ratio, float]:
    above, below = (_condition(getattr(table, end), variants, f"{path}.{end}") for end in ("above", "below"))
    if above == below:
        raise Refusal(path, str(above), "is a reading over itself")
    return Ratio(above, below), table.ratio


def _condition(table: ConditionTable, variants: Mapping[Condition, Any], path: str) -> Condition:
    for key, known in (
        ("unit", {c.unit for c in variants}),
        ("body", {c.body for c in variants}),
    ):
        if getattr(table, key) not in known:
            raise unknown_name(f"{path}.{key}", getattr(table, key), known)
    frequencies = sorted({c.frequency_hz for c in variants})
    if table.frequency_hz not in frequencies:
        nearest = min(frequencies, key=lambda hertz: abs(hertz - table.frequency_hz))
        raise Refusal(f"{path}.frequency_hz", table.frequency_hz, "is none of frequencies_hz", nearest)
    return Condition(table.unit, table.frequency_hz, table.body)


def _check_twice(settings: LabFile) -> None:
    for key in ("frequencies_hz", "bodies", "compare", "rivals"):
        entries: list[Any] = getattr(settings, key)
        for i, entry in enumerate(entries):
            if entry in entries[:i]:
                raise Refusal(f"{key}.{i}", entry, "is there twice")
