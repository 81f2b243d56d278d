"""The public names of `unitcad.attenuation`: no CAD, an example that runs; its files import in one direction."""

import doctest
import math
from itertools import product

import numpy as np
import pytest

from unitcad import attenuation
from unitcad.attenuation import layered
from unitcad.errors import Refusal, UnitcadError


def test_the_example_of_the_docstring_runs():
    done = doctest.testmod(layered)
    assert done.attempted > done.failed == 0


BASE = attenuation.HalfSpace(1000, 1e4, 0.4)
DISC = attenuation.UniformDisc(3e-3)
MEDIUM = attenuation.LayeredMedium([], BASE)


def layer(thickness=1e-3, density=1000, youngs_modulus=1e5, poisson_ratio=0.3):
    return attenuation.Layer(thickness, density, youngs_modulus, poisson_ratio)


FREE = attenuation.LayeredMedium([layer()], attenuation.HalfSpace(0.0, 0.0, 0.3))


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: layer(poisson_ratio=0.5 + 1e-9), r"^layer\.poisson_ratio"),
        (lambda: layer(-1e-3), r"^layer\.thickness"),
        (lambda: layer(1e-300), r"^layer\.thickness = 1e-300: its magnitude"),
        (lambda: layer(density=-1), r"^layer\.density"),
        (lambda: layer(youngs_modulus=0.0), r"^layer\.youngs_modulus"),
        (lambda: attenuation.HalfSpace(1000, math.nan, 0.3), r"^half_space\.youngs_modulus"),
        (lambda: attenuation.HalfSpace(1000, 1e4, 0.4, "x"), r"^half_space\.damping = 'x': must be a LossFactor"),
        (lambda: attenuation.KelvinVoigt(-1.0), r"^damping\.viscosity"),
        (lambda: attenuation.LossFactor(math.nan), r"^damping\.tan_delta"),
        (lambda: layered.FractionalKelvinVoigt(1e-3, 1.5), r"^damping\.n"),
        (lambda: attenuation.LayeredMedium("abc", BASE), r"^layers\.0 = 'a': must be a Layer$"),
        (lambda: attenuation.LayeredMedium([], None), "^half_space = 'None': must be a HalfSpace$"),
        (lambda: attenuation.UniformDisc(3e-3, 3), r"^load\.direction = '3': unknown name"),
        (lambda: attenuation.UniformDisc(0.0), r"^load\.radius"),
        (lambda: DISC.transform(math.nan), "^k = 'nan': wavenumbers must be finite"),
        (lambda: FREE.compliance(10.0, 0.0), "^omega"),
        (lambda: MEDIUM.compliance(10.0, -1.0), "^omega"),
        (lambda: MEDIUM.compliance(0.0, 1.0), "^k = "),
        (lambda: MEDIUM.compliance([1.0, -1.0], 785.0), r"^k = '\(-1\+0j\)': wavenumbers must be finite"),
        (lambda: MEDIUM.compliance(1e154, 785.0), r"wavenumbers must be finite, at most 1e\+60"),
        (lambda: MEDIUM.response("x", 785.0, 7e-3), "^load = 'x': must be a UniformDisc$"),
        (
            lambda: MEDIUM.response(DISC, 1e300, 7e-3),
            r"^omega = 1e\+300: .*; nearest accepted: 1e\+60$",
        ),
        (lambda: MEDIUM.response(DISC, 785 + 1j, 7e-3), r"^omega = '\(785\+1j\)': must be a real number$"),
        (lambda: MEDIUM.response(DISC, 785.0, "x"), "^r = 'x': must be radii"),
        (lambda: MEDIUM.response(DISC, 785.0, []), "^r: needs a radius$"),
        (lambda: MEDIUM.response(DISC, 785.0, [math.nan]), "^r = "),
        (lambda: MEDIUM.response(DISC, 785.0, [1e-2 + 1e-3j]), r"^r = '\[\(0\.01\+0\.001j\)\]': must be radii: real"),
        (lambda: MEDIUM.response(DISC, 785.0, [7e-3, -2e-3, -1e-3]), "^r = -0.002: radii must be finite and not neg"),
        (lambda: MEDIUM.response(DISC, 785.0, [7e-3, 1e-300]), "^r = 1e-300: .*; nearest accepted: 1e-60$"),
        (lambda: MEDIUM.response(DISC, 785.0, 7e-3, rtol=1e-15), "^rtol"),
    ],
)
def test_what_has_no_answer_is_refused_in_one_sentence(call, words):
    with pytest.raises(Refusal, match=words):
        call()


@pytest.mark.filterwarnings("error")
def test_a_discs_transform_has_its_limit_at_wavenumber_0():
    k = np.array([0.0, 1e-320, 1e-30, 1e-3, 1.0])
    for direction in ("normal", "tangential"):
        disc = attenuation.UniformDisc(3e-3, direction)
        assert disc.transform(0.0) == 4.5e-6
        assert disc.transform(k) == pytest.approx(4.5e-6, rel=1.2e-6)
        assert disc.transform(np.complex128(0.0)) == 4.5e-6


@pytest.mark.long
@pytest.mark.filterwarnings("error")
def test_magnitudes_at_the_ends_of_the_accepted_range_give_numbers_or_one_sentence():
    ends = (1e-60, 1e60)
    for thickness, density, modulus, omega in product(ends, ends, ends, ends):
        layer = attenuation.Layer(thickness, density, modulus, 0.4, attenuation.LossFactor(0.1))
        stack = attenuation.LayeredMedium([layer], BASE)
        for r in (1e-60, 1.0):
            try:
                found = stack.response(DISC, omega, r, rtol=0.1)
            except UnitcadError:
                continue
            assert np.isfinite([found.u_r, found.u_z, found.error]).all()
