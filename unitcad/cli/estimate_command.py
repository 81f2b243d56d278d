"""`unitcad estimate`: the attenuation estimate of one or more specs, as tables for a person or as JSON."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Annotated, Any

import typer
from msgspec import to_builtins

from unitcad.attenuation.edge.answer import Answer
from unitcad.attenuation.edge.models import MODELS
from unitcad.attenuation.edge.words import LEAST, comparison, lines, source_line
from unitcad.attenuation.inputs import EstimateInput
from unitcad.catalogue import FREQUENCIES_HZ
from unitcad.cli.output import level, print_head, print_indented, print_json, progress, warn
from unitcad.cli.shared_options import AsJson, Fit, Sets, Specs, finite, with_fit
from unitcad.designs import design_of
from unitcad.errors import Refusal, unknown_name
from unitcad.estimate_inputs import FEM, answer_spec, estimate_input, estimate_spec
from unitcad.files import scratch, with_ending, write
from unitcad.rooms import load as load_named
from unitcad.spec import Spec
from unitcad.validation import compound_kind, confirm_known, load


def print_unit(variant: EstimateInput, lines: Iterable[str]) -> None:
    """Print a unit's name, design, silicones and frequency, and lines under it."""
    layers = " / ".join(layer.material for layer in variant.layers)
    print_head(variant.name, f": {variant.design}, {layers}, {level(to_builtins(variant.frequency), digits=4)} Hz")
    print_indented(*lines)


def names_of(given: Sequence[str], specs: Sequence[Spec]) -> list[str]:
    """Return the names of specs, and of those with one name what a person typed too."""
    names = [spec.name for spec in specs]
    return [name if names.count(name) == 1 else f"{name} ({text})" for name, text in zip(names, given, strict=True)]


def level_plot(names: Sequence[str], answers: Sequence[Answer]) -> str:
    """Return the levels of units, their 80 % ranges and measurements as a dot plot, SVG, in per cent."""
    from unitcad.export.chart import Estimated, dot_plot

    def per_cent(share: float | None) -> float | None:
        return None if share is None else max(100 * share, 100 * LEAST)

    rows = [
        Estimated(
            name, per_cent(one.level), per_cent(one.low), per_cent(one.high),
            per_cent(one.measured[0].level) if one.measured else None, one.reason,
        )
        for name, one in zip(names, answers, strict=True)
    ]  # fmt: skip
    return dot_plot(rows, "Level at the edge of a unit", "% of the motor's amplitude, logarithmic", "80 % range")


