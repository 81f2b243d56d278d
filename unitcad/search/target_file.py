"""The target file: the target, the things at hand, and the lengths that may vary.

[target]
edge_max = 0.06                     # of the motor's amplitude, at the unit's edge
crosstalk_ratio_max = 0.3           # the skin's motion at a neighbour's middle over that at the unit's edge
pitch_mm = 20
[at_hand]
materials = ["ecoflex-00-10", "dragon-skin-30"]
[vary]
wall_mm = [1.0, 2.0]
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from msgspec import Meta, Struct

from unitcad import catalogue
from unitcad.attenuation.edge.ranges import LabFit
from unitcad.catalogue import MaterialEntry, MotorEntry, PrinterEntry, TissueEntry
from unitcad.catalogue import entries as kinds
from unitcad.catalogue.entries import between
from unitcad.documents import read_toml
from unitcad.errors import Refusal, UnitcadError, unknown_name
from unitcad.files import read_text
from unitcad.spec import convert
from unitcad.spec.raw import LEAST_LAYER, Moduli
from unitcad.validation.cupboard import AtHandTable, Name, check_at_hand, cupboard_of
from unitcad.validation.defaults import lab_fit
from unitcad.validation.load import load_file

MOST_PITCH_MM = 200.0
Level = Annotated[float, between(0.001, 2, "of the motor's amplitude, at the unit's edge")]
Ratio = Annotated[float, between(1e-6, 1, "skin at a neighbour's middle, pitch_mm away, over that at the unit's edge")]
Pitch = Annotated[float, between(1, MOST_PITCH_MM, "between the middles of two units")]
CureHours = Annotated[float, between(0.01, 1e5, "from the first weighing until the unit is out of the mould")]
MOST_LAYERS = 2
Layers = Annotated[int, between(1, MOST_LAYERS, "no unit of more was measured")]
Wall = Annotated[float, between(LEAST_LAYER, 20)]
Step = Annotated[float, between(0.01, 10)]
_SPEC_KEYS = ("motor", "fpcb", "wires", "moulds", "casting", "output")
MOST_GEOMETRIES = 20_000
"""Sets of lengths that are tried; each costs about half a millisecond."""


class TargetTable(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The target: a level at the edge, and limits on size, mass, time and crosstalk."""

    edge_max: Annotated[
        Level | None, Meta(description="largest level at the edge, as a fraction of the motor's amplitude")
    ] = None
    edge_min: Annotated[Level | None, Meta(description="smallest level at the edge, for a unit that amplifies")] = None
    probability_min: Annotated[float, between(0.01, 0.99, "smallest probability of meeting the level")] = 0.5
    crosstalk_ratio_max: Annotated[
        Ratio | None,
        Meta(
            description="largest ratio of the motion at a neighbour's middle to that at the unit's edge; needs pitch_mm"
        ),
    ] = None
    pitch_mm: Annotated[Pitch | None, Meta(description="distance between the middles of two units")] = None
    diameter_max_mm: Annotated[
        Annotated[float, between(1, kinds.LONGEST_MM)] | None, Meta(description="largest diameter")
    ] = None
    height_max_mm: Annotated[
        Annotated[float, between(0.5, kinds.LONGEST_MM)] | None, Meta(description="largest height")
    ] = None
    mass_max_g: Annotated[float, between(0.01, 1e4, "largest mass of silicone and motor")] | None = None
    cure_hours_max: Annotated[
        CureHours | None, Meta(description="longest time from the first weighing until the unit is out of the mould")
    ] = None
    frequency_hz: Annotated[
        kinds.Frequency | None, Meta(description="frequency of the drive; default: the motor's")
    ] = None


