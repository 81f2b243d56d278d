"""Troubleshooting: the docs' page has every trouble, a set's page those that it can have."""

import re
from pathlib import Path

from unitcad.casting.troubles import troubles, troubles_markdown
from unitcad.moulds.mould_set import MouldSet
from unitcad.spec.fields import entry_in, fields_of, table_in
from unitcad.spec.raw import RawSpec
from unitcad.validation import load

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "troubleshooting.md"


def signs(*source):
    return {trouble.sign for trouble in troubles(MouldSet(load(source[0], list(source[1:]))))}


def test_the_docs_page_is_what_the_sheets_are_made_of():
    assert PAGE.read_text("utf-8").endswith(troubles_markdown(troubles()).partition("\n")[2])


def test_a_set_lists_what_it_can_have():
    """An embedded unit has neither tongue nor filament, one with wires no circuit that a slot must pass."""
    every = {trouble.sign for trouble in troubles()}
    assert signs("encapsulating") == every
    slots = {"A film closes the slot", "The circuit won't pass the slot"}
    assert every - signs("embedded") == {"The unit sticks on the core", *slots}
    for vacuum in (True, False):
        page = troubles_markdown(troubles(MouldSet(load("embedded", {"casting.vacuum": vacuum}))))
        assert ("casting.vacuum = true" in page) != vacuum
    assert every - signs("no-fpcb") == {"The circuit won't pass the slot"}


def test_the_keys_to_change_are_keys_of_a_spec():
    for trouble in troubles():
        for table, key in re.findall(r"\b([a-z]+)(?:\.0)?\.([a-z_]+)\b", trouble.spec):
            of = fields_of(RawSpec)[table].type
            kind = table_in(of) or table_in(entry_in(of))
            assert kind
            assert key in fields_of(kind), (table, key)
