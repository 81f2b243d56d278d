"""A lab's units together with the paper's: leave-one-out errors and the fit."""

from __future__ import annotations

import copy
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from msgspec import Meta, field
from scipy.special import stdtrit

from unitcad import files
from unitcad.attenuation.edge.measured import CONTROL, MeasuredTable, coordinates_of, measured_table, nominal
from unitcad.attenuation.edge.models import BASELINE, COMPARED, RULE
from unitcad.attenuation.edge.ranges import InputFile, LabFit, ModelFit, OwnLevel, unit_key
from unitcad.attenuation.edge.scoring import SEED, bootstrap_range, leader
from unitcad.attenuation.inputs import EstimateInput
from unitcad.casting.cast_record import CastRecord, CastUnit, read_cast_record
from unitcad.catalogue import materials
from unitcad.catalogue.entries import Frequency, MaterialEntry
from unitcad.documents import read_toml
from unitcad.errors import Refusal, UnitcadError, unknown_name
from unitcad.estimate_inputs import estimate_input
from unitcad.json_text import rounded
from unitcad.lab.campaign import File, Name, file_of, read_campaign
from unitcad.lab.measuring import Measured, measure
from unitcad.lab.random_effects import (
    BETWEEN_BATCHES,
    BETWEEN_LABS,
    OWN,
    PAPER,
    Campaigns,
    Judged,
    MixedFit,
    gradients,
    judge,
    mixed_fit,
    paired_difference,
)
from unitcad.lab.record import LabFinding
from unitcad.spec import Spec, check_plain, convert, to_data
from unitcad.spec.raw import Table
from unitcad.text import some
from unitcad.validation import custom_templates, from_data, put, read, templates
from unitcad.validation.load import is_path, load_file

Line = Annotated[str, Meta(min_length=1, max_length=300)]
LevelValue = Annotated[float, Meta(ge=1e-6, le=1e3, description="amplitude at the edge over the motor's")]
PAPER_LAB = "paper"
"""Name of the paper's lab in `unit.lab`."""
_TWO_SIDED = 1.96
"""Half-width of a 95 % interval in standard errors."""


class LevelTable(Table, frozen=True, kw_only=True):
    """A level and its 95 % interval."""

    value: LevelValue
    low: Annotated[LevelValue | None, Meta(description="lower end of the 95 % interval")] = None
    high: Annotated[LevelValue | None, Meta(description="upper end of the 95 % interval")] = None


class InstrumentTable(Table, frozen=True, kw_only=True):
    """How a lab measured: what the paper does not say of its own levels."""

    sensor: Annotated[Line, Meta(description="sensor: maker, model and settings")]
    surface: Annotated[
        Literal["unit", "skin"], Meta(description="surface that it reads at the edge: the unit's own, or the skin's")
    ]
    axis: Annotated[Literal["normal", "along"], Meta(description="axis that it reads: normal to the skin, or along it")]
    support: Annotated[Line, Meta(description="what the unit is on: a phantom with silicone and depth, or a forearm")]
    motor: Annotated[Line, Meta(description="motor, and its voltage or current")]


class ContributorTable(Table, frozen=True, kw_only=True):
    """Who gives the data, and under which licence."""

    name: Annotated[Line, Meta(description="person or lab to be named as the source")]
    licence: Annotated[Line, Meta(description="licence of the data, such as CC-BY-4.0")]
    source: Annotated[Line, Meta(description="publication or address of the data")] = ""


