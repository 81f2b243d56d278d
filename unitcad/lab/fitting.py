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
from unitcad.lab.campaign import File, Name, file_of
from unitcad.lab.shrunk_fit import BETWEEN_LABS, Campaigns, Judged, Shrunk, gradients, judge, paired_difference, shrunk
from unitcad.spec import Spec, check_plain, convert, to_data
from unitcad.spec.raw import Table
from unitcad.text import some
from unitcad.validation import custom_templates, from_data, put, read, templates
from unitcad.validation.load import is_path, load_file

LevelValue = Annotated[float, Meta(ge=1e-6, le=1e3, description="amplitude at the edge over the motor's")]
_TWO_SIDED = 1.96
"""Half-width of a 95 % interval in standard errors."""


class LevelTable(Table, frozen=True, kw_only=True):
    """A level and its 95 % interval."""

    value: LevelValue
    low: Annotated[LevelValue | None, Meta(description="lower end of the 95 % interval")] = None
    high: Annotated[LevelValue | None, Meta(description="upper end of the 95 % interval")] = None


class FitUnitTable(Table, frozen=True, kw_only=True):
    """One measured unit: its spec or cast record, and its level or the file with the level."""

    name: Annotated[Name, Meta(description="a name of the unit")]
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
        float, Meta(ge=0, le=100, description="scatter of a constant between labs, over that between units")
    ] = BETWEEN_LABS
    materials: dict[str, MaterialEntry] = field(default_factory=dict)
    unit: Annotated[tuple[FitUnitTable, ...], Meta(min_length=1, max_length=1000)]


@dataclass(frozen=True)
class OwnUnit:
    """A measured unit of the lab: its spec as asked and as built, frequency (Hz, None: the spec's), and level."""

    name: str
    spec: Spec
    built: Spec
    frequency_hz: float | None
    level: LevelTable
    source: str

    @property
    def error(self) -> float:
        """The standard error of ln level; 0 if no interval is given: it is then part of the model error."""
        if self.level.low is None or self.level.high is None:
            return 0.0
        return float(np.log(self.level.high / self.level.low)) / (2 * _TWO_SIDED)


@dataclass(frozen=True)
class FitLab:
    """A validated lab: settings, units, and the files that were read."""

    settings: FitLabFile
    units: tuple[OwnUnit, ...]
    inputs: tuple[InputFile, ...]


def load_fit_lab(source: str) -> FitLab:
    """Return the lab of a file (a path separator or .toml in `source`) or a shipped one (a bare name).

    Raises Refusal with every value that is not valid, and its line, or UnitcadError.
    """
    return load_file(source, "fit", _lab_of)


def _lab_of(data: dict[str, Any], path: Path) -> FitLab:
    settings = convert(data, FitLabFile)
    names = [unit.name for unit in settings.unit]
    inputs = {path.name: files.sha256(path)}
    entries = {f"materials.{name}": entry for name, entry in data.get("materials", {}).items()}
    units = []
    for i, table in enumerate(settings.unit):
        if table.name in names[:i]:
            raise Refusal(f"unit.{i}.name", table.name, "is the name of two units")
        units.append(_unit(f"unit.{i}", table, path.parent, entries, inputs))
    return FitLab(settings, tuple(units), tuple(InputFile(file=f, sha256=h) for f, h in sorted(inputs.items())))


