"""What responses cost: the forearm cut into layers stays the forearm, and what is promised can be broken."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.accuracy import hankel_cost
from benchmarks.accuracy.hankel import RADII, cases
from unitcad.accuracy.timing import Timing

FOREARM = cases()[0].medium


@pytest.mark.parametrize("count", [4, 10, 100])
def test_more_layers_are_the_same_forearm(count):
    many = hankel_cost.cut(FOREARM, count)
    assert len(many.layers) == count
    load = hankel_cost.LOADS["disc, tangential"]
    one, other = (medium.response(load, hankel_cost.OMEGA, RADII, rtol=1e-9) for medium in (FOREARM, many))
    assert np.all(np.abs(one.u_r - other.u_r) <= one.error_r + other.error_r)
    assert len(hankel_cost.cut(FOREARM, 1).layers) == 1


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


def test_tables_and_plots_by_number():
    time = Timing(1e-3, 1e-3, 1e-3)
    numbers = {"radii": (1, 13, 100, 1000), "layers": (1, 4, 10, 100), "frequencies": (1, 10, 100)}
    costs = [
        hankel_cost.Cost(name, 0.0, of, count, rtol, {"r": rtol / 9}, 0.1, time)
        for name in hankel_cost.LOADS
        for of, counts in numbers.items()
        for count in counts
        for rtol in hankel_cost.TOLERANCES
    ]
    loads = [replace(cost, z=z) for cost in costs if cost.count == 13 for z in (0.0, 3e-3)]
    tables, plots = hankel_cost.tables(loads, costs), hankel_cost.plots(loads, costs)
    assert [len(table.rows) for table in tables] == [12, 6, 6, 6]
    assert tables[1].rows[0][1] == "1 ms, 1.1e-07"
    assert [len(plot.series) for plot in plots] == [6, 8, 8, 6]
    assert len(plots[1].series["disc, tangential, 1000"]) == 3
