"""The command line. Each command parses, calls one function, prints; what is heavy is imported inside it.

Exit 0 done; 1 a finding or a failed variant; 2 a wrong argument, option or input; 130 interrupted. No traceback reaches
a user.
"""

from __future__ import annotations

import os
import sys
from importlib import import_module
from typing import Annotated, Any, cast

import typer

from unitcad import __version__
from unitcad.cli.output import say_error, speak_anywhere
from unitcad.errors import UnitcadError

COMMANDS = {
    "build": "build",
    "batch": "batch",
    "check": "check",
    "design": "design",
    "estimate": "estimate",
    "experiments": "experiments",
    "accuracy": "accuracy",
    "coupon": "coupon",
    "fit": "fit",
    "init": "init",
    "list": "list_",
    "material": "material",
    "measure": "measure",
    "phantom": "phantom",
    "report": "report",
    "schema": "schema",
    "serve": "serve",
    "cache": "cache",
}
"""The commands in the order of --help, and what each is called in its module."""
INTERRUPTED = 130
WrongArguments = cast(type[typer.BadParameter], typer.BadParameter.__mro__[2])
"""Typer's error of the command line itself, such as an unknown option: ClickException, its own or click's."""


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"unitcad {__version__}")
        raise typer.Exit()


def application(*commands: str) -> typer.Typer:
    """Return the command line with these commands alone: reading the arguments of one does not load the others."""
    app = typer.Typer(
        name="unitcad",
        help="Haptic units, their casting moulds and an attenuation estimate, from a short TOML spec.",
        no_args_is_help=True,
        add_completion=False,
        pretty_exceptions_enable=False,
        rich_markup_mode=None,  # boxes cut long option names, and markup swallows square brackets
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    for name in commands:
        command = getattr(import_module(f"unitcad.cli.{name}_command"), COMMANDS[name])
        if isinstance(command, typer.Typer):
            app.add_typer(command, name=name)
        else:
            app.command(name)(command)
    app.callback()(_root)
    return app


def __getattr__(name: str) -> typer.Typer:
    """Return `app`, the whole command line. Raises AttributeError for any other name."""
    if name != "app":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    globals()[name] = application(*COMMANDS)
    return globals()[name]


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
        named = [word for word in sys.argv[1:2] if word in COMMANDS]
        code = application(*(named or COMMANDS))(standalone_mode=False)
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
