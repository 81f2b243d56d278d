"""The command `python -m benchmarks.accuracy [SUITE...]`."""

from __future__ import annotations

import signal
import sys
from pathlib import Path
from typing import Annotated

import typer

from benchmarks.accuracy import runner
from benchmarks.accuracy.pages import markdown
from unitcad.cli.output import form_of, print_json, progress, say_error
from unitcad.errors import Missing, Refusal, UnitcadError


def accuracy(
    suites: Annotated[list[str] | None, typer.Argument(metavar="SUITE", help="Suites to run; default: all.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Fewer cases: the suites as CI runs them.")] = False,
    specs: Annotated[
        int | None,
        typer.Option(min=40, help="Number of random specs of the suite extremes, 3 % beyond the documented ranges."),
    ] = None,
    media: Annotated[
        int | None, typer.Option(min=10, max=90_000, help="Number of random media of the suite stability.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="Seed of the random media.")] = 0,
    out: Annotated[
        Path | None,
        typer.Option(
            "-o", "--out", help="Folder of the pages and accuracy.json; default: docs/evidence, none if quick."
        ),
    ] = None,
    as_json: Annotated[bool, typer.Option("--json", help="One JSON object on standard output.")] = False,
) -> None:
    """Compute the tables of error against run time. Exit 1 when an error exceeds its promise.

    Without a SUITE, suites whose packages are not installed are left out, each with the reason.
    """
    names = runner.chosen(suites or [])
    if specs is not None and names != ("extremes",):
        raise Refusal("SUITE", " ".join(names), "--specs goes with the suite extremes alone", "extremes")
    if media is not None and names != ("stability",):
        raise Refusal("SUITE", " ".join(names), "--media goes with the suite stability alone", "stability")
    if seed and media is None:
        raise Refusal("--seed", seed, "goes with --media, which says how many")
    count = specs if specs is not None else media
    if count is not None and quick:
        option = "--specs" if media is None else "--media"
        raise Refusal("--quick", "set", f"does not go with {option}, which says how many; leave one out")
    results = []
    left_out: dict[str, str] = {}
    folder = out if out is not None or quick else Path("docs") / "evidence"
    if folder is not None:
        runner.ready(folder)
    for name in suites or ():
        runner.check(name)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # worker processes end with us
    for name in names:
        try:
            with progress(name) as say:
                result = runner.run(name, quick, say, count, seed)
        except Missing as missing:
            if suites:
                raise
            left_out[name] = str(missing)
            continue
        except KeyboardInterrupt:
            if count is not None:
                typer.echo(f"{runner.JOURNALS[name]} keeps what is finished; the same command resumes", err=True)
            raise
        results.append(result)
        if folder is not None:
            runner.write([result], folder)  # an interrupted run keeps what it has
        if not as_json:
            typer.echo(markdown(result))
    if as_json:
        print_json({"suites": [result.as_dict() for result in results], "left_out": left_out})
    for name, reason in left_out.items():
        typer.echo(f"{name}: left out: {reason}", err=True)
    broken = [(result.suite, promise) for result in results for promise in result.promises if not promise.ok]
    for suite, promise in broken:
        typer.echo(f"{suite}: {promise.what}: {promise.value:g}, promised {promise.limit:g}", err=True)
    if broken:
        sys.exit(1)


def main() -> None:
    """Run the command; an error is one line and exit code 2."""
    form = form_of(sys.argv)
    app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
    app.command()(accuracy)
    try:
        app(prog_name="python -m benchmarks.accuracy")
    except UnitcadError as error:
        say_error(error, form)
        sys.exit(error.exit_code)
