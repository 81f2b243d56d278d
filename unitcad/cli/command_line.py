"""The command line, by Typer. A command's module is imported when the command runs or its help is asked for."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from difflib import get_close_matches
from functools import partial
from typing import Annotated, Any, cast

import typer
from typer.core import TyperCommand, TyperGroup
from typer.main import get_command

from unitcad import __version__
from unitcad.cli.output import form_of, say_error
from unitcad.errors import Refusal, UnitcadError, unknown_name
from unitcad.hook_words import HOOK, options_ended
from unitcad.rooms import commands, load
from unitcad.text import measured

WrongArguments = cast(type[typer.BadParameter], typer.BadParameter.__mro__[2])
"""Typer's error of the command line itself, such as an unknown option: ClickException, its own or click's."""
_PLAIN: dict[str, Any] = {
    "add_completion": False,
    "pretty_exceptions_enable": False,
    "rich_markup_mode": None,  # boxes cut long option names, and markup swallows square brackets
}


class _Command(TyperCommand):
    """A command; with `--hook`, file names follow the options and may look like options themselves."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        valued = {name for one in self.params if not getattr(one, "is_flag", True) for name in one.opts}
        return super().parse_args(ctx, options_ended(args, valued) if HOOK in args else args)


class _Commands(TyperGroup):
    """The commands of the core and of the rooms."""

    def list_commands(self, ctx: Any) -> list[str]:
        return list(commands())

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        known = commands()
        if cmd_name not in known:
            raise unknown_name("COMMAND", cmd_name, [*known, "--help", "--version"])
        command = load(known[cmd_name].run)
        if not isinstance(command, typer.Typer):
            alone = typer.Typer(**_PLAIN)
            alone.command(cmd_name, cls=_Command)(command)
            command = alone
        made = get_command(command)
        made.name = cmd_name
        for one in (made, *getattr(made, "commands", {}).values()):
            lines = [f"  {line}" for line in known[cmd_name].examples if one is made or one.name in line.split()]
            one.epilog = "\n".join(["\b", "Examples:", *lines])
            for parameter in one.params:
                parameter.get_help_record = partial(_help_record, parameter)
        return made

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        groups: dict[str, list[tuple[str, str]]] = {}
        for name, command in commands().items():
            groups.setdefault(command.group, []).append((name, command.help))
        for group, rows in groups.items():
            with formatter.section(group):
                formatter.write_dl(rows)


def _help_record(parameter: Any, ctx: Any) -> tuple[str, str]:
    """Return Typer's line of a parameter for a help, with default and range as sentences."""
    names, text = type(parameter).get_help_record(parameter, ctx)
    text = re.sub(r"  \[default: ([^];]*?)\.?(?:; (.*))?\]$", r" Default: \1.  [\2]", text)
    text = re.sub(r"  \[(?:(\S+)<=)?x[<>]=(\S+)\]$", _range, text)
    return names, text.removesuffix("  []")


def _range(ends: re.Match[str]) -> str:
    low, high = (end and f"{float(end):,.15g}" for end in ends.groups())
    return f" From {low} to {high}." if low else f" At least {high}."


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"unitcad {__version__}")
        raise typer.Exit()


def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and stop.")
    ] = False,
) -> None:
    pass


app = typer.Typer(
    name="unitcad",
    cls=_Commands,
    help="Haptic units, their casting moulds and an attenuation estimate, from a short TOML spec.",
    no_args_is_help=True,
    context_settings={"help_option_names": ["-h", "--help"]},
    **_PLAIN,
)
app.callback()(_root)


def run(words: list[str]) -> int:
    """Run the command of the program's arguments; return its exit code. Prints the error of a wrong argument."""
    try:
        return app(words, prog_name="unitcad", standalone_mode=False) or 0
    except WrongArguments as error:
        _refuse(error, words)
        return error.exit_code


def out_of(words: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Yield the options that name where results go, as typed, and their values."""
    for i, word in enumerate(words):
        option, equals, value = word.partition("=")
        if option in ("-o", "--out", "--map", "--svg", "--table"):
            yield option, value if equals else "".join(words[i + 1 : i + 2])


def _refuse(error: Any, words: list[str]) -> None:
    """Print an error of Typer's as one line, with the command whose help explains it."""
    context, form = getattr(error, "ctx", None), form_of(words)
    message = error.format_message()
    if context and message == context.get_help() and form == "text":  # a command alone that needs another one after it
        error.show()
        return
    say_error(_in_style(error, context.command_path if context else f"unitcad {words[0]}"), form)


def _in_style(error: Any, command: str) -> UnitcadError:
    """Return an error of Typer's as one of unitcad's: option, value, limit, nearest accepted value or next step."""
    text = " ".join(error.message.partition("\n")[0].split()).rstrip(".") if error.message else "is required"
    text = re.sub(r"Got unexpected extra argument.*\((.*)\)", r"unexpected argument: \1", text)
    parameter, option, more = getattr(error, "param", None), getattr(error, "option_name", ""), f"see {command} --help"
    if parameter is None:
        if not hasattr(error, "possibilities"):
            return UnitcadError(re.sub("Option '(.*?)'", r"\1:", f"{text}; {more}"))
        if option == "--jobs":
            more = "unitcad batch and unitcad check take it"
        known = {name.lstrip("-"): name for one in error.ctx.command.params for name in one.opts}
        close = [known[name] for name in get_close_matches(option.lstrip("-"), known, cutoff=0.6)]
        return Refusal(option, None, f"unknown option; {'closest: ' + ', '.join(close) if close else more}")
    name = max(parameter.opts, key=len) if parameter.param_type_name == "option" else parameter.make_metavar(error.ctx)
    if outside := re.fullmatch(r"(\S+) is not in the range .*", text):
        low, high = parameter.type.min, parameter.type.max
        value = float(outside[1])
        limit = f"must be at least {low:g}" if high is None else f"must be from {low:g} to {high:g}"
        return Refusal(name, value, limit, float(low if high is None or value < low else high))
    if wrong := re.fullmatch(r"'(.*)' is not a valid (int|float).*", text):
        unit = f" ({parameter.metavar})" if parameter.metavar not in (None, "N") else ""
        whole = "whole " if wrong[2] == "int" else ""
        meant = measured(wrong[1], (parameter.metavar or "").lower())
        such = "" if meant is not None else f", such as {parameter.default or 1}"
        return Refusal(name, wrong[1], f"takes a {whole}number{unit}{such}", meant)
    return Refusal(name.strip("{}"), None, f"{text}; {more}")