class FitUnitTable(Table, frozen=True, kw_only=True):
    """One measured unit: its spec or cast record, and its level or the file with the level."""

    name: Annotated[Name, Meta(description="a name of the unit")]
    lab: Annotated[Name | None, Meta(description="lab that measured it; default: the file's name")] = None
    batch: Annotated[
        Name | None, Meta(description="casting that it is of; default: its cast record, or a casting of its own")
    ] = None
    spec: Annotated[File | None, Meta(description="spec file or template of the unit")] = None
    cast: Annotated[File | None, Meta(description="cast record of the unit, in place of spec")] = None
    cavity: Annotated[
        Annotated[int, Meta(ge=1, le=999)] | None,
        Meta(description="cavity of the cast record: the number engraved next to the unit"),
    ] = None
    set: Annotated[dict[str, Any], Meta(description="values of the spec to change, by path")] = field(
        default_factory=dict
    )
    frequency_hz: Annotated[Frequency | None, Meta(description="frequency of the measurement; default: the spec's")] = (
        None
    )
    level: LevelTable | None = None
    measured: Annotated[File | None, Meta(description="measured.toml of unitcad measure, in place of level")] = None
    recordings: Annotated[
        File | None, Meta(description="campaign of unitcad measure with the unit's recordings, in place of level")
    ] = None


class FitLabFile(Table, frozen=True, kw_only=True):
    """A lab's measured units."""

    removed: ClassVar = {"with_paper": "include_paper_units"}
    name: Annotated[Name, Meta(description="a name of the lab")]
    note: Annotated[str, Meta(max_length=1000, description="a remark for the results")] = ""
    moduli: Annotated[
        Literal["small-strain", "quasi-static"],
        Meta(description="moduli of the silicones: youngs_modulus_kpa, or quasistatic_modulus_kpa"),
    ] = "small-strain"
    include_paper_units: Annotated[
        bool, Meta(description="whether the paper's nine units count in addition to the lab's own")
    ] = True
    between_labs: Annotated[
        float, Meta(ge=0, le=100, description="expected scatter of the level between labs, over that between units")
    ] = BETWEEN_LABS
    between_batches: Annotated[
        float, Meta(ge=0, le=100, description="expected scatter of the level between batches, over that between units")
    ] = BETWEEN_BATCHES
    instrument: InstrumentTable | None = None
    contributor: ContributorTable | None = None
    materials: dict[str, MaterialEntry] = field(default_factory=dict)
    unit: Annotated[tuple[FitUnitTable, ...], Meta(min_length=1, max_length=1000)]


@dataclass(frozen=True)
class LabUnit:
    """A measured unit: its spec as asked and as built, frequency (Hz, None: the spec's), and level.

    `lab`: the lab that measured it, None for the file's own. `batch`: the casting, None for one of its own. `cast`: its
    cast record; `walls_measured`: whether that has the unit's walls.
    """

    name: str
    lab: str | None
    batch: str | None
    spec: Spec
    built: Spec
    frequency_hz: float | None
    level: LevelTable
    source: str
    cast: str | None = None
    walls_measured: bool = False

    @property
    def error(self) -> float:
        """The standard error of ln level; 0 if no interval is given: it is then part of the model error."""
        if self.level.low is None or self.level.high is None:
            return 0.0
        return float(np.log(self.level.high / self.level.low)) / (2 * _TWO_SIDED)


@dataclass(frozen=True)
class FitLab:
    """A validated lab: settings, units, the files that were read, and the findings in recordings."""

    settings: FitLabFile
    units: tuple[LabUnit, ...]
    inputs: tuple[InputFile, ...]
    findings: tuple[LabFinding, ...] = ()

    @property
    def labs(self) -> tuple[str, ...]:
        """The names of the labs by their numbers: this one, the paper's, and the others as the file has them."""
        others = dict.fromkeys(unit.lab for unit in self.units if unit.lab not in (None, PAPER_LAB))
        return self.settings.name, PAPER_LAB, *filter(None, others)

    @property
    def batches(self) -> tuple[tuple[str | None, str], ...]:
        """The batches by their numbers, each with its lab."""
        return tuple(dict.fromkeys((unit.lab, unit.batch) for unit in self.units if unit.batch is not None))


def load_fit_lab(source: str) -> FitLab:
    """Return the lab of a file (a path separator or .toml in `source`) or a shipped one (a bare name).

    Raises Refusal with every value that is not valid, and its line, or UnitcadError.
    """
    return load_file(source, "fit", _lab_of)


