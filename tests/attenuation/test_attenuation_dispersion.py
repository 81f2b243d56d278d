"""disba's Dunkin wavenumbers (an independent program, BSD) are zeros of our determinant, the compliance's poles."""

import numpy as np
import pytest

from unitcad.attenuation import HalfSpace, Layer, LayeredMedium

disba = pytest.importorskip("disba")
MODELS = {  # thickness km, v_p km/s, v_s km/s, density g/cm3; frequencies Hz
    "crust": (
        [(10.0, 7.0, 3.5, 2.0), (10.0, 6.8, 3.4, 2.0), (10.0, 7.6, 3.8, 2.0), (10.0, 8.0, 4.0, 2.0)],
        (0.02, 0.1),
    ),
    "soft on stiff": ([(0.02, 0.5, 0.2, 1.8), (0.05, 1.2, 0.5, 1.9), (1.0, 2.5, 1.2, 2.2)], (2.0, 5.0, 12.0)),
    "soft layer inside": ([(0.01, 0.9, 0.4, 1.9), (0.02, 0.6, 0.25, 1.8), (1.0, 1.8, 0.9, 2.1)], (3.0, 8.0)),
    "nearly incompressible": ([(0.03, 2.0, 0.1, 1.1), (1.0, 2.5, 0.3, 1.2)], (1.0, 3.0)),
}


def medium_of(rows):
    def material(vp, vs, rho):
        nu = (vp**2 - 2 * vs**2) / (2 * (vp**2 - vs**2))
        return 1e3 * rho, 2 * 1e9 * rho * vs**2 * (1 + nu), nu

    return LayeredMedium(
        [Layer(1e3 * h, *material(*rest)) for h, *rest in rows[:-1]], HalfSpace(*material(*rows[-1][1:]))
    )


@pytest.mark.parametrize("name", MODELS)
def test_dunkins_wavenumbers_are_our_poles(name):
    rows, frequencies = MODELS[name]
    medium, peer = medium_of(rows), disba.PhaseDispersion(*np.array(rows).T, algorithm="dunkin", dc=1e-3)
    found = 0
    for mode in (0, 1):
        for hertz in frequencies:
            speeds = peer(np.array([1 / hertz]), mode=mode, wave="rayleigh").velocity
            if speeds.size == 0:  # this mode is not there yet
                continue
            omega = 2 * np.pi * hertz
            k = omega / (1e3 * speeds[0]) * (1 + np.array([-1e-5, 1e-5]))
            determinant = np.linalg.det(np.linalg.inv(medium.compliance(k, omega))).real
            assert determinant[0] * determinant[1] < 0, (mode, hertz)
            found += 1
    assert found >= len(frequencies)
