"""The sentence on what to measure first names what ties with it within the errors."""

from types import SimpleNamespace

from unitcad.experiments.information import Information
from unitcad.experiments.ranking import Ranked
from unitcad.experiments.study import equals, settles


def _ranked(name: str, bits: float, error: float) -> Ranked:
    found = SimpleNamespace(bits=bits, error=error)
    return Ranked((name,), found)  # type: ignore[arg-type]


def test_experiments_that_tie_with_the_first_one_are_named() -> None:
    assert {"bits", "error"} <= set(dir(Information))
    first = _ranked("soft inside", 0.95, 0.13)
    near, far = _ranked("stiff inside", 0.93, 0.14), _ranked("open rings", 0.24, 0.11)
    predicted = SimpleNamespace(most_bits=2.58)
    assert equals([first, near, far]) == [near]
    said = settles([first], predicted, [first, near, far])  # type: ignore[arg-type]
    assert "Measure first soft inside: 0.95 ± 0.13 of 2.58 bits." in said
    assert "Within the errors it says no more than stiff inside (0.93)." in said
    assert "Within the errors" not in settles([first], predicted, [first, far])  # type: ignore[arg-type]
    many = [first, *[_ranked(str(i), 0.9, 0.1) for i in range(5)]]
    assert "0 (0.90); 1 (0.90); 2 (0.90); and 2 more." in settles([first], predicted, many)  # type: ignore[arg-type]
