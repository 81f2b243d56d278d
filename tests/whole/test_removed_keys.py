"""Keys that an earlier version's files had: each refusal says what took its place, or that it went and what to do."""

import pytest

from unitcad.errors import UnknownKey
from unitcad.rooms import file_kinds
from unitcad.rooms import load as load_reference
from unitcad.spec import convert
from unitcad.spec.fields import entry_in, fields_of, named_in, table_in


def removed_keys():
    """Every key of an earlier version: the kind of its file, its table, the key, and what took its place."""
    for kind in file_kinds():
        pending = [load_reference(kind.model)] if kind.model else []
        seen = set()
        while pending:
            table = pending.pop()
            if table in seen:
                continue
            seen.add(table)
            for field in fields_of(table).values():
                below = (field.type, entry_in(field.type), named_in(field.type))
                pending += [one for one in map(table_in, below) if one]
            for key, after in getattr(table, "removed", {}).items():
                yield pytest.param(table, key, after, id=f"{kind.name}: {table.__name__}.{key}")


@pytest.mark.parametrize(("table", "key", "after"), [*removed_keys()])
def test_a_removed_key_names_what_took_its_place(table, key, after):
    known = fields_of(table)
    assert key not in known, "the key is back: take it out of `removed`"
    with pytest.raises(UnknownKey) as refused:
        convert({key: 1}, table)
    if after in known:
        assert f"{after} took its place" in str(refused.value)
        assert refused.value.nearest == after
    else:
        assert f"unknown key; it went: {after}" in str(refused.value)


def test_keys_of_earlier_versions_are_remembered():
    """Those that an older file can have; a new removal is added here and to its table."""
    gone = {param.id.partition(".")[2] for param in removed_keys()}
    assert gone >= {
        *("stack", "body", "blank", "full_scale", "own", "override", "measure", "order", "q", "trim_s", "zero_phase"),
        *("spec", "cast", "cavity", "lines", "with_paper", "coupons", "inside_mm", "stage_bolt_mm", "stage_pitch_mm"),
        *("room_c", "scale_resolution_g", "loss_factor", "measured", "draft_deg"),
    }
