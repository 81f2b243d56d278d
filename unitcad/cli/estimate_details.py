"""The basis of an estimate in tables: models, errors, slopes and the skin's curve."""

from __future__ import annotations

from typing import Any

from unitcad.attenuation.edge.words import ALIKE, BRACKETS, level_cell
from unitcad.cli.output import level, print_indented
from unitcad.cli.tables import print_table
from unitcad.text import join_words, number

Rows = list[dict[str, str]]


def print_estimate(data: dict[str, Any], details: bool = False) -> None:
    """Print the basis of an answer: the range by finite elements if it was asked for, and with `details` the rest."""
    if "fem" in data:
        print_table(_fem(data["fem"]), "fem: edge level, %, over the draws")
        print_indented(*_fem_lines(data["fem"]))
    if details:
        _print_details(data)


def _print_details(data: dict[str, Any]) -> None:
    """Print the models side by side, the layered curve, the inputs that count, and the assumptions."""
    if data["models"]:
        print_table(_models(data))
        print_indented(BRACKETS)
        if "fit" in data:
            print_indented(_fit_line(data["fit"]))
    layered = data["layered"]
    title = f"|u| of the skin, % of that at the edge, {layered['tissue']}, the motor's drive ({layered['drive']}) first"
    print_table(_curve(layered), title)
    print_indented(layered["u_definition"])
    _print_slopes(data)
    no_ratio = layered["hierarchical_over_control_reason"]
    print_indented(f"No ratio to a control from the layered curve: {no_ratio}", *data["assumptions"])


def print_errors(errors: dict[str, Any], models: dict[str, Any]) -> None:
    """Print the models' errors against the measured table, and by a lab's fit if the models' blocks have one."""
    print_table(_errors(errors), "error against the table")
    if fitted := {name: block["fit_error"] for name, block in models.items() if "fit_error" in block}:
        print_table(_fit_errors(fitted), "error by the lab's fit; the table above uses the stored constants")
    chosen = errors["chosen_without"]
    print_indented(
        f"Rule with its form chosen among {len(chosen['forms'])} without the unit too: "
        f"{_mean(chosen, chosen['range'])}. Nine units do not rank the models."
    )
    by_class = errors["leave_one_class_out"]["by_class"]
    rows = [
        {"model": model, **{name: f"x {error[model]:.2f}" for name, error in by_class.items()}}
        for model in errors["order"]
    ]
    print_table(rows, "leave-one-class-out error")


def _fem(block: dict[str, Any]) -> Rows:
    """Tabulate each drive and reading over what is not known: all draws, then bonded and resting skin apart."""
    low, _, high = block["percent"]
    return [
        {
            "drive": one["drive"],
            "read on": "skin, r = D/2" if one["reading"] == "skin" else "own edge",
            "skin": name,
            f"{low} %": f"{100 * group['low']:.3g}",
            "median": f"{100 * group['median']:.3g}"
            + ("" if group["median_error"] is None else f" (x/: {group['median_error']:.2f})"),
            f"{high} %": f"{100 * group['high']:.3g}",
            "as drawn": f"{100 * one['drawn_as']:.3g}" if name == "both" else "",
        }
        for one in block["levels"]
        for name, group in {"both": one, **one["by_contact"]}.items()
    ]


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


def _models(data: dict[str, Any]) -> Rows:
    """Tabulate the edge level, and its ratio to the control of each of the unit's materials."""
    blocks, answer, fitted = data["models"], data["answer"], "fit" in data
    controls = [one["control"] for one in next(iter(blocks.values()))["hierarchical_over_control"] or []]

    def row(name: str, edge: str, spread: str = "-", block: dict[str, Any] | None = None) -> dict[str, str]:
        given = (block or {}).get("hierarchical_over_control") or []
        ratios = {one["control"]: level(one, 100) for one in given}
        return {
            "model": name,
            "edge level %": edge,
            **({"P10 to P90": spread} if fitted else {}),
            **{f"% of an all-{control} unit's": ratios.get(control, "-") for control in controls},
        }

    rows = [row("answer", level_cell(answer["level"], answer["low"], answer["high"]))]
    for name, block in blocks.items():
        ends: dict[str, Any] = block.get("predictive") or {}
        spread = "-" if ends.get("p10") is None else f"{100 * ends['p10']:.3g} to {100 * ends['p90']:.3g}"
        named = name + ALIKE * (name == answer["source"]["model"])
        rows.append(row(named, level(block["edge_level"], 100), spread, block))
    rows.append(row("baseline", f"{100 * answer['kind_mean']:.3g} ({answer['kind']})"))
    for own in data.get("own_measured", ()):
        rows.append(row("measured here", level(own, 100), f"{own['unit']}, {own['frequency_hz']:g} Hz"))
    measured = data["measured"] or {}
    if measured.get("same_size"):
        levels = [measured[key] for key in ("level", "also_printed") if measured.get(key) is not None]
        text = " and ".join(f"{100 * value:.4g}" for value in levels)
        rows.append(row("measured, paper" if fitted else "measured", text, block=measured))
    return rows


