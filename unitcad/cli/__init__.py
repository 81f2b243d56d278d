"""The command line. Each command parses, calls one function, prints; what is heavy is imported inside it.

Exit 0 done; 1 a finding or a failed variant; 2 a wrong argument, option or input; 130 interrupted. No traceback reaches
a user.
"""

from __future__ import annotations

import os
import sys
from typing import Annotated, Any, cast

import typer

from unitcad import __version__
from unitcad.cli.accuracy_command import accuracy
from unitcad.cli.batch_command import batch
from unitcad.cli.build_command import build
from unitcad.cli.cache_command import cache
from unitcad.cli.check_command import check
from unitcad.cli.coupon_command import coupon
from unitcad.cli.design_command import design
from unitcad.cli.estimate_command import estimate
from unitcad.cli.experiments_command import experiments
from unitcad.cli.fit_command import fit
from unitcad.cli.init_command import init
from unitcad.cli.list_command import list_
from unitcad.cli.material_command import material
from unitcad.cli.measure_command import measure
from unitcad.cli.output import say_error, speak_anywhere
from unitcad.cli.phantom_command import phantom
from unitcad.cli.report_command import report
from unitcad.cli.schema_command import schema
from unitcad.cli.serve_command import serve
from unitcad.errors import UnitcadError

app = typer.Typer(
    name="unitcad",
    help="Haptic units, their casting moulds and an attenuation estimate, from a short TOML spec.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # boxes cut long option names, and markup swallows square brackets
    context_settings={"help_option_names": ["-h", "--help"]},
)


INTERRUPTED = 130
WrongArguments = cast(type[typer.BadParameter], typer.BadParameter.__mro__[2])
"""Typer's error of the command line itself, such as an unknown option: ClickException, its own or click's."""


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"unitcad {__version__}")
        raise typer.Exit()


app.command("build")(build)
app.command("batch")(batch)
app.command("check")(check)
app.command("design")(design)
app.command("estimate")(estimate)
app.command("experiments")(experiments)
app.command("accuracy")(accuracy)
app.command("coupon")(coupon)
app.command("fit")(fit)
app.command("init")(init)
app.command("list")(list_)
app.command("material")(material)
app.command("measure")(measure)
app.command("phantom")(phantom)
app.command("report")(report)
app.command("schema")(schema)
app.command("serve")(serve)
app.add_typer(cache, name="cache")


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and stop.")
    ] = False,
) -> None:
    pass


def main() -> None:
    """Entry point of `unitcad`: run a command, turn every error into one line and an exit code."""
    as_json = "--json" in sys.argv
    speak_anywhere()
    try:
        code = app(standalone_mode=False)
        if code == INTERRUPTED:
            typer.echo("interrupted", err=True)
        sys.exit(code or 0)
    except WrongArguments as error:
        _refuse(error, as_json)
        sys.exit(error.exit_code)
    except UnitcadError as error:
        say_error(error, as_json)
        sys.exit(error.exit_code)
    except KeyboardInterrupt:
        typer.echo("interrupted", err=True)
        sys.exit(INTERRUPTED)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
    except OSError as error:
        place = f"{error.filename}: " if error.filename else ""
        say_error(UnitcadError(f"{place}{error.strerror or error}"), as_json)
        sys.exit(2)
    except Exception as error:
        if os.environ.get("UNITCAD_TRACEBACK"):
            raise
        say_error(
            UnitcadError(f"internal error: {type(error).__name__}: {error} (a bug; UNITCAD_TRACEBACK=1 shows where)"),
            as_json,
        )
        sys.exit(1)


def _refuse(error: Any, as_json: bool) -> None:
    """Print an error of Typer's as one line, with the command whose help says more."""
    context = getattr(error, "ctx", None)
    message = error.format_message()
    if context and message == context.get_help() and not as_json:  # a command alone that needs another one after it
        error.show()
        return
    line = " ".join(message.partition("\n")[0].split()).rstrip(".")
    say_error(UnitcadError(f"{line}; see {context.command_path if context else 'unitcad'} --help"), as_json)
