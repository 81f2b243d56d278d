"""A study's folder: experiments.json, experiments.md for a person, experiments.svg with the predicted ranges."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from unitcad.experiments.range_plot import BELOW, svg
from unitcad.experiments.study import span_text, tells
from unitcad.files import write

SHOWN = 8
"""Experiments in the tables and in the plot; experiments.json has all."""
HELD = (
    "Each rival's draws are weighed by the nine measured levels, up to one factor. A rival that misses them by more "
    "than its discrepancy is weighed as one whose discrepancy is larger."
)
FREE = "The draws are a rival's prior: nothing holds them to the nine measured levels."
A_BIT = "One bit decides for certain between two rivals that are equally probable."


def write_study(data: Mapping[str, Any], folder: Path) -> Path:
    """Write the three files, each whole or not at all, into a folder that is made. Raises OSError."""
    folder.mkdir(parents=True, exist_ok=True)
    write(folder / "experiments.json", (json.dumps(data, indent=2, ensure_ascii=False) + "\n").encode())
    rivals = [rival["name"] for rival in data["rivals"]]
    plot = folder / "experiments.svg"
    if found := shown(data):
        write(plot, svg(found, rivals).encode())
    else:
        plot.unlink(missing_ok=True)  # of an earlier study
    write(folder / "experiments.md", page(data).encode())
    return folder


def telling(entries: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return the experiments or sets that say anything."""
    return [dict(one) for one in entries if tells(one["bits"], one["error"])]


def shown(data: Mapping[str, Any], count: int = SHOWN) -> list[dict[str, Any]]:
    """Return the best experiments, of each comparison (two units, one unit at frequencies or on bodies) the best.

    Those that say nothing are left out.
    """
    best: dict[tuple[str, ...], dict[str, Any]] = {}
    for one in telling(data["experiments"]):
        best.setdefault((one["changed"], one["above"]["unit"], one["below"]["unit"]), one)
    return list(best.values())[:count]


def page(data: Mapping[str, Any]) -> str:
    """Return the study as Markdown."""
    names = [rival["name"] for rival in data["rivals"]]
    lines = [
        f"# What to measure next: {data['lab']}",
        "",
        *(f"Left out, {line}.\n" for line in left_out(data)),
        data["settles"],
        "",
        f"There are {data['most_bits']:.2f} bits to know. {A_BIT} A reading scatters by "
        f"{100 * data['noise']:g} %; a rival that holds misses a ratio by {100 * data['discrepancy']:g} %. "
        f"{draws_text(data)}, seed {data['seed']}.",
        "",
    ]
    if found := shown(data):
        lines += [
            "![what each rival predicts](experiments.svg)",
            "",
            "## Single ratios",
            "",
            "Of each comparison the best one; all stand in experiments.json. In brackets 10 to 90 % of a rival's "
            f"draws, without the scatter of readings; {BELOW!r} where that holds for half of them or more.",
            "",
            *experiment_rows(found, names),
            "",
        ]
    if sets := telling(data["sets"]):
        lines += ["## Together", "", "| measure | bits | not told apart |", "| --- | --- | --- |"]
        for one in sets:
            pairs = "; ".join(" and ".join(pair["rivals"]) for pair in one["not_told_apart"]) or "none"
            lines.append(f"| {'; '.join(one['experiments'])} | {one['bits']:.2f} ± {one['error']:.2f} | {pairs} |")
        lines.append("")
    lines += [f"- {line}." for line in data["few_draws"]] + ([""] if data["few_draws"] else [])
    lines += [f"## Rivals\n\n{HELD if data['held_to_levels'] else FREE}\n", *rival_rows(data["rivals"])]
    return "\n".join([*lines, ""])


def rival_rows(rivals: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return a Markdown table of the rivals: probability, and how well each gives the measured levels if it is held."""
    rows = [
        "| rival | what it says | probability | misses the nine levels by | effective draws |",
        "| --- | --- | --- | --- | --- |",
    ]
    for one in rivals:
        misses = f"a factor of {one['held']['misses']:.2f}" if one["held"] else "-"
        rows.append(
            f"| {one['name']} | {one['says']} | {one['probability']:.2f} | {misses} | {one['effective_draws']:.0f} |"
        )
    return rows


def left_out(data: Mapping[str, Any]) -> list[str]:
    """Return a line for each reason why rivals are left out, with their names."""
    reasons: dict[str, list[str]] = {}
    for name, reason in data["left_out"].items():
        reasons.setdefault(reason, []).append(name)
    return [f"{reason}: {', '.join(names)}" for reason, names in reasons.items()]


def draws_text(data: Mapping[str, Any]) -> str:
    """Return how many draws there are, of finite elements too where they are among the rivals."""
    text = f"{data['draws']} draws"
    elements = any(rival["costly"] for rival in data["rivals"])
    return f"{text} ({data['element_draws']} of finite elements)" if elements else text


def experiment_rows(experiments: Sequence[Mapping[str, Any]], rivals: Sequence[str]) -> list[str]:
    """Return a Markdown table of experiments: bits, and each rival's predicted ratio."""
    rows = [
        f"| ratio | bits | {' | '.join(rivals)} |",
        f"| --- | --- | {' | '.join('---' for _ in rivals)} |",
    ]
    for one in experiments:
        cells = [span_text(one["predicted"][name]) for name in rivals]
        rows.append(f"| {one['experiment']} | {one['bits']:.2f} ± {one['error']:.2f} | {' | '.join(cells)} |")
    return rows