def _errors(errors: dict[str, Any]) -> Rows:
    """Tabulate each model's error against the measured values, the least leave-one-out error first."""
    rows = []
    for name in errors["order"]:
        error = errors[name]
        own = error["leave_one_out"]["levels"]
        rows.append(
            {
                "model": name,
                "levels": f"x {error['levels']['geometric_mean']:.2f}",
                "leave-one-out": _mean(own, own["range"]),
                "ratios": f"x {error['ratios']['geometric_mean']:.2f}",
                "directions": f"{error['directions']['right']} of {error['directions']['of']}",
            }
        )
    return rows


def _fit_errors(fitted: dict[str, Any]) -> Rows:
    """Tabulate each model's error by the lab's fit, the best one first, and the baseline's."""
    heads = {"own_leave_one_out": "own units", "own_by_stored": "own, stored constants"}
    rows = [
        {
            "model": name,
            "leave-one-out": _mean(error["leave_one_out"], error["leave_one_out"]),
            **{head: "-" if error[key] is None else f"x {error[key]:.2f}" for key, head in heads.items()},
            "coverage": error["coverage"] or "-",
        }
        for name, error in sorted(fitted.items(), key=lambda pair: pair[1]["leave_one_out"]["geometric_mean"])
    ]
    baseline = f"x {next(iter(fitted.values()))['baseline']:.2f}"
    return [*rows, {**dict.fromkeys(rows[0], "-"), "model": "baseline", "leave-one-out": baseline}]


def _mean(error: dict[str, Any], ends: dict[str, Any]) -> str:
    return f"x {error['geometric_mean']:.2f} ({ends['low']:.2f} to {ends['high']:.2f})"


def _fit_line(fit: dict[str, Any]) -> str:
    """Return the line that names the fit and its scores."""
    scores = ", ".join(f"{name} x {one['geometric_mean']:.2f}" for name, one in fit["leave_one_out"].items())
    parts = [f"{fit['own_units']} units of the lab"]
    parts += [f"{others} of other labs"] if (others := fit["units_of_other_labs"]) else []
    units = join_words([*parts, "the paper's nine"] if fit["include_paper_units"] else parts)
    name = f"fit {fit['name']} ({fit['file']}, SHA-256 {fit['sha256'][:12]})"
    return f"{name}, {fit['leads']} leads: {units}; leave-one-out error: {scores}"


def _print_slopes(data: dict[str, Any]) -> None:
    """Print the percent by which a level grows with 1 % more of an input; name the inputs without effect."""
    found = {name: block["sensitivities"] for name, block in data["models"].items()}
    for one in data.get("fem", {}).get("sensitivities", ()):
        found[f"fem, {one['reading']}"] = one
    found = {name: one for name, one in found.items() if one["by"] is not None}
    if not found:
        return
    some = next(iter(found.values()))
    names = [*some["by"], *some["no_effect"]]
    names.sort(key=lambda name: -max(abs(one["by"].get(name, 0.0)) for one in found.values()))
    unread = [name for name in names if not any(name in one["by"] for one in found.values())]
    rows = [
        {"input + 1 %": name, **{model: _slope(one, name) for model, one in found.items()}}
        for name in names
        if name not in unread
    ]
    print_table(rows, "change of the edge level, %")
    print_indented(
        "In brackets: measured pairs of units whose slope has the same sign, and the range with them. ?: no pair was "
        "measured, so the range contains 0."
    )
    if unread:
        tissue = any(name.startswith("tissue ") for name in unread)
        curve = ". The tissue changes only the curve on the skin." if tissue else ""
        print_indented(f"Inputs without effect on the level: {', '.join(unread)}{curve}")


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


def _curve(layered: dict[str, Any]) -> Rows:
    """Tabulate the decay under either drive, the motor's own first, and one drive over the other per newton."""
    picked = {f"{r:g}": i for i, r in enumerate(layered["r_mm"]) if r in (0, 2, 5, 10, 15, 20, 30)}
    rows = []
    for drive, block in layered["drives"].items():
        for name, key in ((drive, "value"), ("low", "low"), ("high", "high")):
            values = {place: f"{100 * block['u'][key][i]:.3g}" for place, i in picked.items()}
            rows.append({"mm from the edge": name, **values})
    ratio = layered["flat_over_axial_per_newton"]["value"]
    values = {place: f"x {ratio[i]:.3g}" for place, i in picked.items()}
    return [*rows, {"mm from the edge": "flat over axial, per newton", **values}]
