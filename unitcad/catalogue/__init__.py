"""Materials, motors, printers, tissue and the paper's measurements: every value with its source and status.

The data are TOML files beside this module, read on first use. A status is one of `STATUSES`; a value that nobody
has measured for us is "assumed" and carries a range. A spec may bring entries of its own (`own`): the same tables,
where a plain number counts as status "spec".
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cache
from importlib.resources import files
from typing import Any, TypeVar

from unitcad.errors import Refusal, unknown_name

STATUSES = ("datasheet", "paper", "secondary", "assumed", "spec")


@dataclass(frozen=True)
class Value:
    """One number (or a pair) with where it comes from; `low` and `high` bound it where a range is known."""

    value: Any
    status: str
    source: str
    low: float | None = None
    high: float | None = None

    def __float__(self) -> float:
        return float(self.value)


@dataclass(frozen=True)
class Material:
    """A castable silicone. Units are in the names; `youngs_modulus_kpa`: small strain, the motor's frequency."""

    name: str
    density_g_cm3: Value
    mixed_viscosity_cps: Value
    pot_life_min: Value
    cure_h: Value
    shore: Value
    modulus_100pct_kpa: Value
    tensile_mpa: Value
    elongation_pct: Value
    casting_floor_mm: Value
    poisson_ratio: Value
    loss_factor: Value
    mix_ratio: Value
    youngs_modulus_kpa: Value | None = None
    fractional_mu0_kpa: Value | None = None
    fractional_tau_us: Value | None = None
    fractional_n: Value | None = None


@dataclass(frozen=True)
class Motor:
    """A coin ERM motor."""

    name: str
    diameter_mm: Value
    thickness_mm: Value
    frequency_hz: Value | None = None
    amplitude_um: Value | None = None
    rpm: Value | None = None
    voltage_v: Value | None = None
    current_ma: Value | None = None
    acceleration_g: Value | None = None


@dataclass(frozen=True)
class Printer:
    """What a printer can do and the clearances that follow from it; all lengths mm, clearances per side."""

    name: str
    technology: Value
    bed_x_mm: Value
    bed_y_mm: Value
    bed_z_mm: Value
    layer_mm: Value
    xy_play_mm: Value
    plinth_clearance_mm: Value
    seat_relief_mm: Value
    slot_height_mm: Value
    slot_width_clearance_mm: Value
    window_clearance_mm: Value
    least_wall_mm: Value
    least_flat_wall_mm: Value
    least_feature_mm: Value
    skirt_wall_mm: Value
    land_mm: Value
    groove_width_mm: Value
    groove_depth_mm: Value
    filament_hole_mm: Value
    engraving_depth_mm: Value
    engraving_stroke_mm: Value
    draft_deg: Value
    overhang_deg: Value
    bridge_mm: Value


@dataclass(frozen=True)
class Tissue:
    """One layer of the body under the unit, skin first; no `thickness_mm` means a half-space."""

    name: str
    density_kg_m3: Value
    poisson_ratio: Value
    thickness_mm: Value | None = None
    youngs_modulus_kpa: Value | None = None
    shear_modulus_kpa: Value | None = None
    loss_factor: Value | None = None
    viscosity_pa_s: Value | None = None


_Entry = TypeVar("_Entry", Material, Motor, Printer, Tissue)
_KINDS: dict[type, tuple[str, str]] = {
    Material: ("materials.toml", "material"),
    Motor: ("motors.toml", "motor"),
    Printer: ("printers.toml", "printer"),
}


def materials(own: Mapping[str, Mapping[str, Any]] | None = None) -> dict[str, Material]:
    """All silicones by name, the spec's own ones over the shipped ones. Raises `Refusal` for a malformed own entry."""
    return _entries(Material, own)


def motors(own: Mapping[str, Mapping[str, Any]] | None = None) -> dict[str, Motor]:
    """All motors by part name. Raises `Refusal` for a malformed own entry."""
    return _entries(Motor, own)


