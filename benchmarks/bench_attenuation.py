"""The attenuation against its peers, in one run: cold process, response against quad_vec, arrays, crosstalk.

python benchmarks/bench_attenuation.py [ROUNDS]       medians of interleaved rounds, least and most, and ratios
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import time
from collections.abc import Callable

import numpy as np

from benchmarks.accuracy.hankel_peers import adaptive
from unitcad.arrays.array_file import load_array
from unitcad.arrays.crosstalk import Decays, crosstalk
from unitcad.attenuation import HalfSpace, Layer, LayeredMedium
from unitcad.attenuation.curve import decay
from unitcad.attenuation.edge.closed_form import Units
from unitcad.attenuation.edge.models import MODELS, edge_levels
from unitcad.attenuation.inputs import EstimateInput, TissueLayer, tissue_medium
from unitcad.attenuation.layered import UniformDisc
from unitcad.estimate_inputs import estimate_input
from unitcad.validation import load

RADII = np.geomspace(1e-4, 50e-3, 13)
A, OMEGA, RTOL = 3.5e-3, 2 * np.pi * 125, 1e-6
SINGLE, MANY = 200, 100_000


def interleaved(jobs: dict[str, Callable[[], object]], rounds: int) -> dict[str, list[float]]:
    """Seconds of each job, round by round; a first round warms up and is dropped."""
    seconds: dict[str, list[float]] = {name: [] for name in jobs}
    for _ in range(rounds + 1):
        for name, job in jobs.items():
            start = time.perf_counter()
            job()
            seconds[name].append(time.perf_counter() - start)
    return {name: values[1:] for name, values in seconds.items()}


def show(title: str, seconds: dict[str, list[float]]) -> dict[str, float]:
    print(f"\n{title}")
    medians = {name: statistics.median(values) for name, values in seconds.items()}
    for name, values in seconds.items():
        print(f"  {name:44} {medians[name] * 1e3:10.2f} ms   {min(values) * 1e3:.2f} to {max(values) * 1e3:.2f}")
    return medians


def cold(rounds: int) -> None:
    """The whole cold process beside the import that it can't do without."""
    commands = {
        "import numpy, scipy.special": ["-c", "import numpy, scipy.special"],
        "unitcad estimate encapsulating": ["-m", "unitcad", "estimate", "encapsulating"],
    }
    jobs = {
        name: lambda words=words: subprocess.run([sys.executable, *words], check=True, stdout=subprocess.DEVNULL)
        for name, words in commands.items()
    }
    bare, estimate = show("cold process", interleaved(jobs, rounds)).values()
    print(f"  ratio {estimate / bare:.2f} (at most 4 wanted)")


def undamped(variant: EstimateInput) -> LayeredMedium:
    """The variant's body with the damping left out."""
    full: tuple[TissueLayer, ...] = variant.tissue
    damped = tissue_medium(full)
    layers = [Layer(one.thickness, one.density, one.youngs_modulus, one.poisson_ratio) for one in damped.layers]
    last = damped.half_space
    return LayeredMedium(layers, HalfSpace(last.density, last.youngs_modulus, last.poisson_ratio))


def by_quad_vec(medium: LayeredMedium, lifted: bool) -> tuple[np.ndarray, float, int]:
    """u_z at RADII by scipy's adaptive quad_vec, on the real axis or on a path lifted off it, to the same tolerance.

    The static part is taken out as the solver does, or it would not converge at all.
    """
    static = (1 - medium.layers[0].poisson_ratio) / medium.materials(OMEGA)[0].shear
    disc = UniformDisc(A)
    known = static * disc.static(RADII)[1]
    count = 0

    def remainder(k: np.ndarray) -> np.ndarray:
        nonlocal count
        count += k.size
        return (k * medium.compliance(k, OMEGA)[:, 1, 1] - static) * disc.transform(k)

    value, error = adaptive(remainder, RADII, RTOL * float(np.max(np.abs(known))), lifted)
    return known + value, error, count


