"""The sentences of an answer: the one line that every command and page prints, the lines after it, and the details.

Brackets have the 80 % range. A level is in per cent of the motor's amplitude.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

from unitcad.attenuation.edge.answer import MOST, PAPER, Answer, Measured, ModelLevel
from unitcad.attenuation.edge.models import RULE
from unitcad.catalogue import measurements
from unitcad.text import join_words, number

LEAST = 1e-4
"""Levels below it are not printed as numbers."""
ANY_FORM = "a factor of about 1.3 to 1.4, whatever the form of the rule"
"""Leave-one-out error of the rules and class means that were tried on the nine units."""
NO_EFFECT = "within the range: no effect shown"
ALIKE = ", all units alike"
"""After the name of the leading model: without the share of the measured units' own errors that the answer has."""
BRACKETS = (
    "The answer is the leading model with a share of the own errors of measured units near this one; "
    "'all units alike' is without it. In brackets: of the answer its 80 % range, of a model the ends of its inputs' "
    "ranges."
)
NOT_COMPARED = "not compared: a level is not known"
SURFACE = (
    "The paper does not state on which surface or along which axis it measured. The rule is fitted to its levels as "
    "they are. The analytic model is the normal motion of the skin at the edge (|u_z|, equation 5b)."
)
ASSUMED = (
    "The analytic model assumes plane waves through the walls, each side as thick as a half-space, and no way back."
)


def first_line(one: Answer) -> str:
    """Return the level with its range, and the measurement of this unit, or what makes the range wider."""
    if one.low is None or one.high is None:
        return f"No level at the edge: {one.reason}."
    if one.level is None:
        ends = f"{spread(one.low, one.high)} of the motor's amplitude"
        head = f"No level at the edge: {one.reason}, {ends}."
    else:
        ends = spread(one.low, one.high).removesuffix(" %")
        head = f"Level at the edge: {percent(one.level)} of the motor's amplitude ({ends})."
    return " ".join([head, *_besides(one)])


def _besides(one: Answer) -> Iterator[str]:
    if one.wider:
        yield f"Wider range: no measured unit had its {join_words(one.wider)}."
    for measured in one.measured[:1]:
        where = "in the paper for this unit" if measured.by == PAPER else f"on {measured.by}"
        yield f"Measured {where}: {_measured(measured)}."
    if not one.measured and not one.wider:
        yield "This unit was not measured."
    if one.above is not None:
        yield f"The highest measured level is {percent(one.above)}."
    if ratio := one.printed.get("over_a_control_not_named"):
        controls = [float(level) for level in measurements().controls.values()]
        ends = spread(ratio * min(controls), ratio * max(controls))
        yield f"The paper prints {number(100 * ratio, 4)} % of a control that it does not name: {ends}."
    if direction := one.printed.get("direction_stated"):
        yield f"The paper states of this unit: {direction}."


def lines(one: Answer) -> list[str]:
    """Return the lines of an estimate: the level, the model behind it and its error, the paper's model."""
    source = [] if one.low is None else [source_line(one)]
    return [first_line(one), *source, analytic_line(one)]


def source_line(one: Answer) -> str:
    """Return the model behind the level, the units that it is fitted to, and its error."""
    source = one.source
    model = "a rule" if source.model == RULE else f"the model {source.model}"
    if source.lab is None:
        units = f"{source.units} measured units"
    else:
        parts = [f"{source.units} units of {source.lab}"]
        parts += [f"{source.of_others} of other labs"] if source.of_others else []
        parts += ["the 9 of the paper"] if source.with_paper else []
        units = join_words(parts)
    error = f"a factor of {_factor(source.error)}" if source.lab or source.model != RULE else ANY_FORM
    return f"The level is that of {model} fitted to {units}. It misses a unit that it was not fitted to by {error}."


def analytic_line(one: Answer) -> str:
    """Return the level by the paper's analytic model, and its error."""
    if one.published.low is None:
        if one.published.reason == one.reason:  # the line of the level has it
            return "The paper's analytic model gives no number either."
        return f"The paper's analytic model gives no number: {one.published.reason}."
    error = f"a factor of {_factor(one.analytic_error)}"
    return f"The paper's analytic model gives {model_level(one.published)}. It misses a measured unit by {error}."


def effect(one: Answer, before: Answer) -> str:
    """Return the factor between two levels, or that their ranges show none."""
    if one.level is None or before.level is None:
        return NOT_COMPARED
    inside = [
        own.low is None or own.high is None or own.low <= (other.level or 0.0) <= own.high
        for own, other in ((one, before), (before, one))
    ]
    return NO_EFFECT if any(inside) else f"a factor of {number(one.level / before.level, 2)}"


