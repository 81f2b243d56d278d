"""`unitcad estimate`: the attenuation estimate of one or more specs, as tables for a person or as JSON."""

from __future__ import annotations

import math
import re
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Column, Table
from rich.text import Text

from unitcad.attenuation.edge.models import MODELS
from unitcad.catalogue import FREQUENCIES_HZ
from unitcad.cli.output import console, print_json, progress, warn
from unitcad.cli.shared_options import AsJson, Fit, Sets, with_fit
from unitcad.designs import design_of
from unitcad.errors import Refusal, unknown_name
from unitcad.estimate_inputs import FEM, estimate_spec, frequency_table_of_spec
from unitcad.moulds.plan import plan
from unitcad.rooms import load as load_named
from unitcad.spec import Spec
from unitcad.text import join_words, number
from unitcad.validation import compound_kind, confirm_known, load


def print_estimate(data: dict[str, Any], details: bool = False) -> None:
    """Print the two lines of the answer; with `details` its basis: models, curve, slopes, assumptions.

    The range by finite elements exists only on request; it is always shown.
    """
    screen = console()
    variant = data["variant"]
    layers = " / ".join(layer["material"] for layer in variant["layers"])
    rest = f": {variant['design']}, {layers}, {level(variant['frequency_hz'], digits=4)} Hz"
    screen.print(Text.assemble((variant["name"], "bold"), rest), soft_wrap=True)
    for line in [*data["answer"]["lines"], *(data["answer"]["details"] if details else [])]:
        screen.print(f"  {line}", soft_wrap=True)
    if "fem" in data:
        if data["fem"]["levels"]:
            screen.print(_fem(data["fem"]))
        for line in _fem_lines(data["fem"]):
            screen.print(f"  {line}", soft_wrap=True)
    if details:
        _print_details(screen, data)


def _print_details(screen: Console, data: dict[str, Any]) -> None:
    """Print the models side by side, the layered curve, the inputs that count, the paper's constraints and readings."""
    if data["models"]:
        screen.print(_models(data))
        if "fit" in data:
            screen.print(_fit_line(data["fit"]), soft_wrap=True)
    screen.print(_curve(data["layered"]))
    screen.print(f"  {data['layered']['u_definition']}", soft_wrap=True)
    inputs = _inputs(data)
    if inputs:
        screen.print(inputs[0])
        screen.print(f"  {_SLOPES}", soft_wrap=True)
        if inputs[1]:
            screen.print(f"  {inputs[1]}", soft_wrap=True)
    published = data["models"].get("published", {})
    if published.get("constraints"):
        screen.print(_coefficients(published["interfaces"], published["coefficients"]))
        screen.print(_constraints(published["constraints"]))
    if published.get("readings") and published["readings"][0]["hierarchical_over_control"]:
        screen.print(_readings(published["readings"]))
    no_ratio = data["layered"]["hierarchical_over_control_reason"]
    for line in [f"No ratio to a control from the layered curve: {no_ratio}", *data["assumptions"]]:
        screen.print(f"  {line}", soft_wrap=True)


def print_errors(errors: dict[str, Any], models: dict[str, Any]) -> None:
    """Print the models' errors against the measured table, and by a lab's fit if the models' blocks have one."""
    screen = console()
    screen.print(_errors(errors))
    if fitted := {name: block["fit_error"] for name, block in models.items() if "fit_error" in block}:
        screen.print(_fit_errors(fitted))
    screen.print(_choice(errors["chosen_without"]), soft_wrap=True)
    screen.print(_classes(errors["leave_one_class_out"]["by_class"], errors["order"]))


def print_frequencies(data: dict[str, Any]) -> None:
    """Print a row per frequency: edge level by model; decay of the skin's motion by drive and distance."""
    rows, screen, name = data["frequencies"], console(), data["variant"]["name"]
    levels = Table("Hz", title=f"{name}: edge level, % of the motor's amplitude")
    for model in rows[0]["edge_level"]:
        levels.add_column(model)
    for row in rows:
        levels.add_row(f"{row['frequency_hz']:g}", *[level(one, 100) for one in row["edge_level"].values()])
    own = data["variant"]["motor_drive"]
    drives = (own, "axial" if own == "flat" else "flat")
    title = f"{name}: |u| of the skin, % of that at the edge, by mm from the edge; the motor's drive ({own}) first"
    decay = Table("Hz", title=title)
    for drive in drives:
        for place in rows[0][f"{drive}_over_edge"]:
            decay.add_column(f"{drive}\n{place.removeprefix('at_').replace('_', ' ')}")
    for row in rows:
        shown = [f"{100 * one:.3g}" for drive in drives for one in row[f"{drive}_over_edge"].values()]
        decay.add_row(f"{row['frequency_hz']:g}", *shown)
    if rows[0]["edge_level"]:
        screen.print(levels)
    if "fit" in data:
        fit = data["fit"]
        screen.print(f"  fit {fit['name']} ({fit['file']}, SHA-256 {fit['sha256'][:12]})", soft_wrap=True)
    screen.print(decay)