def response(rounds: int) -> None:
    """Thirteen radii on the forearm at rtol 1e-6, beside quad_vec where it converges."""
    variant = estimate_input(load("encapsulating"))
    for name, medium in (("damped", tissue_medium(variant.tissue)), ("undamped", undamped(variant))):
        truth = medium.response(UniformDisc(A), OMEGA, RADII, rtol=1e-9)
        scale = float(np.max(np.abs(truth.u_z)))

        def ours(medium: LayeredMedium = medium):
            return medium.response(UniformDisc(A), OMEGA, RADII, rtol=RTOL)

        found = ours()
        print(f"\nforearm, {name}: 13 radii, rtol {RTOL:g}")
        true = float(np.max(np.abs(found.u_z - truth.u_z))) / scale
        print(f"  unitcad: true error {true:.1e}, estimate {found.error / scale:.1e}, {found.wavenumbers} wavenumbers")
        jobs: dict[str, Callable[[], object]] = {"unitcad response": ours}
        for path, lifted in (("lifted path", True), ("real axis", False)):
            peer, claimed, count = by_quad_vec(medium, lifted)
            off = float(np.max(np.abs(peer - truth.u_z))) / scale
            print(f"  quad_vec, {path}: true error {off:.1e}, claims {claimed / scale:.1e}, {count} wavenumbers")
            if off < 10 * RTOL:
                jobs[f"quad_vec, {path}"] = lambda medium=medium, lifted=lifted: by_quad_vec(medium, lifted)
        medians = show("  seconds", interleaved(jobs, max(2, rounds // 3)))
        for peer_name in list(medians)[1:]:
            print(f"  {peer_name}: {medians[peer_name] / medians['unitcad response']:.0f} x (at least 20 wanted)")


def arrays(rounds: int) -> None:
    """Closed forms over 100,000 variants beside a loop of single calls."""
    rng = np.random.default_rng(0)
    moduli, walls = 10 ** rng.uniform(4, 6, (MANY, 2)), rng.uniform(0.5e-3, 5e-3, (MANY, 2))
    omega, n = 2 * np.pi * rng.uniform(80, 250, MANY), rng.choice([1.0, 2.0], MANY)

    def units(part: slice | int) -> Units:
        whole = np.full(np.shape(n[part]), 16.0)
        return Units(moduli[part], [1070.0] * 2, [0.4999] * 2, [0.2] * 2, walls[part], omega[part], n[part], whole)

    for model in MODELS:
        jobs: dict[str, Callable[[], object]] = {
            f"{model}: {MANY} in one call": lambda model=model: edge_levels(units(slice(None)), model),
            f"{model}: {SINGLE} single calls": lambda model=model: [
                edge_levels(units(i), model) for i in range(SINGLE)
            ],
        }
        many, single = show(f"closed form, {model}", interleaved(jobs, rounds)).values()
        print(
            f"  {MANY / many:,.0f} variants a second; {single / SINGLE / (many / MANY):.0f} x single calls (100 wanted)"
        )


def crosstalk_of_arrays(rounds: int) -> None:
    """Crosstalk of 256 units, whole, and its matrix beside a response for every pair; regular and scattered places."""
    unit = {"like": "encapsulating", "fpcb": {"tail_length_mm": 1.0}}
    grid = {"kind": "grid", "columns": 16, "rows": 16, "pitch_mm": 20.0}
    off = np.random.default_rng(1).uniform(-1.0, 1.0, (256, 2))
    points = [[22.0 * (i % 16) + dx, 22.0 * (i // 16) + dy] for i, (dx, dy) in enumerate(off.tolist())]
    listed = {"kind": "list", "points_mm": points}
    for name, layout in (("16 x 16", grid), ("256 scattered", listed)):
        array = load_array({"name": "bench", "array": "pockets", "unit": unit, "layout": layout})
        units = Decays(array)
        variant, distances = units.inputs[0], units.centre
        jobs: dict[str, Callable[[], object]] = {
            "crosstalk, whole": lambda array=array: crosstalk(array),
            "matrix, one radial response": lambda units=units: units.both(),
            f"{SINGLE} pairs alone": lambda variant=variant, far=distances: [
                decay(variant, np.array([1e-3 * r])) for r in far[0, 1 : SINGLE + 1]
            ],
        }
        _, matrix, alone = show(f"crosstalk, {name}", interleaved(jobs, max(2, rounds // 3))).values()
        print(f"  {alone / SINGLE * 256 * 255 / matrix:,.0f} x a response for every pair")


if __name__ == "__main__":
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 9
    cold(count)
    response(count)
    arrays(count)
    crosstalk_of_arrays(count)