def comparison(named: Sequence[tuple[str, Answer]]) -> list[dict[str, str]]:
    """Return a row of a table for each of several units: level and range, measurement, and the effect on the level.

    The effect is against the first unit. Keys are the heads of the columns.
    """
    first, before = named[0]
    rows = [
        {
            "unit": name,
            "level, % (80 % range)": cell(one),
            "measured, %": _measured(one.measured[0]).replace(" %", "") if one.measured else "-",
            f"against {first}": "-" if one is before else effect(one, before),
        }
        for name, one in named
    ]
    if any(one.wider for _, one in named):
        for row, (_, one) in zip(rows, named, strict=True):
            row["no measured unit had its"] = join_words(one.wider) if one.wider else "-"
    return rows


def cell(one: Answer) -> str:
    """Return level and range for a table, without the unit."""
    return level_cell(one.level, one.low, one.high)


def level_cell(level: float | None, low: float | None, high: float | None) -> str:
    """Return a level and the ends of its range for a table, in per cent, without the unit."""
    if low is None or high is None:
        return "not known"
    ends = spread(low, high).removesuffix(" %")
    return ends if level is None else f"{percent(level).removesuffix(' %')} ({ends})"


def percent(level: float) -> str:
    """Return a fraction in per cent, with two digits."""
    return f"{number(100 * level, 2, zeros=True)} %" if level >= LEAST else f"below {100 * LEAST:g} %"


def spread(low: float, high: float) -> str:
    """Return two fractions as a range in per cent; one number if both round to the same."""
    first, last = percent(low), percent(high) if high <= MOST else f"over {percent(MOST)}"
    return last if first == last else f"{first.removesuffix(' %')} to {last}"


def model_level(one: ModelLevel) -> str:
    """Return another model's level, its range if it has no value."""
    if one.value is not None:
        return percent(one.value)
    return "not known" if one.low is None or one.high is None else spread(one.low, one.high)


def _measured(one: Measured) -> str:
    ends = (
        "" if one.low is None or one.high is None else f" ({number(100 * one.low, 3)} to {number(100 * one.high, 3)})"
    )
    return f"{percent(one.level) if one.by == PAPER else f'{number(100 * one.level, 3)} %'}{ends}"


def _factor(error: float) -> str:
    return number(error, 2, zeros=True)


def details(one: Answer, layers: int, moduli: str, bounds: dict[str, str]) -> Iterator[str]:
    """Say how sure the answer is: errors, other measurements, the nearest unit, what the rule can't tell apart."""
    source = one.source
    units = f"the units of {source.lab}" if source.lab else "the nine measured units"
    worst = f", at worst {_factor(source.worst)} ({source.worst_at})" if source.worst else ""
    yield (
        f"Leave-one-out error of {source.model} on {units}: a factor of {_factor(source.error)}{worst}. "
        f"The means of four classes: {_factor(source.baseline)}."
    )
    if source.coverage is not None:
        knows = " The range above also uses this unit's own level, so it is narrower." if one.measured else ""
        yield f"Coverage of the 80 % range: {source.coverage} of 9 measured units, each predicted without it.{knows}"
    if one.elsewhere:
        yield f"{PAPER.capitalize()} measured {percent(one.elsewhere[0].level)} for this unit, in its own lab."
    if others := [f"{number(100 * other.level, 3)} %" for other in one.measured[1:]]:
        yield f"Also measured: {join_words(others)}."
    if not one.measured:
        near = one.nearest
        differs = f" This unit differs in {join_words(near.differs_in)}." if near.differs_in else ""
        yield f"Nearest measured unit: {near.unit}, {number(100 * near.level, 3)} %.{differs}"
    yield f"Mean of its class ({one.kind}): {number(100 * one.kind_mean, 3)} %."
    if layers == 1:
        yield "The rule gives every one-material unit the same level; 39.5, 45.2 and 60.2 % were measured."
    yield (
        f"The paper's analytic model by this unit's moduli ({moduli}): {model_level(one.published)} as published, "
        f"{model_level(one.corrected)} with complex moduli. {ASSUMED}"
    )
    yield SURFACE
    for model, constant in bounds.items():
        yield f"{model}: the units of the fit do not determine {constant}."


def skin_lines(layered: dict[str, Any], places_mm: tuple[int, ...] = (5, 10, 20)) -> Iterator[str]:
    """Say how the skin's motion decays beyond the edge."""
    drive = (layered.get("drives") or {}).get(layered.get("drive"))
    if drive is None:
        return
    places = [(r, layered["r_mm"].index(r)) for r in places_mm if r in layered["r_mm"]]
    ends = {r: spread(drive["u"]["low"][i], drive["u"]["high"][i]).removesuffix(" %") for r, i in places}
    told = [f"{percent(drive['u']['value'][i])} ({ends[r]}) after {r} mm" for r, i in places]
    yield f"On the skin ({layered['tissue']}), of the motion at the edge: {join_words(told)}."
    if short := layered["not_reached"]:
        yield f"The skin's curve does not reach its accuracy. {'. '.join(short)}."
    if "far" in layered:
        yield layered["far"]