def _fem(block: dict[str, Any]) -> Table:
    """Tabulate each drive and reading over what is not known: all draws, then bonded and resting skin apart."""
    low, _, high = block["percent"]
    heads = ("drive", "read on", "skin", f"{low} %", "median", f"{high} %", "as drawn")
    table = Table(*heads, title="fem: edge level, %, over the draws")
    for one in block["levels"]:
        place = "skin, r = D/2" if one["reading"] == "skin" else "own edge"
        for name, group in {"both": one, **one["by_contact"]}.items():
            numbers = [f"{100 * group[key]:.3g}" for key in ("low", "median", "high")]
            numbers[1] += "" if group["median_error"] is None else f" (x/: {group['median_error']:.2f})"
            first = (one["drive"], place) if name == "both" else ("", "")
            table.add_row(*first, name, *numbers, f"{100 * one['drawn_as']:.3g}" if name == "both" else "")
        table.add_section()
    return table


def _fem_lines(block: dict[str, Any]) -> list[str]:
    """Say how to read the table of `fem`, or why it is empty."""
    if "reason" in block:
        return [block["reason"]]
    return [
        f"{block['draws']} draws, spread evenly. bonded: skin sticks to the unit; resting: it slides.",
        "x/: standard error of the median, a factor: times or divided by.",
        "as drawn: the unit of the spec, bonded, nominal values.",
        f"Not known, and drawn: {block['not_known']}.",
        "The level on the skin over that of the unit's own edge, as drawn: "
        + join_words(f"{number(100 * ratio, 2)} % ({drive})" for drive, ratio in block["skin_over_edge"].items())
        + ". The paper does not state which of the two it measured.",
    ]


def _models(data: dict[str, Any]) -> Table:
    """Tabulate the edge level, and its ratio to the control of each of the unit's materials."""
    blocks, measured = data["models"], data["measured"] or {}
    measured = measured if measured.get("same_size") else {}
    controls = [one["control"] for one in next(iter(blocks.values()))["hierarchical_over_control"] or []]
    fitted = data.get("fit")
    ranges = ["P10 to P90"] if fitted else []
    table = Table("model", "edge level %", *ranges, *[f"% of an all-{name} unit's" for name in controls])
    for name, block in blocks.items():
        ratios = [level(one, 100) for one in block["hierarchical_over_control"] or []]
        spread = [_predicted(block["predictive"])] if fitted else []
        table.add_row(name, level(block["edge_level"], 100), *spread, *ratios)
    answer = data["answer"]
    mean = f"{100 * answer['class_mean']:.3g} ({answer['class']})"
    table.add_row("baseline", mean, *["-"] * (len(ranges) + len(controls)))
    for own in data.get("own_measured", ()):
        shown = level(own, 100), f"{own['unit']}, {own['frequency_hz']:g} Hz"
        table.add_row("measured here", *shown, *["-"] * len(controls))
    if measured:
        levels = [measured[key] for key in ("level", "also_printed") if measured.get(key) is not None]
        ratios = {one["control"]: level(one, 100) for one in measured.get("hierarchical_over_control") or []}
        text = " and ".join(f"{100 * value:.4g}" for value in levels)
        table.add_row(
            "measured, paper" if fitted else "measured",
            text,
            *["-"] * len(ranges),
            *[ratios.get(name, "-") for name in controls],
        )
    return table


def _errors(errors: dict[str, Any]) -> Table:
    """Tabulate each model's error against the measured values, the least leave-one-out error first."""
    best = errors["order"][0]
    table = Table("model", "levels", "leave-one-out", f"p ({best})", "ratios", "directions", title=_ERRORS)
    for name in errors["order"]:
        error = errors[name]
        own = error["leave_one_out"]["levels"]
        p = error["against_best"]["p"]
        table.add_row(
            name,
            f"x {error['levels']['geometric_mean']:.2f}",
            f"x {own['geometric_mean']:.2f} ({own['range']['low']:.2f} to {own['range']['high']:.2f})",
            "-" if p is None else f"{p:.2g}",
            f"x {error['ratios']['geometric_mean']:.2f}",
            f"{error['directions']['right']} of {error['directions']['of']}",
        )
    return table


