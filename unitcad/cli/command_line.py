"""The parser of the command line, by Typer."""

from __future__ import annotations

from typing import Annotated, Any, cast

import typer

from unitcad import __version__
from unitcad.cli.output import Form, form_of, say_error
from unitcad.errors import UnitcadError
from unitcad.rooms import commands, load

WrongArguments = cast(type[typer.BadParameter], typer.BadParameter.__mro__[2])
"""Typer's error of the command line itself, such as an unknown option: ClickException, its own or click's."""


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"unitcad {__version__}")
        raise typer.Exit()


def application(*names: str) -> typer.Typer:
    """Return the command line with these commands, or with all: reading one does not load the others."""
    app = typer.Typer(
        name="unitcad",
        help="Haptic units, their casting moulds and an attenuation estimate, from a short TOML spec.",
        no_args_is_help=True,
        add_completion=False,
        pretty_exceptions_enable=False,
        rich_markup_mode=None,  # boxes cut long option names, and markup swallows square brackets
        context_settings={"help_option_names": ["-h", "--help"]},
    )
    known = commands()
    for name in names or known:
        command = load(known[name])
        if isinstance(command, typer.Typer):
            app.add_typer(command, name=name)
        else:
            app.command(name)(command)
    app.callback()(_root)
    return app


def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and stop.")
    ] = False,
) -> None:
    pass


def run(words: list[str]) -> int:
    """Run the command of the program's arguments; return its exit code. Says itself what is wrong with them."""
    try:
        return application(*(word for word in words[:1] if word in commands()))(standalone_mode=False) or 0
    except WrongArguments as error:
        _refuse(error, form_of(words))
        return error.exit_code


def _refuse(error: Any, form: Form) -> None:
    """Print an error of Typer's as one line, with the command whose help says more."""
    context = getattr(error, "ctx", None)
    message = error.format_message()
    if context and message == context.get_help() and form == "text":  # a command alone that needs another one after it
        error.show()
        return
    line = " ".join(message.partition("\n")[0].split()).rstrip(".")
    say_error(UnitcadError(f"{line}; see {context.command_path if context else 'unitcad'} --help"), form)