def estimate(
    specs: Specs,
    model: Annotated[
        str,
        typer.Option(
            metavar="MODEL",
            help="Model of the details: rule, published, corrected, fem or all. Default: the spec's.",
        ),
    ] = "",
    frequency: Annotated[
        float | None,
        typer.Option(
            metavar="HZ",
            min=FREQUENCIES_HZ[0],
            max=FREQUENCIES_HZ[1],
            callback=finite,
            help="Frequency of the drive. Default: the motor's.",
        ),
    ] = None,
    fit: Fit = None,
    sets: Sets = None,
    svg: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.svg", help="Draw levels, 80 % ranges and measurements as a dot plot. Default: none."
        ),
    ] = None,
    map_file: Annotated[
        Path | None,
        typer.Option("--map", metavar="FILE", help="Map of the skin's motion: .svg, .png or .html. Default: none."),
    ] = None,
    threshold: Annotated[
        float | None,
        typer.Option(
            metavar="UM", min=1e-3, max=1e4, help="Threshold of touch of the map. Default: the published one there."
        ),
    ] = None,
    share: Annotated[
        float,
        typer.Option(
            metavar="PERCENT", min=0.01, max=100, help="Share of the edge's motion, for the least pitch of the map."
        ),
    ] = 10.0,
    details: Annotated[
        bool, typer.Option("--details", help="Print models, errors, slopes, the skin's curve and assumptions.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Estimate the level at a unit's edge, or an array's crosstalk.

    The first line has the level in per cent of the motor's amplitude, its 80 % range in brackets, and the measurement
    if this unit was measured. The next lines have the model behind it with its error, and the paper's analytic model.
    Several specs are a table, each compared with the first. --map draws the skin's motion and the line where it is no
    longer felt, and prints the felt radius and the least pitch. For an array: the share of a unit's motion at its
    neighbours.
    """

    if model not in ("", "all", *MODELS, FEM):
        raise unknown_name("--model", model, (*MODELS, FEM, "all"))
    models = None if not model else MODELS if model == "all" else (model,)
    specs = [confirm_known(name) for name in specs]
    wanted_map = None
    if map_file is not None:
        from unitcad.report.map_file import MapFile  # loads Pillow

        if len(specs) > 1:
            raise Refusal("--map", str(map_file), "is a picture of one SPEC; give one")
        wanted_map = MapFile(map_file, threshold, share / 100.0)
    elif threshold is not None:
        raise Refusal("--threshold", threshold, "is for the map: give --map FILE")
    if svg and svg.suffix.lower() != ".svg":
        raise Refusal("--svg", str(svg), "takes the name of a file that ends in .svg", with_ending(svg, ".svg"))
    for file in (svg, map_file):
        if file:
            with scratch(file.parent):  # before the work: what can't be written is refused
                pass
    kinds = [kind for kind in map(compound_kind, specs) if kind]
    if kinds:
        if model:
            raise Refusal("--model", model, "an array's crosstalk is a range over the models")
        if svg:
            raise Refusal("--svg", str(svg), "the plot has levels of units, and an array has crosstalk")
        return load_named(kinds[0].estimate)(specs, with_fit(sets, fit), frequency, details, as_json, wanted_map)
    loaded = [load(name, with_fit(sets, fit)) for name in specs]
    if details or as_json:
        for spec in loaded:
            _warn_of_moulds(spec)
    answers = [answer_spec(spec, frequency) for spec in loaded] if svg or not as_json else []
    names = names_of(specs, loaded)
    if svg:
        write(svg, level_plot(names, answers).encode())
    if as_json:
        with progress("estimate") as stage:
            estimates = [estimate_spec(spec, models, frequency, say=stage) for spec in loaded]
            if wanted_map:
                estimates[0]["map"] = wanted_map.of_unit(loaded[0], frequency).figures()
        print_json(estimates[0] if len(estimates) == 1 else {"estimates": estimates})
        return

    asked = [tuple(models or spec.estimate.models) for spec in loaded]
    several = len(loaded) > 1
    if several:
        from unitcad.cli.tables import print_table

        print_table(comparison([*zip(names, answers, strict=True)]))
    last: dict[str, Any] | None = None
    for spec, wanted, one in zip(loaded, asked, answers, strict=True):
        data = None
        if details or FEM in wanted:
            with progress("estimate") as stage:
                data = last = estimate_spec(spec, models, frequency, say=stage)
        if data or not several:
            told = [*lines(one), *(data["answer"]["details"] if data and details else [])]
            print_unit(estimate_input(spec, frequency), told)
        if data:
            from unitcad.cli.estimate_details import print_estimate  # loads rich for its tables

            print_estimate(data, details)
    if wanted_map:
        with progress("map"):
            made = wanted_map.of_unit(loaded[0], frequency)
        print_indented(*made.lines, f"Map: {wanted_map.path}")
    if several and not last:
        for sentence in dict.fromkeys(source_line(one) for one in answers if one.low is not None):
            typer.echo(sentence)
    if details and last:
        from unitcad.cli.estimate_details import print_errors

        print_errors(last["table_error"], last["models"])
    else:
        typer.echo("How sure? --details prints every model, its errors and slopes, the skin's curve and assumptions")


def _warn_of_moulds(spec: Spec) -> None:
    """Warn that `build` would refuse the moulds of a unit that can be estimated."""
    from unitcad.moulds.plan import plan  # the tools' shapes: only the details look at them

    if design_of(spec).passes is None:
        return
    try:
        plan(spec)
    except Refusal as refusal:
        warn(f"warning: {spec.name}: its moulds can't be made: {refusal}")