def _fit_errors(fitted: dict[str, Any]) -> Table:
    """Tabulate each model's error by the lab's fit, the best one first, and the baseline's."""
    names = ("model", "leave-one-out", "own units", "own, stored constants", "coverage")
    table = Table(*names, title="error by the lab's fit; the table above uses the stored constants")
    for name, error in sorted(fitted.items(), key=lambda pair: pair[1]["leave_one_out"]["geometric_mean"]):
        one = error["leave_one_out"]
        middle = f"x {one['geometric_mean']:.2f} ({one['low']:.2f} to {one['high']:.2f})"
        own = ["-" if error[key] is None else f"x {error[key]:.2f}" for key in ("own_leave_one_out", "own_by_stored")]
        table.add_row(name, middle, *own, error["coverage"] or "-")
    table.add_row("baseline", f"x {next(iter(fitted.values()))['baseline']:.2f}", "-", "-", "-")
    return table


def _predicted(block: dict[str, Any]) -> str:
    return "-" if block["p10"] is None else f"{100 * block['p10']:.3g} to {100 * block['p90']:.3g}"


def _fit_line(fit: dict[str, Any]) -> str:
    """Return the line that names the fit and its scores."""
    scores = ", ".join(f"{name} x {one['geometric_mean']:.2f}" for name, one in fit["leave_one_out"].items())
    paper = " and the paper's nine" if fit["include_paper_units"] else ""
    units = f"{fit['own_units']} units of the lab{paper}"
    head = f"  fit {fit['name']} ({fit['file']}, SHA-256 {fit['sha256'][:12]}), {fit['leads']} leads"
    return f"{head}: {units}; leave-one-out error: {scores}"


_ERRORS = "error against the table"
_SLOPES = (
    "In brackets: measured pairs of units whose slope has the same sign, and the range with them. ?: no pair was "
    "measured, so the range contains 0."
)


def _choice(chosen: dict[str, Any]) -> str:
    """State the rule's score if its form is chosen without the unit too."""
    low, high = chosen["range"]["low"], chosen["range"]["high"]
    return (
        f"  Rule with its form chosen among {len(chosen['forms'])} without the unit too: "
        f"x {chosen['geometric_mean']:.2f} ({low:.2f} to {high:.2f}). p above 0.05: nine units show no difference."
    )


def _classes(by_class: dict[str, dict[str, float]], order: list[str]) -> Table:
    """Tabulate the error of each model if a whole class is left out."""
    table = Table("model", *by_class, title="leave-one-class-out error")
    for model in order:
        table.add_row(model, *[f"x {errors[model]:.2f}" for errors in by_class.values()])
    return table


def _inputs(data: dict[str, Any]) -> tuple[Table, str] | None:
    """Tabulate the percent by which a level grows with 1 % more of an input; name the inputs without effect."""
    found = {name: block["sensitivities"] for name, block in data["models"].items()}
    for one in data.get("fem", {}).get("sensitivities", ()):
        found[f"fem, {one['reading']}"] = one
    seen = {name: one["by"] for name, one in found.items() if one["by"] is not None}
    if not seen:
        return None
    table = Table(Column("input + 1 %", no_wrap=True), *seen, title="change of the edge level, %")
    some = found[next(iter(seen))]
    names = [*some["by"], *some["no_effect"]]
    for name in sorted(names, key=lambda name: -max(abs(by.get(name, 0.0)) for by in seen.values())):
        if any(name in by for by in seen.values()):
            table.add_row(name, *[_slope(found[model], name) for model in seen])
    unread = [name for name in names if not any(name in by for by in seen.values())]
    if not unread:
        return table, ""
    tissue = any(name.startswith("tissue ") for name in unread)
    curve = ". The tissue changes only the curve on the skin." if tissue and "layered" in data else ""
    return table, f"Inputs without effect on the level: {', '.join(unread)}{curve}"


def _slope(seen: dict[str, Any], name: str) -> str:
    """Format a slope, how many measured pairs agree, and its range; "?" if there is no pair."""
    if name not in seen["by"]:
        return "no effect"
    slope, one = f"{seen['by'][name]:+.2f}", seen.get("tested", {}).get(name)
    if one is None:
        return slope
    return (
        f"{slope} ({one['agree']} of {one['of']}: {one['low']:+.2f} to {one['high']:+.2f})"
        if one["of"]
        else f"{slope} ?"
    )


