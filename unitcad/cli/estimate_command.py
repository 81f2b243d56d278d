"""`unitcad estimate`: the attenuation estimate of one or more specs, as tables for a person or as JSON."""

from __future__ import annotations

import math
import re
from typing import Annotated

import typer

from unitcad.attenuation.edge.models import MODELS
from unitcad.catalogue import FREQUENCIES_HZ
from unitcad.cli.estimate_tables import print_errors, print_estimate, print_frequencies, print_neighbours
from unitcad.cli.output import print_json, progress, warn
from unitcad.cli.shared_options import AsJson, Fit, Sets, with_fit
from unitcad.designs import design_of
from unitcad.errors import Refusal, unknown_name
from unitcad.estimate_inputs import FEM, estimate_spec, frequency_table_of_spec, neighbours_of_specs
from unitcad.moulds.plan import plan
from unitcad.rooms import load as load_named
from unitcad.spec import Spec
from unitcad.validation import compound_kind, confirm_known, load

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
    pitch: Annotated[
        float | None,
        typer.Option(
            metavar="MM", help="Pitch of units in a row: how far the first moves the others. Default: one unit."
        ),
    ] = None,
    masses: Annotated[
        bool, typer.Option("--masses", help="Include the units' masses in an array's crosstalk.")
    ] = False,
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
        if pitch is not None:
            raise Refusal("--pitch", pitch, "an array has its own pitch: --set layout.pitch_mm=...")
        if model:
            raise Refusal("--model", model, "an array's crosstalk is a range over the models")
        return load_named(kinds[0].subject).estimate(specs, with_fit(sets, fit), hertz, masses, details, as_json)
    if masses:
        raise Refusal("--masses", None, "is for arrays; units in a row, with their masses: --pitch")
    loaded = [load(name, with_fit(sets, fit)) for name in specs]
    for spec in loaded:
        _warn_of_moulds(spec)
    beside = {} if pitch is None else {"neighbours": neighbours_of_specs(loaded, pitch, hertz)}
    if ":" in frequency:
        estimates = [frequency_table_of_spec(spec, hertz, models) for spec in loaded]
    else:
        with progress("estimate") as stage:
            estimates = [estimate_spec(spec, models, hertz[0] if hertz else None, say=stage) for spec in loaded]
    if as_json:
        print_json(estimates[0] if len(estimates) == 1 else {"estimates": estimates, **beside})
        return

    for block in beside.values():
        print_neighbours(block)
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
