"""The catalogue's second source: recomputed from the curves, held against measuring by hand, chosen by a spec."""

import csv
import math
from pathlib import Path

import numpy as np
import pytest

from unitcad import catalogue
from unitcad.estimate_inputs import estimate_input, estimate_spec
from unitcad.lab.material import Specimen, declared, evaluate, read_curve
from unitcad.validation import load

DATA = Path(__file__).parent / "data" / "soft-robotics-materials-database"
FILES = {path.stem.lower().replace(" ", "-"): path for path in DATA.glob("*.csv")}
NAMES = ("ecoflex-00-10", "ecoflex-00-30", "ecoflex-00-50", "dragon-skin-10-medium", "dragon-skin-30")
PROTOTYPE = {
    "secant at 15 %": (18.0, 37.7, 51.3, 110, 454),
    "slope 0 to 25 % with offset": (24.5, 37.3, 59.7, 114, 451),
    "secant at 100 % (ISO 37, ASTM D412)": (14.8, 29.7, 41.0, 113, 437),
}
"""Moduli in kPa that another program worked out from the same files."""


@pytest.fixture(scope="module")
def results():
    known = catalogue.materials()
    bare = declared(["strain=Engineering Strain:1"])  # the files give no unit
    return {n: evaluate([read_curve(FILES[n], bare, Specimen())], (0.12, 0.24), known[n]) for n in NAMES}


@pytest.mark.parametrize("method", PROTOTYPE)
def test_every_method_gives_what_another_program_gave(method, results):
    for name, expected in zip(NAMES, PROTOTYPE[method], strict=True):
        row = next(row for row in results[name].rows if row.method == method)
        assert row.value is not None
        assert row.value / 1e3 == pytest.approx(expected, rel=0.01)
        assert row.defensible


@pytest.mark.parametrize("name", NAMES)
def test_the_reader_finds_the_engineering_columns(name, results):
    with open(FILES[name], encoding="utf-8-sig", newline="") as file:
        rows = [row for row in csv.reader(file, delimiter=";") if row[0][:1].isdigit()]
    strain, stress = (np.array([float(row[i]) for row in rows]) for i in (3, 4))
    curve = results[name].curves[0]
    np.testing.assert_allclose(
        np.interp([0.15, 0.5, 3], curve.strain, curve.stress),
        1e6 * np.interp([0.15, 0.5, 3], strain, stress),
        rtol=1e-9,
    )
    assert curve.specimen == Specimen(6, 3, 33, pytest.approx(18), 1000, 450, True)
    assert curve.rate == pytest.approx(450 / 60 / 33, rel=0.01)


def test_the_shipped_values_are_those_of_the_curves(results):
    sources = catalogue.moduli_by_source()
    for name, result in results.items():
        shipped = catalogue.materials()[name].quasistatic_modulus_kpa
        assert shipped is not None
        assert shipped.method == result.method
        for value, exact in ((shipped.value, result.value), (shipped.low, result.low), (shipped.high, result.high)):
            assert value == pytest.approx(exact / 1e3, rel=1e-3)
        for row in result.rows:
            at = sources.get(f"tensile, {row.method}", {}).get(name)
            assert (at is not None) == row.defensible
            assert at is None or at == pytest.approx((row.value or 0) / 1e3, rel=1e-3)


def test_the_sources_stand_side_by_side():
    sources = catalogue.moduli_by_source()
    assert sources["paper"] == {"ecoflex-00-10": 15, "dragon-skin-10-medium": 250, "dragon-skin-30": 355}
    assert sources["data sheet"]["ecoflex-00-10"] == 55
    assert set(sources["tensile, secant at 15 %"]) == set(NAMES)


def test_the_warnings_name_what_is_doubtful(results):
    codes = {name: {one.code for one in result.warnings} for name, result in results.items()}
    assert codes["ecoflex-00-10"] == {"force", "start", "toe", "break", "crosshead", "specimens"}
    assert "force" not in codes["dragon-skin-30"]
    assert "break" not in codes["dragon-skin-10-medium"]


def test_a_spec_chooses_the_second_source_and_the_estimate_says_so():
    default, chosen = load("encapsulating"), load("encapsulating", ["estimate.moduli=quasi-static"])
    inner = estimate_input(chosen).layers[0].youngs_modulus
    value = catalogue.materials()["ecoflex-00-10"].quasistatic_modulus_kpa
    assert value is not None
    assert inner.value == pytest.approx(1e3 * value.value)
    assert inner.ends == pytest.approx((1e3 * (value.low or math.nan), 1e3 * (value.high or math.nan)))
    assert estimate_input(default).layers[0].youngs_modulus.value == 15e3
    said = [line for line in estimate_spec(chosen)["assumptions"] if "quasi-static" in line]
    assert any(line.startswith("ecoflex-00-10 youngs_modulus: quasi-static") for line in said)
    assert not any("quasi-static" in line for line in estimate_spec(default)["assumptions"])


def test_an_own_quasi_static_modulus_is_used_where_it_is_chosen():
    own = "materials.ours={like='ecoflex-00-10', quasistatic_modulus_kpa=30.0}"
    spec = load("encapsulating", [own, "layers.0.material=ours", "estimate.moduli=quasi-static"])
    assert estimate_input(spec).layers[0].youngs_modulus.value == 30e3
