"""What the tests of accuracy share."""

import gc

import pytest


@pytest.fixture(scope="module", autouse=True)
def no_collection():
    """A timed call first collects garbage, which here takes longer than the call."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(gc, "collect", lambda: None)
        yield