@dataclass(frozen=True)
class _Sources:
    """The folder of a lab's file, its own silicones by path, the files read so far, and the campaigns measured."""

    folder: Path
    entries: Mapping[str, Any]
    inputs: dict[str, str]
    campaigns: dict[str, Measured]

    def read(self, name: str, field: str) -> Path:
        """Return the path of a file and note its hash. Raises Refusal if there is none."""
        path = file_of(self.folder, name, field)
        self.inputs[name] = files.sha256(path)
        return path

    def campaign(self, name: str, field: str) -> Measured:
        """Return a campaign measured, once. Raises Refusal for a file that can't be read."""
        if name not in self.campaigns:
            path = self.read(name, field)
            try:
                found = measure(read_campaign(path), path.parent)
            except Refusal as refusal:
                raise Refusal(field, name, str(refusal)) from None
            self.campaigns[name] = found
            for record in (one for several in found.records.values() for one in several):
                self.inputs[(Path(name).parent / record.file).as_posix()] = record.sha256
        return self.campaigns[name]


def _lab_of(data: dict[str, Any], path: Path) -> FitLab:
    settings = convert(data, FitLabFile)
    names = [unit.name for unit in settings.unit]
    entries = {f"materials.{name}": entry for name, entry in data.get("materials", {}).items()}
    sources = _Sources(path.parent, entries, {path.name: files.sha256(path)}, {})
    units = []
    for i, table in enumerate(settings.unit):
        if table.name in names[:i]:
            raise Refusal(f"unit.{i}.name", table.name, "is the name of two units")
        lab = None if table.lab == settings.name else table.lab
        units.append(_unit(f"unit.{i}", table, lab, sources))
    inputs = tuple(InputFile(file=f, sha256=h) for f, h in sorted(sources.inputs.items()))
    findings = tuple(one for measured in sources.campaigns.values() for one in measured.findings)
    return FitLab(settings, tuple(units), inputs, findings)


def _unit(where: str, table: FitUnitTable, lab: str | None, sources: _Sources) -> LabUnit:
    if sum(one is not None for one in (table.level, table.measured, table.recordings)) != 1:
        raise Refusal(f"{where}.level", None, "is required, or measured, or recordings; one of them")
    asked, built, source, walls = _specs(where, table, sources.folder, sources.entries)
    if source:
        sources.read(source, where)
    level, hertz, said, field = table.level, table.frequency_hz, "as typed", f"{where}.level"
    if table.measured is not None:
        field = f"{where}.measured"
        level, measured_hz, chain = _measured(field, table, sources.read(table.measured, field))
        hertz, said = hertz or measured_hz, f"{table.measured}, chain {chain}"
    elif table.recordings is not None:
        field = f"{where}.recordings"
        level, measured_hz, chain = _recorded(field, table, sources.campaign(table.recordings, field))
        hertz, said = hertz or measured_hz, f"{table.recordings}, chain {chain}"
    assert level is not None
    if (level.low is None) != (level.high is None):
        missing = "low" if level.low is None else "high"
        raise Refusal(f"{field}.{missing}", None, "is required together with the other end")
    if level.low is not None and level.high is not None and not level.low <= level.value <= level.high:
        raise Refusal(f"{field}.value", level.value, f"must be from low {level.low:g} to high {level.high:g}")
    if walls:
        said += f", walls as measured, {', '.join(f'{layer.wall_mm:.3g}' for layer in built.layers)} mm"
    batch = table.batch or table.cast
    return LabUnit(table.name, lab, batch, asked, built, hertz, level, said, table.cast, walls)


def _recorded(where: str, table: FitUnitTable, found: Measured) -> tuple[LevelTable, float, str]:
    """Return level, frequency and chain of a unit's edge in a measured campaign, by its first chain."""
    chain = found.campaign.chain.use[0]
    edges = {one.unit: one for one in found.levels if one.distance_mm == 0 and one.chain == chain}
    if table.name not in found.records:
        raise unknown_name(f"{where} (unit)", table.name, [unit.name for unit in found.campaign.unit])
    if table.name not in edges:
        reasons = [one for one in found.findings if one.where.startswith(f"{table.name}, ")] or found.findings
        reason = f": {reasons[0].message}" if reasons else ""
        raise Refusal(where, table.recordings, f"gives no level at the edge of {table.name}{reason}")
    one = edges[table.name]
    return LevelTable(value=one.level.value, low=one.level.low, high=one.level.high), one.frequency_hz, chain