class VaryTable(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Lengths and numbers of layers to try."""

    layers: Annotated[
        tuple[Layers, ...], Meta(min_length=1, max_length=MOST_LAYERS, description="numbers of layers to try")
    ] = (1, 2)
    wall_mm: Annotated[
        tuple[Wall, Wall] | None,
        Meta(description="smallest and largest wall; default: 1 to 2, for a single layer 1 to 2.5"),
    ] = None
    cap_mm: Annotated[
        tuple[Wall, Wall] | None, Meta(description="smallest and largest cap; default: as thick as the wall")
    ] = None
    diameter_mm: Annotated[
        tuple[kinds.MotorDiameter, kinds.MotorDiameter] | None,
        Meta(description="smallest and largest diameter; default: 14, or the smallest that takes the motor"),
    ] = None
    step_mm: Annotated[Step, Meta(description="step of walls and caps")] = 0.25
    diameter_step_mm: Annotated[Step, Meta(description="step of the diameter")] = 1.0

    def walls(self, layers: int) -> tuple[float, float]:
        """Return the least and largest wall of units of so many layers, mm.

        By default a single layer goes up to the measured controls' 2.5 mm.
        """
        return self.wall_mm or ((1.0, 2.5) if layers == 1 else (1.0, 2.0))


class ModelsTable(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Inputs of the estimate."""

    fit: Annotated[str | None, Meta(description="lab-fit.toml of unitcad fit")] = None
    tissue: Annotated[Name, Meta(description="tissue under the unit")] = "forearm"
    moduli: Annotated[
        Moduli, Meta(description="moduli of the silicones: youngs_modulus_kpa, or quasistatic_modulus_kpa")
    ] = "small-strain"


class TargetFile(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A target for `unitcad design`."""

    target: TargetTable
    at_hand: AtHandTable = AtHandTable()
    vary: VaryTable = VaryTable()
    estimate: ModelsTable = ModelsTable()
    spec: Annotated[dict[str, dict[str, Any]], Meta(description=f"tables of every spec: {', '.join(_SPEC_KEYS)}")] = {}
    materials: dict[str, MaterialEntry] = {}
    motors: dict[str, MotorEntry] = {}
    printers: dict[str, PrinterEntry] = {}
    tissue: dict[str, dict[str, TissueEntry]] = {}


@dataclass(frozen=True)
class Target:
    """A validated target.

    `materials`: the silicones at hand, `designs` those to try; `entries`: the tables that a spec of it carries, its own
    catalogue entries among them.
    """

    name: str
    asked: TargetFile
    materials: tuple[str, ...]
    designs: tuple[str, ...]
    entries: Mapping[str, Any]
    fit: LabFit | None = None

    @property
    def goals(self) -> TargetTable:
        """The table `target`."""
        return self.asked.target


def load_target(source: str | os.PathLike[str]) -> Target:
    """Return the target of a shipped name or of a file.

    Raises Refusal with every value that is not valid, and its line, or UnitcadError.
    """
    return load_file(source, "target", lambda data, path: target_of(data, path.stem, path.parent))


def target_of(data: Mapping[str, Any], name: str = "target", folder: Path = Path()) -> Target:
    """Return the target of a file's data; its relative paths start at `folder`. Raises as `load_target`."""
    _check_percent(data)
    data = _with_cupboard(data, folder)
    asked = convert(data, TargetFile)
    _check_target(asked.target)
    _check_ranges(asked.vary)
    _check_spec(asked.spec)
    names, chosen = check_at_hand(asked.at_hand, asked.materials, asked.motors, asked.printers)
    catalogue.tissue(asked.estimate.tissue, asked.tissue)
    text, fit = _fit(asked.estimate, folder)
    return Target(name, asked, names, chosen, _entries(asked, data, text), fit)


def _with_cupboard(data: Mapping[str, Any], folder: Path) -> Mapping[str, Any]:
    """Return a target's data with what its cupboard holds; keys and entries of the target go before the cupboard's.

    Raises Refusal for a cupboard that can't be read, and for one with a fault.
    """
    at_hand = data.get("at_hand")
    name = at_hand.get("cupboard") if isinstance(at_hand, Mapping) else None
    if not isinstance(at_hand, Mapping) or not isinstance(name, str):
        return data
    try:
        owned = read_toml(folder / name)
        cupboard_of(owned)
    except (UnitcadError, OSError) as error:
        raise Refusal("at_hand.cupboard", name, str(error)) from None
    given = {key: data[key] for key in ("materials", "motors", "printers") if isinstance(data.get(key), Mapping)}
    entries = {key: {**owned[key], **given.get(key, {})} for key in owned if key != "at_hand"}
    return {**data, **entries, "at_hand": {**owned.get("at_hand", {}), **at_hand}}


def _fit(table: ModelsTable, folder: Path) -> tuple[str, LabFit | None]:
    """Return the text of a lab's fit and the fit. Raises Refusal for one that can't be read or is by other moduli."""
    if table.fit is None:
        return "", None
    try:
        text = read_text(folder / table.fit)
    except (UnitcadError, OSError) as error:
        raise Refusal("estimate.fit", table.fit, str(error)) from None
    fit = lab_fit(text)
    if fit.moduli != table.moduli:
        limit = f"{table.fit} has its constants by {fit.moduli} moduli"
        raise Refusal("estimate.moduli", table.moduli, limit, fit.moduli)
    return text, fit


def _check_percent(data: Mapping[str, Any]) -> None:
    """Raise Refusal for a level that can only be meant in per cent."""
    table = data.get("target")
    for key in ("edge_max", "edge_min"):
        value = table.get(key) if isinstance(table, Mapping) else None
        if isinstance(value, int | float) and not isinstance(value, bool) and 2 < value <= 200:
            raise Refusal(f"target.{key}", value, "is a fraction of the motor's amplitude, at most 2", value / 100)


def _check_target(goals: TargetTable) -> None:
    if goals.edge_max is None and goals.edge_min is None:
        raise Refusal("target.edge_max", None, "is required, or edge_min for a unit that amplifies")
    if goals.edge_max is not None and goals.edge_min is not None:
        raise Refusal("target.edge_min", goals.edge_min, "excludes edge_max: a target has one of the two")
    if goals.crosstalk_ratio_max is not None and goals.pitch_mm is None:
        raise Refusal("target.pitch_mm", None, "is required with crosstalk_ratio_max")


def _check_ranges(vary: VaryTable) -> None:
    for key in ("wall_mm", "cap_mm", "diameter_mm"):
        ends = getattr(vary, key)
        if ends and ends[0] > ends[1]:
            raise Refusal(f"vary.{key}", list(ends), "goes from the least to the largest value", [ends[1], ends[0]])
    for i, count in enumerate(vary.layers):
        if count in vary.layers[:i]:
            raise Refusal(f"vary.layers.{i}", count, "is given twice")


def _check_spec(tables: Mapping[str, Mapping[str, Any]]) -> None:
    for key, table in tables.items():
        if key not in _SPEC_KEYS:
            raise unknown_name(f"spec.{key}", "...", _SPEC_KEYS)
        for other, place in (("part", "at_hand.motors"), ("printer", "at_hand.printer")):
            if other in table:
                raise Refusal(f"spec.{key}.{other}", table[other], f"is in {place}")


def _entries(asked: TargetFile, data: Mapping[str, Any], fit_text: str) -> dict[str, Any]:
    """Return the tables of every proposal's spec but name, design, diameter and layers, as plain data."""
    tables: dict[str, Any] = {key: dict(table) for key, table in asked.spec.items()}
    if "wires" not in tables:
        tables.setdefault("fpcb", {})
    tables["moulds"] = {"printer": asked.at_hand.printer, **tables.get("moulds", {})}
    lab = {"scale_resolution_g": asked.at_hand.scale_g, "room_c": asked.at_hand.room_c, "vacuum": asked.at_hand.vacuum}
    tables["casting"] = {**lab, **tables.get("casting", {})}
    estimate: dict[str, Any] = {"tissue": asked.estimate.tissue, "moduli": asked.estimate.moduli}
    if asked.target.frequency_hz is not None:
        estimate["frequency_hz"] = asked.target.frequency_hz
    if asked.estimate.fit is not None:
        estimate |= {"fit": Path(asked.estimate.fit).name, "fit_source": fit_text}
    tables["estimate"] = estimate
    return tables | {key: data[key] for key in ("materials", "motors", "printers", "tissue") if data.get(key)}