def _coefficients(interfaces: list[str], found: dict[str, dict[str, Any]]) -> Table:
    """Tabulate the coefficients of both waves, equation 4."""
    heads = [f"{key}, {wave.upper()}" for wave in found for key in ("k_t", "k_r")]
    table = Table("from a layer to the next", *heads, title="transmission and reflection, equation 4")
    for i, name in enumerate(interfaces):
        ends = [{end: values[i] for end, values in block.items()} for block in found.values()]
        table.add_row(name, *(_format_range(one, key) for one in ends for key in ("k_t", "k_r")))
    return table


def _constraints(rows: list[dict[str, Any]]) -> Table:
    table = Table("", "inequality", "left", "", "right", "margin", "unit", title="the paper's inequalities 5 and 6")
    table.add_column("holds")
    for row in rows:
        numbers = [_format_range(row, key) for key in ("left", "right", "margin")]
        holds = {True: "yes", False: "no", None: row.get("reason", "not known")}[row["holds"]]
        text = row["text"].replace("control", row["control"] or "")
        table.add_row(row["equation"], text, numbers[0], row["relation"], *numbers[1:], row["unit"], holds)
    return table


def _readings(rows: list[dict[str, Any]]) -> Table:
    """Tabulate every reading of the paper's eta: the exponents along the walls, and the ratio that it leads to."""
    controls = [one["control"] for one in rows[0]["hierarchical_over_control"]]
    table = Table(
        "eta read as",
        "exponents, S wave",
        "unit",
        *[Column(f"% of an all-{name} unit's level", min_width=min(17, len(name) + 4)) for name in controls],
    )
    table.title = "the paper's model by reading of eta"
    for row in rows:
        key = "exponents_s_wave"
        ends = zip(row[key], row.get(f"{key}_low", row[key]), row.get(f"{key}_high", row[key]), strict=True)
        exponents = [_format_range({"e": value, "e_low": low, "e_high": high}, "e") for value, low, high in ends]
        ratios = [_format_range(one, "s", 100) for one in row["hierarchical_over_control"]]
        table.add_row(row["eta"].replace("_", " "), ", ".join(exponents), row["unit_of_exponent"], *ratios)
    return table


def _format_range(row: dict[str, Any], key: str, factor: float = 1.0) -> str:
    """Format a value to three digits, or its range if it has no nominal value."""
    low, high = row.get(f"{key}_low"), row.get(f"{key}_high")
    if row[key] is not None:
        return f"{factor * row[key]:.3g}"
    return "not known" if low is None or high is None else f"{factor * low:.3g} to {factor * high:.3g}"


def _curve(layered: dict[str, Any]) -> Table:
    """Tabulate the decay under either drive, the motor's own first, and one drive over the other per newton."""
    title = f"|u| of the skin, % of that at the edge, {layered['tissue']}, the motor's drive ({layered['drive']}) first"
    table = Table("mm from the edge", title=title)
    picked = [i for i, r in enumerate(layered["r_mm"]) if r in (0, 2, 5, 10, 15, 20, 30)]
    for i in picked:
        table.add_column(f"{layered['r_mm'][i]:g}")
    for drive, block in layered["drives"].items():
        for name, key in ((drive, "value"), ("low", "low"), ("high", "high")):
            table.add_row(name, *[f"{100 * block['u'][key][i]:.3g}" for i in picked])
    ratio = layered["flat_over_axial_per_newton"]["value"]
    table.add_row("flat over axial, per newton", *[f"x {ratio[i]:.3g}" for i in picked])
    return table


def level(quantity: dict[str, Any] | None, factor: float = 1.0, digits: int = 3) -> str:
    """Format a value with its range, or the one of the two that there is."""
    if not quantity:
        return "-"
    value, low, high = (
        None if quantity.get(k) is None else _format_number(quantity[k] * factor, factor, digits) for k in _PARTS
    )
    spread = f"{low} to {high}" if low and high and low != high else ""
    if value:
        return f"{value} ({spread})" if spread else value
    return spread or "not known"


def _format_number(value: float, factor: float, digits: int) -> str:
    """Format a number; a level next to nothing as below 0.01 %."""
    return "below 0.01" if factor == 100 and value < 0.01 else f"{value:.{digits}g}"


_PARTS = ("value", "low", "high")


_MOST_FREQUENCIES = 1000


