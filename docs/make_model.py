"""Writes the computed tables of docs/model.md, between its markers, and its plots as SVG.

python docs/make_model.py
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np

from unitcad.accuracy.plot import svg
from unitcad.accuracy.result import Plot
from unitcad.attenuation import Point, UniformDisc
from unitcad.attenuation.edge import closed_form as cf
from unitcad.attenuation.edge.closed_form import Units
from unitcad.attenuation.edge.fitted_models import STORED_FIT, assessments, edge_levels, one_constant, scales
from unitcad.attenuation.edge.measured_levels import assess, measured_table
from unitcad.attenuation.inputs import Drive, body
from unitcad.attenuation.layered.loads import Load
from unitcad.attenuation.layered.statics import Direction
from unitcad.attenuation.receivers import FORCES, Patch, influence, motion
from unitcad.estimating import estimate_input, estimate_spec
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


def table_of_drives() -> str:
    """Return the sideways over the normal force, per newton on the forearm, by what is compared."""
    variant = estimate_input(load("encapsulating"))
    forearm, disc = body(variant.tissue), variant.motor_diameter / 2
    r = np.array([7e-3, 30e-3])

    def compared(what: str, make: Callable[[Direction], Load], sideways: str, normal: str, share: float = 1.0) -> str:
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
            compared("a point, in line, sqrt(abs(u_r)^2 + abs(u_z)^2) of both", Point, in_line, in_line),
            compared("the motor's disc, in line, the same", uniform, in_line, in_line),
            compared("the motor's disc, in line, abs(u_r) over abs(u_z)", uniform, "u_r", "u_z"),
            compared("the motor's disc, root mean square over all angles", uniform, turning, in_line, 2**-0.5),
            compared("the disc's force turns: `flat_over_axial_per_newton`", uniform, turning, in_line),
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


BLOCKS = {
    "models": table_of_models,
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
