"""The study of planted faults: a mutant changes one line, and the share has the range of a binomial."""

import pytest
from scipy import stats

from benchmarks.mutants import ends, mutant_of, places


def test_a_mutant_changes_one_line():
    pytest.importorskip("cosmic_ray")
    source = "LIMIT = 3\n\n\ndef below(x):\n    return x < LIMIT and x > -1\n"
    made = [mutant_of(source, "a.py", *place) for place in places(source)]
    after = {one[0].after for one in made if one}
    assert {"return x <= LIMIT and x > -1", "return x < LIMIT or x > -1"} <= after
    assert all(one[1].splitlines()[one[0].line - 1].strip() == one[0].after for one in made if one)


@pytest.mark.parametrize(("killed", "count"), [(22, 25), (0, 9), (60, 60)])
def test_the_range_of_a_share_is_wilsons(killed, count):
    interval = stats.binomtest(killed, count).proportion_ci(method="wilson")
    assert ends(killed, count) == pytest.approx((interval.low, interval.high), abs=1e-4)