def _specs(
    where: str, table: FitUnitTable, folder: Path, entries: Mapping[str, Any]
) -> tuple[Spec, Spec, str | None, bool]:
    """Return a unit's spec as asked and as built, the file that defines it (None: a template), and whether its walls
    are measured.

    The spec as built has the walls that the cast record measured, the mean of their places.
    """
    if table.spec is not None and table.cast is not None:
        raise Refusal(f"{where}.cast", table.cast, "excludes spec; leave one out")
    if table.cavity is not None and table.cast is None:
        raise Refusal(f"{where}.cavity", table.cavity, "is of a cast record, but there is no cast")
    if table.cast is not None:
        if table.set:
            raise Refusal(f"{where}.set", dict(table.set), "excludes cast: the record has the spec that was cast")
        asked, built, walls = _cast_specs(where, table, table.cast, folder, entries)
        return asked, built, table.cast, walls
    if table.spec is None:
        raise Refusal(f"{where}.spec", None, "is required, or cast")
    known, own = templates() | custom_templates(), is_path(table.spec)
    if own:
        file_of(folder, table.spec, f"{where}.spec")
    elif table.spec not in known:
        raise unknown_name(f"{where}.spec", table.spec, known)
    data = read(folder / table.spec if own else table.spec)
    check_plain(data)
    for path, entry in entries.items():
        put(data, path, entry)
    try:
        for path, value in table.set.items():
            put(data, path, value)
        spec = from_data(data, folder)
    except Refusal as refusal:
        raise type(refusal)(f"{where}.{refusal.field}", refusal.value, refusal.limit, refusal.nearest) from None
    return spec, spec, table.spec if own else None, False


def _cast_specs(
    where: str, table: FitUnitTable, name: str, folder: Path, entries: Mapping[str, Any]
) -> tuple[Spec, Spec, bool]:
    """Return the spec of a cast record, the same with the walls of the unit that is meant, and whether it has any."""
    field = f"{where}.cast"
    path = file_of(folder, name, field)
    try:
        record = read_cast_record(path)
    except UnitcadError as error:
        raise Refusal(field, name, str(error)) from None
    unit = _cavity(f"{where}.cavity", record, table.cavity, name)
    if record.spec is None:
        raise Refusal(field, name, "spec: is required here: the resolved spec as a table")
    data = copy.deepcopy(record.spec)
    try:
        for key, entry in entries.items():
            put(data, key, entry)
        asked = from_data(data)
        count, known = len(asked.layers), materials(asked.materials)
        for wall in unit.walls if unit else ():
            if wall.layer > count:
                raise Refusal("units.walls.layer", wall.layer, f"the spec has {count} layers", count)
            put(data, f"layers.{wall.layer - 1}.wall_mm", float(np.mean(wall.places_mm)))
        for i, pour in enumerate(record.pours):
            own = asked.layers[pour.index - 1].material if pour.index <= count else pour.material
            if pour.material in known and pour.material != own:
                limit = f"the record's own spec has {own} in layer {pour.index}"
                raise Refusal(f"pours.{i}.material", pour.material, limit)
        return asked, from_data(data), bool(unit and unit.walls)
    except Refusal as refusal:
        raise Refusal(field, name, str(refusal)) from None


def _cavity(field: str, record: CastRecord, cavity: int | None, name: str) -> CastUnit | None:
    """Return the unit of a cast record that is meant; None if nobody looked at any."""
    units = {one.cavity: one for one in record.units}
    usable = [one for one in record.units if one.usable]
    nearest = min((one.cavity for one in usable), key=lambda other: abs(other - (cavity or 0)), default=None)
    if cavity is not None:
        unit = units.get(cavity)
        if unit is None and units:
            raise Refusal(field, cavity, f"{name} has no such unit; it has {some(units)}", nearest)
    elif len(units) > 1 and len(usable) != 1:
        raise Refusal(field, None, f"is required: {name} has the cavities {some(units)}")
    else:
        unit = next(iter([*usable, *record.units]), None)
    if unit is not None and not unit.usable:
        raise Refusal(field, unit.cavity, f"{name} says that this unit is not usable", nearest)
    return unit


