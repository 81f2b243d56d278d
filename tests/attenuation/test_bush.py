"""The bushes against plane elasticity as an ODE, printed forms, limits, a balance of forces as a matrix, scaling."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_bvp

from unitcad.attenuation.edge.bush import Form, bush, bush_coefficient
from unitcad.attenuation.edge.closed_form import Section, Units, divider
from unitcad.attenuation.edge.fitted_models import bush_forms
from unitcad.attenuation.edge.level import nominal
from unitcad.attenuation.edge.measured_levels import measured_table
from unitcad.estimating import estimate_input
from unitcad.sweeps import estimate_table
from unitcad.sweeps.sweep import load_sweep
from unitcad.validation import load

RNG = np.random.default_rng(8)


def unit(moduli, caps, tan_delta=0.0, **changes):
    """A unit of walls of 1.25 mm round a cavity of 4.5 mm."""
    count = len(moduli)
    section = Section(4.5e-3, 3.5e-3, 2e-3, 4.5e-3 + 1.25e-3 * np.arange(1, count + 1), caps)
    rows = ([1070.0], [0.4999], [tan_delta], [1.25e-3])
    made = Units(moduli, *(row * count for row in rows), omega=785.0, passes=1.0, section=section)
    return replace(made, **changes)


@pytest.mark.parametrize("long", [False, True])
@pytest.mark.parametrize(("outer", "nu"), [(1.05, 0.3), (1.28, 0.49), (1.64, 0.4999), (4.0, 0.0), (4.0, 0.45)])
def test_coefficient_is_the_force_of_the_plane_problem(outer: float, nu: float, long: bool) -> None:
    """u_r = U cos, u_theta = V sin, sigma_rr = S cos, sigma_rtheta = T sin, shear modulus 1, inner radius 1."""
    lame = 2 * nu / (1 - 2 * nu) if long else 2 * nu / (1 - nu)

    def slopes(r, y):
        u, v, s, t = y
        hoop = (u + v) / r
        radial = (s - lame * hoop) / (lame + 2)
        q = lame * (radial + hoop) + 2 * hoop
        return np.array([radial, t + hoop, -(t + s - q) / r, (q - 2 * t) / r])

    def ends(inside, outside):
        return np.array([inside[0] - 1, inside[1] + 1, outside[0], outside[1]])

    grid = np.linspace(1, outer, 41)
    solved = solve_bvp(slopes, ends, grid, np.zeros((4, grid.size)), tol=1e-9, max_nodes=100_000)
    assert solved.success
    s, t = solved.y[2:, 0]
    force = -np.pi * (s - t)
    assert bush_coefficient(2.0, 2.0 * outer, nu, long) == pytest.approx(force, rel=1e-5)


def test_coefficient_is_adkins_and_gent_s_for_rubber() -> None:
    a, b = 3.5, 5.75
    log, squares = np.log(b / a), a**2 + b**2
    short = 80 * np.pi * squares / (25 * squares * log - 9 * (b**2 - a**2))
    long = 4 * np.pi * squares / (squares * log - (b**2 - a**2))
    assert bush_coefficient(a, b, 0.5) == pytest.approx(short, rel=1e-12)
    assert bush_coefficient(a, b, 0.5, long=True) == pytest.approx(long, rel=1e-12)


@pytest.mark.parametrize("nu", [0.0, 0.3, 0.4999])
def test_a_thin_annulus_is_a_film_in_tension_and_shear(nu: float) -> None:
    """Per arc E'/t across it and G/t along it, over the circle: pi a/t (2/(1 - nu) + 1) in plane stress."""
    film = np.pi / 1e-4 * (2 / (1 - nu) + 1)
    assert bush_coefficient(1.0, 1.0 + 1e-4, nu) == pytest.approx(film, rel=1e-3)


def test_a_wide_bush_softens_as_the_logarithm() -> None:
    """The logarithm's part is what is left far out: 2 pi (kappa + 1)/(kappa ln(b/a))."""
    wide, wider = 1 / bush_coefficient(1.0, 1e6, 0.5), 1 / bush_coefficient(1.0, 1e9, 0.5)
    kappa = 5 / 3
    assert wider - wide == pytest.approx(kappa * np.log(1e3) / (2 * np.pi * (kappa + 1)), rel=1e-9)


