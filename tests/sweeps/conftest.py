"""Each test has a cache of its own."""

import pytest
from batching import ring_sweep


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("UNITCAD_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


@pytest.fixture
def four(tmp_path):
    """A sweep of two heights in two materials, and a folder for its results."""
    return ring_sweep(tmp_path / "s", heights=[2.0, 3.0], materials=2), tmp_path / "out"
