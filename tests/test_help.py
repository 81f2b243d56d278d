"""The help of every command follows one style: capitals, metavars, defaults, examples, groups."""

import shlex

import pytest
import typer

from unitcad.cli.command_line import app
from unitcad.rooms import commands

GROUPS = ["Make", "Check", "Estimate and choose", "Lab", "Look"]
ROOT = typer.main.get_command(app)
CONTEXT = typer.Context(ROOT, info_name="unitcad")


def every_command():
    for name in commands():
        command = ROOT.get_command(CONTEXT, name)
        yield name, command
        yield from ((f"{name} {child}", one) for child, one in getattr(command, "commands", {}).items())


def is_flag(parameter):
    return parameter.name == "help" or getattr(parameter, "is_flag", False)


PARAMETERS = [
    pytest.param(parameter, id=f"{words}-{parameter.name}")
    for words, command in every_command()
    for parameter in command.params
]


@pytest.mark.parametrize("parameter", PARAMETERS)
def test_a_parameter_says_what_goes_in_and_what_holds_without_it(parameter):
    text = parameter.help
    assert text[0].isupper() or text.startswith("manifest.json")
    assert text.endswith(".")
    told = parameter.get_help_record(CONTEXT)[1]
    assert "[default" not in told
    assert "x>=" not in told
    assert is_flag(parameter) or parameter.metavar, "needs a metavar"
    open_flag = is_flag(parameter) and parameter.default is None
    if open_flag or not (is_flag(parameter) or parameter.required or parameter.multiple or parameter.nargs == -1):
        assert "Default: " in text or parameter.default not in (None, ""), "names no default"


@pytest.mark.parametrize("name", commands())
def test_a_help_ends_with_two_examples_that_the_command_takes(name):
    command = ROOT.get_command(CONTEXT, name)
    lines = command.get_help(typer.Context(command, info_name=f"unitcad {name}")).splitlines()
    head, *examples = [line.strip() for line in lines[-1 - len(commands()[name].examples) :]]
    assert head == "Examples:"
    assert examples == list(commands()[name].examples)
    assert len(examples) == 2
    for line in examples:
        program, word, *rest = shlex.split(line)
        assert (program, word) == ("unitcad", name)
        if children := getattr(command, "commands", None):
            children[rest[0]].make_context(rest[0], rest[1:])
        else:
            command.make_context(name, rest)


def test_commands_are_in_known_groups_and_each_line_is_its_helps_first():
    assert {command.group for command in commands().values()} <= set(GROUPS)
    for name, listed in commands().items():
        first = " ".join(ROOT.get_command(CONTEXT, name).help.partition("\n\n")[0].split())
        assert first.startswith(listed.help)


def test_a_table_in_a_pipe_has_its_full_width(capsys):
    from rich.table import Table

    from unitcad.cli.tables import console

    table = Table("unit", "remark")
    table.add_row("a" * 120, "b" * 120)
    console().print(table)
    assert "a" * 120 + " │ " + "b" * 120 in capsys.readouterr().out
