"""What responses cost: the forearm cut into layers stays the forearm, and what is promised can be broken."""

from dataclasses import replace

import pytest

from benchmarks.accuracy import hankel_cost
from benchmarks.accuracy.hankel import RADII, cases

FOREARM = cases()[0].medium


def test_every_load_at_the_surface_and_at_depth_keeps_its_bound(monkeypatch):
    """With an error of ten times the bound, and one of ten times rtol, the promises are broken."""
    pytest.importorskip("flint")
    monkeypatch.setattr(hankel_cost, "LOADS", {name: hankel_cost.LOADS[name] for name in hankel_cost._DRAWN})
    costs = hankel_cost.every_load(FOREARM, RADII[::6], True, print)
    assert [(cost.load, cost.z) for cost in costs] == [(n, z) for n in hankel_cost.LOADS for z in (0.0, 3e-3)]
    assert set(costs[-1].errors) == {"r", "theta", "z"}
    assert all(promise.ok for promise in hankel_cost.promises(costs))
    for bad in (replace(costs[0], over_bound=10.0), replace(costs[0], errors={"r": 1e-5})):
        assert not all(promise.ok for promise in hankel_cost.promises([*costs, bad]))
    (table,) = hankel_cost.tables(costs, [])
    assert len(table.rows) == 4
    assert hankel_cost.plots(costs, []) == []
