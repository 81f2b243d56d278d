"""Each test has a cache of its own, no store that an earlier one opened, and no pause before another try."""

import pytest
from batching import ring_sweep

from unitcad.cache import shared_store
from unitcad.sweeps import record_packs


@pytest.fixture(autouse=True)
def own_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("UNITCAD_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(shared_store, "PAUSE_S", 0.0)
    record_packs.store_at.cache_clear()
    yield tmp_path / "cache"
    record_packs.store_at.cache_clear()


@pytest.fixture
def four(tmp_path):
    """A sweep of two heights in two materials, and a folder for its results."""
    return ring_sweep(tmp_path / "s", heights=[2.0, 3.0], materials=2), tmp_path / "out"
