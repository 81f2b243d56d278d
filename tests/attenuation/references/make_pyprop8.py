"""Makes pyprop8.json: displacements by pyprop8 1.1.5 (O'Toole and Woodhouse 2011), an independent layered solver.

pyprop8 is under the GPL and no part of this project: run by hand in an environment of its own, with
`pip install pyprop8==1.1.5`, then `python make_pyprop8.py`. It puts the force below the receiver; by reciprocity the
vertical motion of the surface under a buried vertical (horizontal) force is the vertical (radial) motion at that depth
under a vertical surface force. Its step source makes its velocity spectrum a displacement per newton; it sums uniform
wavenumbers, so `spread`, the change from half as many, is what its figures are good for.
"""

import json
from pathlib import Path

import numpy as np
import pyprop8 as pp

MODELS = {  # thickness m, density kg/m3, Young's modulus Pa, Poisson's ratio; tan delta for all; omega; depth; radii
    "soft over softer": ([(1.5e-3, 1100, 118e3, 0.45), (None, 1000, 26e3, 0.479)], 0.2, 785.0, 2e-3),
    "forearm": (
        [(1.5e-3, 1100, 130e3, 0.49), (4e-3, 950, 9e3, 0.495), (25e-3, 1050, 12e3, 0.495), (None, 1900, 1e6, 0.3)],
        0.3,
        785.0,
        3e-3,
    ),
    "stiff skin": ([(1e-3, 1100, 2e6, 0.3), (3e-3, 950, 2e4, 0.4), (None, 1050, 1e5, 0.45)], 0.15, 1500.0, 2.5e-3),
}
RADII = (2e-3, 7e-3, 12e-3, 20e-3)


def displacement(bodies, tan_delta, omega, depth, force, count):
    rows = []
    for h, rho, e, nu in bodies:
        mu = e / (2 * (1 + nu))
        vp = np.sqrt(mu * 2 * (1 - nu) / (1 - 2 * nu) / rho)
        rows.append((np.inf if h is None else h, vp, np.sqrt(mu / rho), rho))
    model = pp.LayeredStructureModel(rows)
    model.mu, model.sigma = model.mu * (1 + 1j * tan_delta), model.sigma * (1 + 1j * tan_delta)
    source = pp.PointSource(0.0, 0.0, depth, np.zeros((3, 3)), np.array(force, float).reshape(3, 1), 0.0)
    stations = pp.ListOfReceivers(np.array(RADII), np.zeros(len(RADII)), depth=0.0)
    grid = {"kmin": 0, "kmax": 32.0 / depth, "nk": count}
    return pp.compute_spectra(model, source, stations, np.array([omega + 0j]), show_progress=False, stencil_kwargs=grid)


def main():
    cases = []
    for name, (bodies, tan_delta, omega, depth) in MODELS.items():
        found = {}
        for key, force in (("u_z", (0, 0, 1)), ("u_r", (1, 0, 0))):
            fine, coarse = (displacement(bodies, tan_delta, omega, depth, force, n)[:, 2] for n in (24000, 12000))
            found[key] = [[v.real, v.imag] for v in fine]
            found[f"{key}_spread"] = float(np.max(np.abs(fine - coarse)))
        cases.append(
            {"name": name, "bodies": bodies, "tan_delta": tan_delta, "omega": omega, "depth": depth, "radii": RADII}
            | found
        )
    (Path(__file__).parent / "pyprop8.json").write_text(json.dumps(cases, indent=1) + "\n")


if __name__ == "__main__":
    main()
