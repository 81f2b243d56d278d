"""Writes the computed tables of docs/model.md, between its markers, and its plots as SVG.

python docs/make_model.py
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from unitcad.attenuation.edge.bush import bush
from unitcad.attenuation.edge.fitted_models import (
    MODELS,
    assessments,
    bush_forms,
    choice,
    compared,
    edge_levels,
    forms,
    in_order,
    one_constant,
    pairwise,
    stored,
)

from benchmarks.accuracy.plot import svg
from benchmarks.accuracy.result import Plot
from unitcad.attenuation.edge import closed_form as cf
from unitcad.attenuation.edge.closed_form import Units
from unitcad.attenuation.edge.measured_levels import measured_table
from unitcad.attenuation.edge.scores import assess, left_out_errors
from unitcad.attenuation.inputs import Drive, body
from unitcad.attenuation.layered import Direction, Load, Point, UniformDisc
from unitcad.attenuation.receivers import FORCES, Patch, influence, motion
from unitcad.estimating import estimate_input, estimate_spec
from unitcad.validation import load

HERE = Path(__file__).parent
TITLES = {
    "bush": "bush, one constant",
    "fitted": "fitted, the divider, two constants",
    "crossings": "layer propagation (model `crossings`): k_t once embedded, twice encapsulating, one constant",
    "null": "null: softer layer inside or not, two constants",
    "paper": "paper, one constant",
    "consistent": "consistent, one constant",
}


def _range(ends: tuple[float, float]) -> str:
    return f"{ends[0]:.2f} to {ends[1]:.2f}"


def table_of_models() -> str:
    """Return every model against the measured table, the best with a unit left out first."""
    rows = [
        "| model | levels, in-sample | a unit left out | range | ratios | worst ratio | a unit left out | directions |",
        "| --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for name in in_order(assessments()):
        assessment = assessments()[name]
        without = (
            f"{assessment.left_out_ratios.geometric_mean:.2f}" if assessment.left_out_ratios else "no constant in it"
        )
        rows.append(
            f"| {TITLES[name]} | {assessment.levels.geometric_mean:.2f} | {assessment.left_out.geometric_mean:.2f} "
            f"| {_range(assessment.left_out_range)} "
            f"| {assessment.ratios.geometric_mean:.2f} | {assessment.ratios.worst:.2f} | {without} "
            f"| {assessment.directions} of {assessment.ratios.count} |"
        )
    return "\n".join(rows)


def table_of_tests() -> str:
    """Return p of the sign-flip test of each pair of models."""
    names = in_order(assessments())
    p = {(better, worse): value for better, worse, value in pairwise(assessments())}
    rows = [f"| better \\ worse | {' | '.join(names[1:])} |", "| --- |" + " --- |" * (len(names) - 1)]
    for better in names[:-1]:
        cells = [f"{p[better, worse]:.2g}" if (better, worse) in p else "" for worse in names[1:]]
        rows.append(f"| {better} | {' | '.join(cells)} |")
    return "\n".join(rows)


def table_of_forms() -> str:
    """Return every form that was tried, and the score of a choice among them made without the unit."""
    table, found = measured_table(), choice()
    rows = ["| form | levels, in-sample | a unit left out | chosen for |", "| --- | --- | --- | --- |"]
    for name, fit in forms().items():
        one = assess(fit, fitted_ratios=False, table=table)
        count = found.chosen.count(name)
        rows.append(
            f"| {name} | {one.levels.geometric_mean:.2f} | {one.left_out.geometric_mean:.2f} "
            f"| {f'{count} of {len(table.names)}' if count else ''} |"
        )
    score = f"{found.score.geometric_mean:.2f} ({_range(found.range)})"
    said = f"Chosen for each unit by the other eight, among these {len(forms())} forms: {score}."
    return "\n".join([*rows, "", said])


def table_of_bushes() -> str:
    """Return kappa and n of the bushes' forms, from the paper's lengths."""
    rows = ["| bush | gap | floors | kappa | n |", "| --- | --- | --- | --- | --- |"]
    table = measured_table()
    for form in bush_forms():
        stiff = []
        for design in ("embedded", "encapsulating"):
            units = table.units(table.designs.index(design))
            ratio = units.youngs_modulus[..., -1] / units.youngs_modulus[..., 0]
            stiff.append(float((1 / bush(units, form) - 1)[0] / ratio))
        words = (
            "long" if form.long else "short",
            "filled" if form.filled else "as drawn",
            "yes" if form.floors else "no",
        )
        rows.append(f"| {' | '.join(words)} | {stiff[0]:.3f} | {stiff[1] / stiff[0]:.2f} |")
    return "\n".join(rows)


def table_of_inputs() -> str:
    """Return d ln level / d ln input of every model for the shipped encapsulating unit."""
    blocks = estimate_spec(load("encapsulating"), MODELS, layered=lambda variant: {})["models"]
    seen = {model: block["inputs_seen"]["by"] for model, block in blocks.items()}
    every = next(iter(blocks.values()))["inputs_seen"]
    names = sorted([*every["by"], *every["not_seen"]], key=lambda n: -max(abs(by.get(n, 0)) for by in seen.values()))
    rows = [f"| input | {' | '.join(seen)} |", "| --- |" + " --- |" * len(seen)]
    for name in names:
        rows.append(f"| {name} | {' | '.join(f'{by[name]:+.2f}' if name in by else '-' for by in seen.values())} |")
    return "\n".join(rows)


def spread_of_scores() -> str:
    """Return how far the scores move where moduli, damping and frequency are drawn from what is not known."""
    table, rng = measured_table(), np.random.default_rng(7)
    scores: dict[str, list[float]] = {name: [] for name in ("bush", "fitted", "paper")}
    for _ in range(400):
        factor = {name: np.exp(rng.uniform(*np.log([0.7, 1 / 0.7]))) for names in table.layers for name in names}
        tan_delta = {name: rng.uniform(0.1, 0.3) for name in factor}
        omega = 2 * np.pi * rng.uniform(100, 150)
        drawn = replace(
            table,
            inputs=tuple(
                replace(
                    units,
                    youngs_modulus=units.youngs_modulus * [factor[name] for name in names],
                    tan_delta=[tan_delta[name] for name in names],
                    omega=omega,
                )
                for units, names in zip(table.inputs, table.layers, strict=True)
            ),
        )
        for name, found in scores.items():
            found.append(float(np.exp(left_out_errors(compared()[name].fit, drawn).mean())))
    return "; ".join(
        f"{name} {np.median(found):.2f} ({_range(tuple(np.percentile(found, [5, 95])))})"
        for name, found in scores.items()
    )


def table_of_readings() -> str:
    """Return the paper's model by each reading of eta and by each wave."""
    rows = [
        "| eta read as | wave | levels | a unit left out | ratios | directions |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for reading in cf.READINGS:
        for wave in ("s", "p"):
            path = one_constant(lambda u, wave=wave, reading=reading: cf.paper_path(u, wave, reading))
            assessment = assess(path, fitted_ratios=False, table=measured_table())
            rows.append(
                f"| {reading} | {wave.upper()} | {assessment.levels.geometric_mean:.2f} "
                f"| {assessment.left_out.geometric_mean:.2f} | {assessment.ratios.geometric_mean:.2f}"
                f" | {assessment.directions} of {assessment.ratios.count} |"
            )
    return "\n".join(rows)


def table_of_units() -> str:
    """Return each measured unit beside the models."""
    table = measured_table()
    models = [name for name in in_order(assessments()) if name in MODELS]
    rows = [f"| unit | measured % | {' | '.join(models)} |", "| --- | --- |" + " --- |" * len(models)]
    for i, name in enumerate(table.names):
        levels = [100 * float(table.evaluate(partial(edge_levels, model=model))[i]) for model in models]
        rows.append(f"| {name} | {100 * table.levels[i]:.4g} | " + " | ".join(f"{v:.1f}" for v in levels) + " |")
    return "\n".join(rows)


def constants() -> str:
    """Return the fitted constants."""
    found = stored()
    return (
        f"kappa = {found['fitted']['kappa']:.3f}, s = {found['fitted']['s']:.3f} for the divider; "
        f"s = {found['bush']['s']:.3f} for bush, {found['paper']['s']:.3f} for paper, "
        f"{found['consistent']['s']:.3f} for consistent."
    )


def table_of_drives() -> str:
    """Return the sideways over the normal force, per newton on the forearm, by what is compared."""
    variant = estimate_input(load("encapsulating"))
    forearm, disc = body(variant.tissue), variant.motor_diameter / 2
    r = np.array([7e-3, 30e-3])

    def row(what: str, make: Callable[[Direction], Load], sideways: str, normal: str, share: float = 1.0) -> str:
        def sizes(direction: Direction, hertz: float, names: str) -> np.ndarray:
            response = forearm.response(make(direction), 2 * np.pi * hertz, r, rtol=1e-4)
            return np.sqrt(sum(np.abs(getattr(response, name)) ** 2 for name in names.split()))

        found = [(sizes("tangential", f, sideways) * share, sizes("normal", f, normal)) for f in (50.0, 125.0, 250.0)]
        ratios = [f"{one[1] / other[1]:.3g}" for one, other in found]
        falls = [f"{one[1] / one[0]:.3f}" for one in found[1]]
        return f"| {' | '.join([what, *ratios, *falls])} |"

    def uniform(direction: Direction) -> Load:
        return UniformDisc(disc, direction)

    in_line, turning = "u_r u_z", "u_r u_theta u_z"
    return "\n".join(
        [
            "| what is compared | 50 Hz | 125 Hz | 250 Hz | fall, sideways | fall, normal |",
            "| --- | --- | --- | --- | --- | --- |",
            row("a point, in line, sqrt(abs(u_r)^2 + abs(u_z)^2) of both", Point, in_line, in_line),
            row("the motor's disc, in line, the same", uniform, in_line, in_line),
            row("the motor's disc, in line, abs(u_r) over abs(u_z)", uniform, "u_r", "u_z"),
            row("the motor's disc, root mean square over all angles", uniform, turning, in_line, 2**-0.5),
            row("the disc's force turns: `flat_over_axial_per_newton`", uniform, turning, in_line),
        ]
    )


def table_of_receivers() -> str:
    """Return what masses of 1.2 g do to the transfer to a neighbour, in an array of 14 mm units and between two."""
    forearm, radius, pitch = body(estimate_input(load("encapsulating")).tissue), 7e-3, 16e-3
    places = [(pitch * column, pitch * row) for row in range(10) for column in range(10)]
    middle = [places[55], places[56]]
    array = [Patch(*place, radius, 1.2e-3) for place in middle + [one for one in places if one not in middle]]
    x, y = np.array([(patch.x, patch.y) for patch in array]).T
    apart, at = np.unique(np.round(np.hypot(x[:, None] - x, y[:, None] - y), 9), return_inverse=True)

    def change(g: np.ndarray, drive: Drive, omega: float) -> str:
        """Return by how much the masses change |u| of the second patch over that of the first, which drives."""
        forces = np.zeros((len(g), 3), dtype=complex)
        forces[0] = FORCES[drive]
        masses = np.array([patch.mass for patch in array[: len(g)]])
        bare, loaded = (np.linalg.norm(motion(g, m, forces, omega), axis=1) for m in (0.0 * masses, masses))
        return f"{(loaded[1] / loaded[0]) / (bare[1] / bare[0]):.2f}"

    columns = []
    for hertz in (100, 125, 150, 300):
        omega = 2 * np.pi * hertz
        g = influence(forearm, array, omega)
        normal, read = np.zeros_like(g), np.zeros_like(g)
        normal[:, 2, :, 2] = g[:, 2, :, 2]
        middles = forearm.response(UniformDisc(radius), omega, apart, rtol=1e-4).u_z / (np.pi * radius**2)
        read[:, 2, :, 2] = np.where(np.eye(len(array)) > 0, g[:, 2, :, 2], middles[at.reshape(len(array), -1)])
        pair = g[:2, :, :2]
        columns.append(
            [
                *(change(each, "axial", omega) for each in (read, normal, g, pair)),
                *(change(each, "flat", omega) for each in (g, pair)),
            ]
        )
    names = [
        "array, u_z alone, read at the neighbours' middles",
        "array, u_z alone, mean over the neighbours' discs",
        "array, axial drive, abs(u)",
        "two units, axial drive, abs(u)",
        "array, flat drive, abs(u)",
        "two units, flat drive, abs(u)",
    ]
    rows = [f"| {' | '.join([name, *cells])} |" for name, *cells in zip(names, *columns, strict=True)]
    return "\n".join(["| what | 100 Hz | 125 Hz | 150 Hz | 300 Hz |", "| --- | --- | --- | --- | --- |", *rows])


def _elements() -> dict:
    return json.loads((HERE / "fem.json").read_text("utf-8"))


def table_of_elements() -> str:
    """Return the nine units by finite elements: median and range over the draws, and the unit as drawn, %."""
    data = _elements()
    draws, drawn = np.array(data["draws"]), np.array(data["nominal"])
    cases = [(i, j) for i in range(len(data["drives"])) for j in range(len(data["readings"]))]
    names = [f"{data['drives'][i]}, {'skin' if data['readings'][j] == 'skin' else 'own edge'}" for i, j in cases]
    rows = [
        "| unit | measured % | " + " | ".join(names) + " |",
        "| --- | --- | " + " | ".join("---" for _ in names) + " |",
    ]
    for u, (name, measured) in enumerate(zip(data["units"], measured_table().levels, strict=True)):
        cells = []
        for i, j in cases:
            low, median, high = 100 * np.percentile(draws[:, u, i, j], (5, 50, 95))
            cells.append(f"{median:.3g} ({low:.3g} to {high:.3g}); drawn {100 * drawn[u, i, j]:.3g}")
        rows.append(f"| {name} | {100 * measured:.4g} | " + " | ".join(cells) + " |")
    return "\n".join(rows)


def table_of_searches() -> str:
    """Return how the draws' readings compare with the measured levels."""
    data = _elements()
    rows = [
        f"{len(data['draws'])} draws, seed {data['seed']}, fineness {data['fineness']:g}.",
        "",
        "| read on, drive | hypotheses | best | chosen without the unit | p | the best one |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for name, one in data["searches"].items():
        rows.append(
            f"| {name.replace('edge', 'own edge')} | {one['count']} | {one['best']:.2f} | {one['nested']:.2f} "
            f"| {one['chance']:.2g} | {one['what']} |"
        )
    return "\n".join(rows)


BLOCKS = {
    "elements": table_of_elements,
    "searches": table_of_searches,
    "models": table_of_models,
    "tests": table_of_tests,
    "forms": table_of_forms,
    "bushes": table_of_bushes,
    "inputs": table_of_inputs,
    "spread": spread_of_scores,
    "readings": table_of_readings,
    "units": table_of_units,
    "constants": constants,
    "drives": table_of_drives,
    "receivers": table_of_receivers,
}


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
    """The skin's decay under both drives with its spread, and the paper's exponentials."""
    layered = estimate_spec(load("encapsulating"))["layered"]
    beside = layered["paper_beside"]["exponential"]
    flat, axial = (layered["drives"][drive]["u"] for drive in ("flat", "axial"))
    series = {
        "flat: turning": flat["value"],
        "flat, low": flat["low"],
        "flat, high": flat["high"],
        "axial": axial["value"],
        "axial, low": axial["low"],
        "axial, high": axial["high"],
        "print, eta a modulus": beside["loss_modulus"],
        "print, half of it": beside["kelvin_voigt"],
    }
    pairs = {name: tuple(zip(layered["r_mm"], values, strict=True)) for name, values in series.items()}
    axes = "distance from the edge, mm", "|u| over |u| at the edge"
    return Plot("Skin outside the unit, forearm, 125 Hz", *axes, pairs, curves=tuple(pairs), linear_x=True)


if __name__ == "__main__":
    page = HERE / "model.md"
    page.write_text(filled(page.read_text("utf-8")), "utf-8")
    (HERE / "model-contrast.svg").write_text(svg(contrast_plot()), "utf-8")
    (HERE / "model-decay.svg").write_text(svg(decay_plot()), "utf-8")
