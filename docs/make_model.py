"""Writes the computed tables of docs/model.md, between its markers, and its plots as SVG.

python docs/make_model.py
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from unitcad.accuracy.plot import svg
from unitcad.accuracy.result import Plot
from unitcad.attenuation.edge import closed_form as cf
from unitcad.attenuation.edge.closed_form import Units
from unitcad.attenuation.edge.fitted_models import STORED_FIT, assessments, edge_levels, one_constant, scales
from unitcad.attenuation.edge.measured_levels import assess, measured_table
from unitcad.estimating import estimate_spec
from unitcad.validation import load

HERE = Path(__file__).parent
TITLES = {
    "paper": "paper, one constant",
    "consistent": "consistent, one constant",
    "crossings": "layer propagation (model `crossings`): k_t once embedded, twice encapsulating, one constant",
    "fitted": "fitted, the divider, two constants",
    "null": "null: softer layer inside or not, two constants",
}


def table_of_models() -> str:
    """Return every model against the measured table."""
    rows = [
        "| model | levels, in-sample | a unit left out | ratios | worst ratio | a unit left out | directions |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for name, title in TITLES.items():
        assessment = assessments()[name]
        without = (
            f"{assessment.left_out_ratios.geometric_mean:.2f}" if assessment.left_out_ratios else "no constant in it"
        )
        rows.append(
            f"| {title} | {assessment.levels.geometric_mean:.2f} | {assessment.left_out.geometric_mean:.2f} "
            f"| {assessment.ratios.geometric_mean:.2f} | {assessment.ratios.worst:.2f} | {without} "
            f"| {assessment.directions} of {assessment.ratios.count} |"
        )
    return "\n".join(rows)


def table_of_readings() -> str:
    """Return the paper's model by each reading of eta and by each wave."""
    rows = [
        "| eta read as | wave | levels | a unit left out | ratios | directions |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for reading in cf.READINGS:
        for wave in ("s", "p"):
            path = one_constant(lambda u, wave=wave, reading=reading: cf.paper_path(u, wave, reading))
            assessment = assess(path, fitted_ratios=False)
            rows.append(
                f"| {reading} | {wave.upper()} | {assessment.levels.geometric_mean:.2f} "
                f"| {assessment.left_out.geometric_mean:.2f} | {assessment.ratios.geometric_mean:.2f}"
                f" | {assessment.directions} of {assessment.ratios.count} |"
            )
    return "\n".join(rows)


def table_of_units() -> str:
    """Return each measured unit beside the models."""
    table = measured_table()
    rows = ["| unit | measured % | paper | consistent | fitted |", "| --- | --- | --- | --- | --- |"]
    for i, name in enumerate(table.names):
        levels = [100 * float(edge_levels(table.units(i), model)) for model in ("paper", "consistent", "fitted")]
        rows.append(f"| {name} | {100 * table.levels[i]:.4g} | " + " | ".join(f"{v:.1f}" for v in levels) + " |")
    return "\n".join(rows)


def constants() -> str:
    """Return the fitted constants."""
    by_model = scales()
    return (
        f"kappa = {STORED_FIT['kappa']:.3f}, s = {STORED_FIT['s']:.3f} for the divider; "
        f"s = {by_model['paper']:.3f} for paper, {by_model['consistent']:.3f} for consistent."
    )


BLOCKS = {"models": table_of_models, "readings": table_of_readings, "units": table_of_units, "constants": constants}


def filled(text: str) -> str:
    """The page with each computed block made again."""
    for name, make in BLOCKS.items():
        pattern = rf"(<!-- computed: {name} -->\n)(?:(?!<!--).)*(<!-- end -->)"
        text, count = re.subn(pattern, lambda m, make=make: f"{m[1]}{make()}\n{m[2]}", text, flags=re.DOTALL)
        if count != 1:
            raise ValueError(f"docs/model.md has {count} blocks named {name}")
    return text


def contrast_plot() -> Plot:
    """Edge level against the outer over the inner modulus: models, and what was measured."""
    contrast = np.geomspace(0.03, 30, 61)

    def units(ratio: float, n: float) -> Units:
        e = [60e3 / np.sqrt(ratio), 60e3 * np.sqrt(ratio)]
        return Units(e, [1070.0] * 2, [0.4999] * 2, [0.2] * 2, [1.25e-3] * 2, 2 * np.pi * 125, n)

    def line(model: str, n: float) -> tuple[tuple[float, float], ...]:
        return tuple((float(x), float(edge_levels(units(x, n), model))) for x in contrast)

    table = measured_table()

    def points(design: str) -> tuple[tuple[float, float], ...]:
        chosen = [i for i, name in enumerate(table.designs) if name == design]
        ratio = [float(table.units(i).youngs_modulus[-1] / table.units(i).youngs_modulus[0]) for i in chosen]
        return tuple(zip(ratio, [float(table.levels[i]) for i in chosen], strict=True))

    series = {
        "paper": line("paper", 1.0),
        "fitted, embedded": line("fitted", 1.0),
        "fitted, encaps.": line("fitted", 2.0),
        **{f"measured {design}": points(design) for design in ("single", "embedded", "encapsulating")},
    }
    curves = tuple(name for name in series if not name.startswith("measured"))
    axes = "modulus of Layer 2 over Layer 1", "edge level"
    return Plot("Edge level, motor = 1", *axes, series, lines=False, curves=curves)


def decay_plot() -> Plot:
    """The layered half-space's curve with its spread, and the paper's exponentials, from the unit's edge outwards."""
    layered = estimate_spec(load("encapsulating"))["layered"]
    r = layered["r_mm"]
    beside = layered["paper_beside"]["exponential"]
    series = {
        "layered u_z": layered["u_z"]["value"],
        "its low end": layered["u_z"]["low"],
        "its high end": layered["u_z"]["high"],
        "layered u_r": layered["u_r"]["value"],
        "print, eta a modulus": beside["loss_modulus"],
        "print, half of it": beside["kelvin_voigt"],
    }
    pairs = {name: tuple(zip(r, values, strict=True)) for name, values in series.items()}
    axes = "distance from the edge, mm", "over |u_z| at the edge"
    return Plot("Skin outside the unit, forearm, 125 Hz", *axes, pairs, curves=tuple(pairs), linear_x=True)


if __name__ == "__main__":
    page = HERE / "model.md"
    page.write_text(filled(page.read_text("utf-8")), "utf-8")
    (HERE / "model-contrast.svg").write_text(svg(contrast_plot()), "utf-8")
    (HERE / "model-decay.svg").write_text(svg(decay_plot()), "utf-8")