def _unit(where: str, table: FitUnitTable, folder: Path, entries: Mapping[str, Any], inputs: dict[str, str]) -> OwnUnit:
    if (table.level is None) == (table.measured is None):
        raise Refusal(f"{where}.level", None, "is required, or measured; not both")
    asked, built, source = _specs(where, table, folder, entries)
    if source:
        inputs[source] = files.sha256(folder / source)
    level, hertz, said, field = table.level, table.frequency_hz, "as typed", f"{where}.level"
    if table.measured is not None:
        field = f"{where}.measured"
        path = file_of(folder, table.measured, field)
        level, measured_hz, chain = _measured(field, table, path)
        inputs[table.measured] = files.sha256(path)
        hertz, said = hertz or measured_hz, f"{table.measured}, chain {chain}"
    assert level is not None
    if (level.low is None) != (level.high is None):
        missing = "low" if level.low is None else "high"
        raise Refusal(f"{field}.{missing}", None, "is required together with the other end")
    if level.low is not None and level.high is not None and not level.low <= level.value <= level.high:
        raise Refusal(f"{field}.value", level.value, f"must be from low {level.low:g} to high {level.high:g}")
    if asked.layers != built.layers:
        said += f", walls as measured, {', '.join(f'{layer.wall_mm:.3g}' for layer in built.layers)} mm"
    return OwnUnit(table.name, asked, built, hertz, level, said)


def _specs(where: str, table: FitUnitTable, folder: Path, entries: Mapping[str, Any]) -> tuple[Spec, Spec, str | None]:
    """Return a unit's spec as asked, the spec as built, and the file that defines it, None for a template.

    The spec as built has the walls that the cast record measured, the mean of their places.
    """
    if table.spec is not None and table.cast is not None:
        raise Refusal(f"{where}.cast", table.cast, "excludes spec; leave one out")
    if table.cavity is not None and table.cast is None:
        raise Refusal(f"{where}.cavity", table.cavity, "is of a cast record, but there is no cast")
    if table.cast is not None:
        if table.set:
            raise Refusal(f"{where}.set", dict(table.set), "excludes cast: the record has the spec that was cast")
        return *_cast_specs(where, table, table.cast, folder, entries), table.cast
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
    return spec, spec, table.spec if own else None


def _cast_specs(
    where: str, table: FitUnitTable, name: str, folder: Path, entries: Mapping[str, Any]
) -> tuple[Spec, Spec]:
    """Return the spec of a cast record, and the same with the measured walls of the unit that is meant."""
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
        return asked, from_data(data)
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
    """The study of a lab: all units, each model judged on them, and the fit for an estimate."""

    lab: FitLab
    campaigns: Campaigns
    judged: dict[str, Judged]
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
    fitted = {name: shrunk(model, campaigns) for name, model in COMPARED.items()}
    bounds = {name: _at_bound(name, campaigns, one.constants) for name, one in fitted.items()}
    errors = {name: np.abs(one.errors[one.own]) for name, one in judged.items()}
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
                features=sorted({feature.name for feature in built.features}),
            )
        )  # fmt: skip
    fit = LabFit(
        format=1, name=settings.name, units=len(lab.units), moduli=settings.moduli,
        include_paper_units=settings.include_paper_units,
        between_labs=settings.between_labs, seed=SEED, leads=leads,  # pyright: ignore[reportArgumentType]
        model={name: _entry(name, campaigns, judged, one, bounds[name]) for name, one in fitted.items()},
        measured=measured, input=list(lab.inputs),
    )  # fmt: skip
    return Fitted(lab, campaigns, judged, fit)


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
    own = np.arange(len(table.names)) >= len(paper.names)
    error = np.array([*(0.0 for _ in paper.names), *(unit.error for unit in lab.units)])
    return Campaigns(table, own, error, lab.settings.between_labs)


def _entry(
    name: str, campaigns: Campaigns, all_judged: Mapping[str, Judged], found: Shrunk, at_bound: str | None
) -> ModelFit:
    model, judged = COMPARED[name], all_judged[name]
    spread = stdtrit(found.df, _SIDES) * found.sigma * np.sqrt(np.diag(found.covariance))
    wide = np.exp(np.minimum(spread, _WIDEST))
    paper = ~campaigns.own
    constants = {"constants": found.constants, "low": found.constants / wide, "high": found.constants * wide}
    constants["stored"] = model.fit(campaigns.table, paper[None].astype(float))[0] if paper.any() else ()
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