def printers(own: Mapping[str, Mapping[str, Any]] | None = None) -> dict[str, Printer]:
    """All printers by name. Raises `Refusal` for a malformed own entry."""
    return _entries(Printer, own)


def tissue(name: str = "forearm", own: Mapping[str, Mapping[str, Any]] | None = None) -> tuple[Tissue, ...]:
    """The layers of a body, skin first, the last one a half-space. Raises `Refusal` for an unknown name."""
    known: dict[str, Any] = dict(_raw("tissue.toml"))
    known.update(own or {})
    if name not in known:
        raise unknown_name("estimate.tissue", name, known)
    return tuple(_entry(Tissue, layer, table, f"tissue.{name}.{layer}") for layer, table in known[name].items())


@cache
def measurements() -> dict[str, Any]:
    """The paper's measured amplitudes at the edge, as printed; see the comments in measurements.toml."""
    return _raw("measurements.toml")


def choose(kind: str, name: str, known: Mapping[str, _Entry]) -> _Entry:
    """`known[name]`, or a `Refusal` that names the field `kind` and the closest names."""
    if name not in known:
        raise unknown_name(kind, name, known)
    return known[name]


def _entries(kind: type[_Entry], own: Mapping[str, Mapping[str, Any]] | None) -> dict[str, _Entry]:
    file, field = _KINDS[kind]
    found = dict(_shipped(kind))
    shipped = _raw(file)
    for name, table in (own or {}).items():
        base = table.get("like")
        if base is not None and base not in shipped:
            raise unknown_name(f"{field}s.{name}.like", base, shipped)
        merged = {**(shipped[base] if base else {}), **{k: v for k, v in table.items() if k != "like"}}
        found[name] = _entry(kind, name, merged, f"{field}s.{name}", spec=set(table))
    return found


@cache
def _shipped(kind: type[_Entry]) -> dict[str, _Entry]:
    file, field = _KINDS[kind]
    return {name: _entry(kind, name, table, f"{field}s.{name}") for name, table in _raw(file).items()}


@cache
def _raw(file: str) -> dict[str, Any]:
    return tomllib.loads((files("unitcad.catalogue") / file).read_text("utf-8"))


def _entry(kind: type[_Entry], name: str, table: Mapping[str, Any], path: str, spec: set[str] | None = None) -> _Entry:
    """An entry from its table; keys in `spec` (an own entry's) have status "spec" unless they say otherwise."""
    known = {f.name: f for f in fields(kind) if f.name != "name"}
    status, source = table.get("status", "spec"), table.get("source", "the spec")
    values: dict[str, Value] = {}
    for key, raw in table.items():
        if key in ("status", "source"):
            continue
        if key not in known:
            raise unknown_name(path, key, known)
        own = spec is not None and key in spec
        default = ("spec", "the spec") if own else (status, source)
        values[key] = _value(raw, default, f"{path}.{key}")
    missing = [key for key, f in known.items() if key not in values and "None" not in str(f.type)]
    if missing:
        raise Refusal(path, name, f"lacks {', '.join(missing)} (or give like = a shipped entry's name)")
    return kind(name=name, **values)


def _value(raw: Any, default: tuple[str, str], path: str) -> Value:
    if not isinstance(raw, Mapping):
        _check_number(raw, path)
        return Value(raw, *default)
    extra = set(raw) - {"value", "status", "source", "low", "high"}
    if extra or "value" not in raw:
        raise Refusal(path, dict(raw), "a table needs value, and may have status, source, low and high")
    if raw.get("status", default[0]) not in STATUSES:
        raise unknown_name(f"{path}.status", str(raw["status"]), STATUSES)
    for key in ("value", "low", "high"):
        if key in raw:
            _check_number(raw[key], f"{path}.{key}")
    return Value(
        raw["value"],
        raw.get("status", default[0]),
        raw.get("source", default[1]),
        raw.get("low"),
        raw.get("high"),
    )


def _check_number(raw: Any, path: str) -> None:
    if isinstance(raw, bool) or (isinstance(raw, float) and not abs(raw) < float("inf")):
        raise Refusal(path, raw, "must be a finite number")
