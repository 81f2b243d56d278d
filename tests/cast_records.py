"""Cast records as tests read and write them."""

from __future__ import annotations

import msgspec

from unitcad.casting.cast_record import CastRecord
from unitcad.errors import Refusal
from unitcad.spec import Spec
from unitcad.validation import from_data


def spec_of(record: CastRecord) -> Spec:
    """The spec that was cast. Raises Refusal where the record has none, or one that this version refuses."""
    if record.spec is None:
        raise Refusal("spec", None, "is required here: the resolved spec as a table")
    return from_data(record.spec)


def to_json(record: CastRecord) -> str:
    """A record as JSON, every key there."""
    return msgspec.json.format(msgspec.json.encode(record), indent=1).decode() + "\n"