def estimate(
    specs: Annotated[list[str], typer.Argument(metavar="SPEC...", help="Spec or array files, or names of templates.")],
    model: Annotated[
        str,
        typer.Option(
            metavar="MODEL",
            help="Model of the details: rule, published, corrected, divider, fem or all. Default: the spec's.",
        ),
    ] = "",
    frequency: Annotated[
        str,
        typer.Option(
            metavar="HZ|FROM:TO:STEP", help="One frequency, or a table over frequencies. Default: the motor's."
        ),
    ] = "",
    fit: Fit = None,
    sets: Sets = None,
    details: Annotated[
        bool, typer.Option("--details", help="Print models, errors, slopes, the skin's curve and assumptions.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Estimate the level at a unit's edge, or an array's crosstalk.

    The first line has the level in per cent of the motor's amplitude, and the 80 % range of the model that leads. If
    this unit was measured, it has the measurement. The second line has the paper's analytic model and its error. For an
    array: the share of a unit's motion at its neighbours; several arrays are compared with the first.
    """

    if model not in ("", "all", *MODELS, FEM):
        raise unknown_name("--model", model, (*MODELS, FEM, "all"))
    if ":" in frequency and model == FEM:
        raise Refusal("--frequency", frequency, "must be one frequency for fem, whose draws cost seconds each")
    models = None if not model else MODELS if model == "all" else (model,)
    hertz = frequencies(frequency) if frequency else []
    specs = [confirm_known(name) for name in specs]
    kinds = [kind for kind in map(compound_kind, specs) if kind]
    if kinds:
        if model:
            raise Refusal("--model", model, "an array's crosstalk is a range over the models")
        return load_named(kinds[0].subject).estimate(specs, with_fit(sets, fit), hertz, details, as_json)
    loaded = [load(name, with_fit(sets, fit)) for name in specs]
    for spec in loaded:
        _warn_of_moulds(spec)
    if ":" in frequency:
        estimates = [frequency_table_of_spec(spec, hertz, models) for spec in loaded]
    else:
        with progress("estimate") as stage:
            estimates = [estimate_spec(spec, models, hertz[0] if hertz else None, say=stage) for spec in loaded]
    if as_json:
        print_json(estimates[0] if len(estimates) == 1 else {"estimates": estimates})
        return

    if ":" in frequency:
        for one in estimates:
            print_frequencies(one)
        return
    for one in estimates:
        print_estimate(one, details)
    if details:
        print_errors(estimates[0]["table_error"], estimates[0]["models"])
    else:
        typer.echo("How sure? --details prints every model, its errors and slopes, the skin's curve and assumptions")


def _warn_of_moulds(spec: Spec) -> None:
    """Warn that `build` would refuse the moulds of a unit that can be estimated."""

    if design_of(spec).passes is None:
        return
    try:
        plan(spec)
    except Refusal as refusal:
        warn(f"warning: {spec.name}: its moulds can't be made: {refusal}")


def frequencies(text: str) -> list[float]:
    """Parse HZ, or FROM:TO:STEP with both ends, into a list in Hz. Raises `Refusal`."""

    parts = text.split(":")
    try:
        numbers = [float(part) for part in parts]
    except ValueError:
        numbers = []
    if len(numbers) not in (1, 3) or not all(math.isfinite(n) and n > 0 for n in numbers):
        meant = [float(number) for number in re.findall(r"\d+(?:\.\d+)?", text)][:3]
        meant += [10.0] * (len(meant) == 2)
        nearest = ":".join(f"{n:g}" for n in meant) if meant and min(meant) > 0 else "100:150:10"
        raise Refusal("--frequency", text, "must be HZ or FROM:TO:STEP, numbers above 0", nearest)
    lowest, highest = FREQUENCIES_HZ
    clipped = [min(max(n, lowest), highest) for n in numbers[:2]]
    if clipped != numbers[:2]:
        nearest = ":".join(f"{n:g}" for n in (*clipped, *numbers[2:]))
        raise Refusal("--frequency", text, f"must be from {lowest:g} to {highest:g} Hz", nearest)
    if len(numbers) == 1:
        return numbers
    low, high, step = numbers
    if high < low:
        raise Refusal("--frequency", text, "TO must not be below FROM", f"{high:g}:{low:g}:{step:g}")
    least = (high - low) / (_MOST_FREQUENCIES - 1)
    if step < least * (1 - 1e-9):
        limit = f"asks for more than {_MOST_FREQUENCIES} frequencies"
        raise Refusal("--frequency", text, limit, f"{low:g}:{high:g}:{_up(least):g}")
    count = math.floor((high - low) / step * (1 + 1e-12) + 1e-9) + 1
    return [low + i * step for i in range(count)]


def _up(number: float) -> float:
    """Round a number up to six digits."""
    shown = float(f"{number:.6g}")
    return shown if shown >= number else float(f"{number * (1 + 1e-5):.6g}")
