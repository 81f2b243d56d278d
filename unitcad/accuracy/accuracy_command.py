"""`unitcad accuracy`: errors and their bounds, measured here, for one spec or for random media and specs."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Annotated, Any

import typer
from rich.table import Table

from unitcad.accuracy.amplification import amplifications, extremes
from unitcad.accuracy.measurements import mesh_rows, response_rows, skipped_rows
from unitcad.accuracy.survey import survey_media, survey_specs
from unitcad.cli.output import print_json, progress
from unitcad.cli.shared_options import AsJson, Sets
from unitcad.cli.tables import console
from unitcad.designs import design_of
from unitcad.errors import Refusal
from unitcad.estimate_inputs import estimate_input
from unitcad.json_text import rounded
from unitcad.pipeline.subjects import load_subject

_MEDIA, _SPECS = 20, 20
_INPUTS = 8
"""Inputs in the table of amplifications; JSON has all."""
EXACT = 17
"""Significant digits that keep every number as it is."""
_MESHES = {
    "tolerance_mm": "tolerance",
    "triangles": "triangles",
    "distance_mm": "distance, mm",
    "distance_bound_mm": "bound",
    "body": "worst",
    "volume": "volume",
    "volume_bound": "bound",
    "s": "s",
}
_RESPONSE = {"rtol": "rtol", "error": "error", "bound": "bound", "over_bound": "of bound", "wavenumbers": "k", "s": "s"}
_EXTREMES = {"what": "", "value": "value", "at": "at", "limit": "limit", "extreme": ""}
_REQUESTS = {"request": "request", "s": "s", "quartiles": "quartiles", "saved_s": "saved", "skipped": "skipped"}
_MEDIA_HEADS = {
    "responses": "responses",
    "within_rtol": "within rtol",
    "bounds_broken": "broken",
    "over_bound": "of bound",
    "longest_s": "longest, s",
}
_RANGES = ("ranges", "specs", "built", "refused", "faults", "longest_s")


def accuracy(
    spec: Annotated[
        str | None,
        typer.Argument(metavar="[SPEC]", help="Spec or array file, or name of a template. Default: the survey."),
    ] = None,
    sets: Sets = None,
    media: Annotated[
        int | None, typer.Option(metavar="N", min=1, max=90_000, help=f"Random media of the survey. Default: {_MEDIA}.")
    ] = None,
    specs: Annotated[
        int | None, typer.Option(metavar="N", min=2, max=90_000, help=f"Random specs of the survey. Default: {_SPECS}.")
    ] = None,
    seed: Annotated[int, typer.Option(metavar="N", min=0, help="Seed of the random media and specs.")] = 0,
    as_json: AsJson = False,
) -> None:
    """Measure the errors of meshes and response, their bounds and what they cost. Exit 1 if an error exceeds its bound.

    With SPEC: error against time at five tolerances, the inputs that move the results most, and the parts that a build
    leaves out. An array's response and inputs are those of its unit. Without SPEC: the bounds of random media, and
    builds of random specs.
    """
    if spec is None:
        if sets:
            raise Refusal("--set", sets[0], "changes a spec: name one")
        _survey(media or _MEDIA, specs or _SPECS, seed, as_json)
        return
    for option, value in (("--media", media), ("--specs", specs), ("--seed", seed or None)):
        if value is not None:
            raise Refusal(option, value, "is for the survey, which has no SPEC")
    _one_spec(spec, sets, as_json)


def _one_spec(name: str, sets: Sequence[str] | None, as_json: bool) -> None:

    subject = load_subject(name, sets or ())
    spec = subject.unit
    with progress("accuracy") as say:
        data: dict[str, Any] = {"spec": subject.name, "meshes": mesh_rows(subject.moulds, say)}
        if design_of(spec).passes is not None:
            say("response")
            variant = estimate_input(spec)
            data |= {"response": response_rows(variant), "extremes": extremes(spec, variant)}
            say("inputs")
            data["amplification"] = amplifications(spec, variant)
        say("requests")
        data["skipped"] = skipped_rows(subject)
    if as_json:
        print_json(rounded(data, EXACT))
    else:
        _print_spec(data)
    broken = not all(row.get("within_bounds", True) for row in data["meshes"])
    if broken or any(not row["over_bound"] <= 1 for row in data.get("response", ())):
        typer.echo(f"{subject.name}: an error exceeds its bound", err=True)
        sys.exit(1)


def _survey(media: int, specs: int, seed: int, as_json: bool) -> None:

    with progress("accuracy") as say:
        data = {"media": survey_media(media, seed, say), "specs": survey_specs(specs, seed, say)}
    if as_json:
        print_json(rounded(data, EXACT))
    else:
        _table("Random media by rtol", {"rtol": "rtol", **_MEDIA_HEADS}, data["media"]["by_rtol"])
        _table("Random media by class", {"class": "class", **_MEDIA_HEADS}, data["media"]["by_class"])
        worst = data["media"]["worst"]
        _line(f"closest to its bound: {worst['class']}, seed {worst['seed']}, rtol {worst['rtol']:g}")
        _table("Random specs", {name: name.replace("_", " ") for name in _RANGES}, data["specs"]["by_ranges"])
    for fault in data["specs"]["faults"]:
        typer.echo(f"fault: {fault['ranges']} {fault['seed']}: {fault['kind']}: {fault['message']}", err=True)
    broken = sum(row["bounds_broken"] for row in data["media"]["by_rtol"])
    if broken:
        typer.echo(f"{broken} bounds broken", err=True)
    if broken or data["specs"]["faults"]:
        sys.exit(1)


def _print_spec(data: dict[str, Any]) -> None:
    _table(f"{data['spec']}: meshes of unit and moulds, against the exact surfaces", _MESHES, data["meshes"])
    if data["meshes"][0]["distance_mm"] is None:
        _line("no exact surfaces to compare with: the extra step is not installed")
    if "response" in data:
        _table("Response of the skin, 0 to 30 mm from the unit's edge", _RESPONSE, data["response"])
        rows = [{**row, "extreme": "extreme" if row["extreme"] else ""} for row in data["extremes"]]
        _table("Stiff or extreme", _EXTREMES, rows)
        _print_amplification(data["amplification"]["results"])
    rows = [
        {
            **row,
            "quartiles": f"{_shown(row['s_low'])} to {_shown(row['s_high'])}",
            "skipped": ", ".join(one["output"] for one in row["skipped"]),
        }
        for row in data["skipped"]
    ]
    _table("Time saved by requests for fewer outputs; - if the quartiles overlap", _REQUESTS, rows)


def _print_amplification(results: Sequence[dict[str, Any]]) -> None:
    moves = {name: [one["by"].get(name) or 0.0 for one in results] for one in results for name in one["by"]}
    most = sorted(moves, key=lambda name: -max(map(abs, moves[name])))[:_INPUTS]
    heads = [one["result"].replace("edge level, model ", "level, ") for one in results]
    rows = [{"input": name, **dict(zip(heads, moves[name], strict=True))} for name in most]
    title = f"Change of a result over the change of an input, each moved by 1e-6: the {len(most)} strongest inputs"
    _table(title, {name: name for name in ("input", *heads)}, rows)
    for head, one in zip(heads, results, strict=True):
        worst = f"at most {_shown(one['amplification'])}, by {one['worst']}" if one["worst"] else "no finite value"
        worst = worst if one["amplification"] != 0 else "reads none of them"
        _line(f"{head}: {worst}")


def _table(title: str, heads: dict[str, str], rows: Sequence[dict[str, Any]]) -> None:

    table = Table(box=None, header_style="")
    for name, head in heads.items():
        number = any(isinstance(row.get(name), int | float) for row in rows)
        table.add_column(head, justify="right" if number else "left")
    for row in rows:
        table.add_row(*(_shown(row.get(name)) for name in heads))
    console().print(title, style="bold", soft_wrap=True)
    console().print(table)


def _line(text: str) -> None:
    console().print(f"  {text}", soft_wrap=True)


def _shown(value: Any) -> str:
    return "-" if value is None else f"{value:.3g}" if isinstance(value, float) else str(value)