def _measured(where: str, table: FitUnitTable, path: Path) -> tuple[LevelTable, float, str]:
    """Return level, frequency and chain of a unit's edge in a file of `unitcad measure`, by its first chain."""
    data = read_toml(path)
    chain, rows = data.get("chain"), data.get("level")
    if data.get("status") != "measured" or not isinstance(rows, list):
        raise Refusal(where, table.measured, "is no file of unitcad measure")
    edges = [row for row in rows if isinstance(row, dict) and row.get("distance_mm") == 0 and row.get("chain") == chain]
    row = next((row for row in edges if row.get("unit") == table.name), None)
    if row is None:
        raise unknown_name(f"{where} (unit)", table.name, [str(row.get("unit")) for row in edges])
    level = convert({key: row[key] for key in ("value", "low", "high") if key in row}, LevelTable)
    hertz = row.get("frequency_hz")
    if not isinstance(hertz, int | float):
        raise Refusal(f"{where}.frequency_hz", hertz, "must be a number")
    return level, float(hertz), str(chain)


LEAST_ALONE = 6
"""Units of a lab without the paper's: with one left out and four class means fitted, one degree of freedom remains."""
_WIDEST = 10.0
"""Largest half-width of a range of ln constant that is written: beyond it the units say nothing of the constant."""
_SIDES = 0.95
"""Quantile at the upper end of a constant's range, 90 % wide."""


@dataclass(frozen=True)
class Fitted:
    """The study of a lab: all units, each model judged on them, the model that leads, and the fit for an estimate."""

    lab: FitLab
    campaigns: Campaigns
    judged: dict[str, Judged]
    leading: MixedFit
    fit: LabFit


def fit_lab(lab: FitLab, say: Callable[[str], None] = lambda stage: None) -> Fitted:
    """Judge and fit every model with the lab's units. Raises Refusal for units that can't be fitted."""
    settings = lab.settings
    if not settings.include_paper_units and len(lab.units) < LEAST_ALONE:
        limit = f"{len(lab.units)} units; without the paper's {LEAST_ALONE} are needed"
        raise Refusal("unit", None, limit)
    say("models")
    inputs = []
    for unit in lab.units:
        data = to_data(unit.built)
        data["estimate"]["moduli"] = settings.moduli
        inputs.append(estimate_input(from_data(data), unit.frequency_hz))
    for i, one in enumerate(inputs):
        for at, layer in enumerate(one.layers):
            if not layer.youngs_modulus.known:
                limit = f"unit.{i}.layers.{at}: {layer.material}: no modulus is known"
                raise Refusal("moduli", settings.moduli, limit)
    campaigns = campaigns_of(lab, inputs)
    judged = {name: judge(model, campaigns) for name, model in COMPARED.items()}
    fitted = {name: mixed_fit(model, campaigns) for name, model in COMPARED.items()}
    bounds = {name: _at_bound(name, campaigns, one.constants) for name, one in fitted.items()}
    errors = {name: np.abs(one.errors[one.own]) for name, one in judged.items()}
    leads = RULE
    if campaigns.own.any():
        leads = leader({name: one for name, one in errors.items() if name == RULE or not bounds[name]})
    model, constants, measured = COMPARED[leads], fitted[leads].constants, []
    for unit, built in zip(lab.units, inputs, strict=True):
        variant, level = estimate_input(unit.spec, unit.frequency_hz), unit.level
        predicted = float(model.logs(nominal(built), constants)[0])
        measured.append(
            OwnLevel(
                unit=unit.name, key=unit_key(variant), value=level.value, low=level.low, high=level.high,
                frequency_hz=variant.frequency.middle, source=unit.source,
                place=rounded(coordinates_of(built).tolist(), 6),
                residual=float(f"{np.log(level.value) - predicted:.6g}"),
                features=sorted({feature.name for feature in built.features}), lab=unit.lab,
            )
        )  # fmt: skip
    fit = LabFit(
        format=1, name=settings.name, units=int(campaigns.own.sum()), moduli=settings.moduli,
        include_paper_units=settings.include_paper_units,
        between_labs=settings.between_labs, between_batches=settings.between_batches, seed=SEED, leads=leads,  # pyright: ignore[reportArgumentType]
        model={name: _entry(name, campaigns, judged, one, bounds[name]) for name, one in fitted.items()},
        measured=measured, input=list(lab.inputs),
    )  # fmt: skip
    return Fitted(lab, campaigns, judged, fitted[leads], fit)


