"""Cast records as tests read and write them."""

import msgspec

from unitcad.errors import Refusal
from unitcad.validation import from_data


def spec_of(record):
    """The spec that was cast. Raises Refusal where the record has none, or one that this version refuses."""
    if record.spec is None:
        raise Refusal("spec", None, "is required here: the resolved spec as a table")
    return from_data(record.spec)


def to_json(record):
    """A record as JSON, every key there."""
    return msgspec.json.format(msgspec.json.encode(record), indent=1).decode() + "\n"
