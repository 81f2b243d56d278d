"""The pages of the reference that are made from the package: nothing that the package knows is left out."""

import re
import typing

import pytest
import typer
from msgspec import Struct

from docs.generated import FILES, keys_of_file, pages, tables
from unitcad import catalogue
from unitcad.catalogue.entries import kinds_of
from unitcad.checks import mould_checks
from unitcad.cli.command_line import app
from unitcad.lab.record import RULES
from unitcad.meshcheck.rules.registry import rules
from unitcad.rooms import commands, load
from unitcad.spec.fields import fields_of
from unitcad.spec.raw import RawSpec

PAGES = pages()


def test_the_spec_page_has_every_key_of_every_table():
    for header, table in tables(RawSpec):
        section = PAGES["reference/spec.md"].split(f"## {header or 'The file'}\n")[1].split("\n## ")[0]
        assert re.findall(r"(?m)^\| `(\w+)` \|", section) == list(fields_of(table)), header


@pytest.mark.parametrize(
    ("kind", "entry"),
    [
        ("materials", catalogue.Material),
        ("motors", catalogue.Motor),
        ("printers", catalogue.Printer),
        ("tissue", catalogue.Tissue),
    ],
)
def test_every_key_of_the_catalogue_has_its_range(kind, entry):
    section = PAGES["reference/spec.md"].split(f"## [{kind}.NAME")[1].split("\n## ")[0]
    for key, annotated in kinds_of(entry):
        (note,) = annotated.__metadata__
        words = ", ".join(f'`"{word}"`' for word in typing.get_args(typing.get_args(annotated)[0]))
        span = f"{note.ge:g} to {note.le:g}" if note.ge is not None else "text" if note.max_length else words
        assert f"| `{key}` | {span}, table |  | {note.description[0].upper()}{note.description[1:]} |" in section


def test_every_kind_of_file_has_a_page_and_every_key_a_description():
    kinds = {"spec", "array", "sweep", "target", "campaign", "fit", "phantom", "cast-record"}
    assert {kind.name for kind in FILES} == kinds
    for kind in FILES:
        assert all(table.__doc__ for _, table in tables(load(kind.model)))

    class Plain(Struct):
        key: int = 1

    with pytest.raises(ValueError, match=r"Plain\.key has no description"):
        keys_of_file("plain", Plain)


def test_the_command_line_page_has_every_command_and_option():
    group = typer.main.get_command(app)
    page = PAGES["reference/command-line.md"]
    for name in commands():
        section = page.split(f"\n## unitcad {name}\n")[1].split("\n## ")[0]
        command = group.get_command(typer.Context(group), name)
        for one in (command, *getattr(command, "commands", {}).values()):
            assert all(option in section for parameter in one.params for option in parameter.opts if option[0] == "-")


def test_every_check_and_finding_has_a_section():
    assert re.findall(r"(?m)^## (C\d+) ", PAGES["reference/mould-checks.md"]) == list(mould_checks())
    assert re.findall(r"(?m)^## (L\d+) ", PAGES["reference/recording-findings.md"]) == list(RULES)


def test_the_page_has_a_section_for_each_rule():
    page = PAGES["reference/mesh-rules.md"]
    assert re.findall(r"(?m)^### (\w+)", page) == list(rules())
    for rule in rules().values():
        assert f"{rule.cause}\n\n**Example.** {rule.example}\n\n**Fix.** {rule.fix}\n" in page