def _at_bound(name: str, campaigns: Campaigns, constants: np.ndarray) -> str | None:
    """Return a constant of a model that the units do not determine, None if they determine all.

    None of the units reads it, or all read it alike with another constant.
    """
    read = gradients(COMPARED[name], campaigns.table, constants)
    unread = ~read.any(axis=0)
    if name == BASELINE or (not unread.any() and np.linalg.matrix_rank(read) == read.shape[1]):
        return None
    return COMPARED[name].names[int(np.argmax(unread)) if unread.any() else -1]


def campaigns_of(lab: FitLab, inputs: list[EstimateInput]) -> Campaigns:
    """Return the paper's units, if they are wanted, and the lab's own after them."""
    paper = measured_table(lab.settings.moduli)
    paper = paper.rows(list(range(len(paper.names))) if lab.settings.include_paper_units else [])
    table = MeasuredTable(
        (*paper.names, *(unit.name for unit in lab.units)),
        (*paper.designs, *(CONTROL if len(v.layers) == 1 else v.design for v in inputs)),
        (*paper.layers, *(tuple(layer.material for layer in v.layers) for v in inputs)),
        np.array([*paper.levels, *(unit.level.value for unit in lab.units)]),
        (*paper.inputs, *(nominal(variant) for variant in inputs)),
    )
    nine = len(paper.names)
    others = lab.labs
    labs = [PAPER] * nine + [others.index(unit.lab, PAPER) if unit.lab else OWN for unit in lab.units]
    batches = lab.batches
    numbers = [-1] * nine + [batches.index((unit.lab, unit.batch)) if unit.batch else -1 for unit in lab.units]
    error = np.array([*(0.0 for _ in paper.names), *(unit.error for unit in lab.units)])
    stored = np.arange(len(table.names)) < nine
    settings = lab.settings
    return Campaigns(
        table, np.array(labs), np.array(numbers), stored, error, settings.between_labs, settings.between_batches
    )


def _entry(
    name: str, campaigns: Campaigns, all_judged: Mapping[str, Judged], found: MixedFit, at_bound: str | None
) -> ModelFit:
    model, judged = COMPARED[name], all_judged[name]
    spread = stdtrit(found.df, _SIDES) * found.sigma * np.sqrt(np.diag(found.covariance))
    wide = np.exp(np.minimum(spread, _WIDEST))
    stored = campaigns.stored
    constants = {"constants": found.constants, "low": found.constants / wide, "high": found.constants * wide}
    constants["stored"] = model.fit(campaigns.table, stored[None].astype(float))[0] if stored.any() else ()
    resampled = bootstrap_range(np.abs(judged.errors))
    against, error, p = paired_difference(judged, all_judged[BASELINE]) if name != BASELINE else (None, None, None)
    numbers = {
        **{key: dict(zip(model.names, map(float, values), strict=False)) for key, values in constants.items()},
        "model_error": found.sigma, "covariance": found.covariance.tolist(), "leave_one_out": judged.score,
        "leave_one_out_low": resampled.low, "leave_one_out_high": resampled.high, "own_leave_one_out": judged.own_score,
        "own_by_stored": judged.stored_score, "against_baseline": against, "against_baseline_error": error,
        "against_baseline_p": p,
    }  # fmt: skip
    return ModelFit(
        degrees_of_freedom=found.df,
        coverage=f"{judged.coverage} of {judged.errors.size}",
        at_bound=at_bound,
        **rounded(numbers, 6),
    )
