"""What a refusal has to name."""

from contextlib import contextmanager

import pytest

from unitcad.errors import Refusal


@contextmanager
def refuses(field, *words):
    """Expect a refusal of a field whose sentence has each of the words."""
    with pytest.raises(Refusal) as refused:
        yield refused
    assert refused.value.field == field, str(refused.value)
    assert [word for word in words if word not in str(refused.value)] == [], str(refused.value)