@pytest.mark.parametrize("count", [2, 3, 5])
@pytest.mark.parametrize("closed", [False, True])
def test_motion_is_that_of_the_balance_of_forces(count: int, closed: bool) -> None:
    """The same springs as one linear system, put together here layer by layer."""
    moduli = 10 ** RNG.uniform(4, 6, count)
    tan_delta = RNG.uniform(0.05, 0.5, count)
    walls, caps = RNG.uniform(0.5e-3, 3e-3, (2, count))
    caps = caps if closed else np.zeros(count)
    nu, core, motor, height = 0.47, 4.5e-3, 3.5e-3, 2.1e-3
    radii = core + np.cumsum(walls)
    springs, bases = [], []
    inside, face, top = core, motor, height
    for e, loss, outside, cap in zip(moduli, tan_delta, radii, caps, strict=True):
        g = e * (1 + 1j * loss) / (2 * (1 + nu))
        whole = top + 2 * cap
        sheared = 2 * np.pi * face**2 / cap if cap else 0.0
        floor = np.pi * inside**2 / cap if cap else 0.0
        springs.append(g * (bush_coefficient(inside, outside, nu) * top + sheared))
        bases.append(g * (np.pi * (outside**2 - inside**2) / whole + floor))
        inside, face, top = outside, outside, whole
    matrix, force = np.zeros((count - 1, count - 1), complex), np.zeros(count - 1, complex)
    force[0] = springs[0]
    for i in range(count - 1):
        matrix[i, i] = springs[i] + bases[i + 1] + (springs[i + 1] if i + 1 < count - 1 else 0)
        if i + 1 < count - 1:
            matrix[i, i + 1] = matrix[i + 1, i] = -springs[i + 1]
    expected = abs(np.linalg.solve(matrix, force)[-1])
    section = Section(core, motor, height, radii, caps)
    made = Units(moduli, [1070.0] * count, [nu] * count, tan_delta, walls, 785.0, 1.0, section)
    assert float(bush(made)) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("form", bush_forms())
def test_two_layers_are_a_divider_whose_constant_knows_no_modulus(form: Form) -> None:
    soft, stiff = unit([15e3, 250e3], [1e-3] * 2), unit([355e3, 15e3], [1e-3] * 2)
    kappa = (1 / bush(soft, form) - 1) * 15 / 250
    assert bush(stiff, form) == pytest.approx(divider(stiff, kappa), rel=1e-12)


def test_kappa_of_the_paper_s_units_follows_from_their_lengths() -> None:
    """An embedded unit by hand: shear area over height, over beta and height."""
    table = measured_table()
    units = table.units(table.names.index("embedded E10/D10"))
    by_hand = np.pi * (7**2 - 5.75**2) / 2.0**2 / bush_coefficient(4.5, 5.75, 0.4999)
    kappa = (1 / bush(units) - 1) * 15 / 250
    assert kappa == pytest.approx(by_hand, rel=1e-12)
    assert kappa == pytest.approx(0.20, abs=0.005)
    filled = (1 / bush(units, Form(filled=True)) - 1) * 15 / 250
    assert filled == pytest.approx(0.41, abs=0.005)


@pytest.mark.parametrize("name", ["encapsulating", "embedded", "three-layer", "single-embedded"])
def test_scale_of_moduli_and_of_lengths_changes_nothing_and_equal_materials_are_their_control(name: str) -> None:
    made = nominal(estimate_input(load(name)))
    level = bush(made)
    assert 0 < level < 1
    assert bush(replace(made, youngs_modulus=7.0 * made.youngs_modulus)) == pytest.approx(level, rel=1e-12)
    assert made.section is not None
    larger = replace(made.section, **{key: 3.0 * value for key, value in vars(made.section).items()})
    assert bush(replace(made, section=larger)) == pytest.approx(level, rel=1e-12)
    controls = [float(bush(made.control(i))[0]) for i in range(made.youngs_modulus.shape[-1])]
    assert controls == pytest.approx([controls[0]] * len(controls), rel=1e-9)


def test_a_single_layer_is_two_of_half_its_wall() -> None:
    one = nominal(estimate_input(load("single-encapsulating")))
    assert one.section is not None
    outer, cap = one.section.outer_radii[0, 0], one.section.caps[0, 0]
    middle = (outer + one.section.cavity_radius[0]) / 2
    halves = replace(one.section, outer_radii=[[middle, outer]], caps=[[cap / 2, cap / 2]])
    fields = ("youngs_modulus", "density", "poisson_ratio", "tan_delta")
    two = replace(one, section=halves, **{field: np.repeat(getattr(one, field), 2, -1) for field in fields})
    assert bush(one) == pytest.approx(bush(two), rel=1e-12)


def test_a_stiffer_inside_raises_the_level_and_a_stiffer_outside_lowers_it() -> None:
    for caps in ([0.0, 0.0], [1e-3, 2e-3]):
        level = bush(unit([50e3, 50e3], caps))
        assert bush(unit([60e3, 50e3], caps)) > level > bush(unit([50e3, 60e3], caps))


def test_without_a_section_there_is_no_bush() -> None:
    with pytest.raises(ValueError, match="section"):
        bush(replace(unit([1e4, 1e5], [0.0, 0.0]), section=None))


def test_the_sweep_of_thicknesses_moves_bush_and_not_the_divider() -> None:
    sweep = load_sweep("thickness")
    (block,) = estimate_table.evaluate(sweep, sweep.count)
    half = sweep.count // 2
    for of_one_design in (slice(half), slice(half, None)):
        bushes, dividers = (block.levels[name][of_one_design] for name in ("bush", "fitted"))
        assert np.ptp(np.log(bushes)) > 0.3
        assert np.unique(np.round(bushes, 12)).size == half
        assert np.ptp(dividers) == 0
