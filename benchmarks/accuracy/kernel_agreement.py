"""Agreement of the kernels on every template and on random specs, with each one's time."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterator, Sequence
from itertools import count, islice
from typing import Any

import numpy as np

from benchmarks.accuracy import build123d_kernel, cadquery_kernel
from benchmarks.accuracy.brep_measures import Measures, measure
from benchmarks.accuracy.machine import machine
from benchmarks.accuracy.measures import mesh_volume
from benchmarks.accuracy.result import Promise, Result, Say, Summary, Table, shown
from unitcad.accuracy.measurements import interleaved, timing
from unitcad.accuracy.random_specs import seeded_spec
from unitcad.api.variant import Variant
from unitcad.designs import shipped
from unitcad.errors import Refusal
from unitcad.kernels import bounds, mesh, occt
from unitcad.shape import Shape
from unitcad.validation import from_data, templates

_QUANTITIES: tuple[str, ...] = ("solids", "volume", "area", "box", "centre")


def run(quick: bool, say: Say) -> Result:
    """Compare manifold3d with OCCT, and OCCT by three libraries with itself."""
    random = 3 if quick else 100
    chosen = (*shipped(), "pass-through") if quick else tuple(templates())
    worst: dict[str, dict[str, float]] = {
        name: dict.fromkeys(_QUANTITIES, 0.0) for name in ("build123d", "CadQuery", "manifold3d")
    }
    volume = box = 0.0
    bodies = 0
    seconds: dict[str, list[float]] = {}
    for name, variant in _variants(chosen, random):
        say(name)
        shapes = [body.shape for body in (*variant.unit, *variant.plan.tools)]
        bodies += len(shapes)
        measured: dict[str, list[Measures]] = {}
        mesh.forget()
        for kernel, time in interleaved(_makers(shapes, variant.segments), 1, warm=False).items():
            seconds.setdefault(kernel, []).append(time.median)
            measured[kernel] = [(_of_mesh if kernel == "manifold3d" else measure)(solid) for solid in time.value]
        for kernel in worst:
            for exact, other in zip(measured["OCCT"], measured[kernel], strict=True):
                for quantity, value in _differences(exact, other).items():
                    worst[kernel][quantity] = max(worst[kernel][quantity], value)
        for shape, exact, other in zip(shapes, measured["OCCT"], measured["manifold3d"], strict=True):
            off = abs(other.volume - exact.volume)
            volume = max(volume, off / (bounds.volume_bound(shape, variant.segments) + 1e-9 * exact.volume))
            far = float(np.max(np.abs(np.subtract(other.box, exact.box))))
            box = max(box, far / (1.5 * variant.spec.output.tolerance_mm))
    rows = tuple((kernel, *(worst[kernel][q] for q in _QUANTITIES)) for kernel in worst)
    base = timing(seconds["CadQuery"]).median
    times = tuple((kernel, str(timing(values)), timing(values).median / base) for kernel, values in seconds.items())
    promises = [
        Promise("solid counts that differ, any kernel", sum(w["solids"] for w in worst.values()), 0),
        *(Promise(f"{k}: volume against OCCT, relative", worst[k]["volume"], 1e-9) for k in ("build123d", "CadQuery")),
        *(Promise(f"{k}: box against OCCT, mm", worst[k]["box"], 1e-6) for k in ("build123d", "CadQuery")),
        Promise("manifold3d: volume over the bound that the segments imply", volume, 1.0),
        Promise("manifold3d: box over 1.5 times the tolerance", box, 1.0),
    ]
    return Result(
        suite="kernels",
        title="Agreement of the kernels",
        text=(
            f"Every body of {len(chosen)} templates and {random} random specs ({bodies} bodies) from one tree. "
            "build123d and CadQuery share OCCT, so they agree to rounding; manifold3d shares no code with it, and "
            "differs by what its polygons leave out: at most the bound of `unitcad.kernels.bounds`."
        ),
        tables=(
            Table(
                "Largest difference from OCCT",
                ("kernel", "solid count", "volume, relative", "area, relative", "box, mm", "centre, mm"),
                rows,
                f"manifold3d uses {volume:.2g} of its bound on the volume and {box:.2g} of 1.5 times the tolerance.",
            ),
            Table("Time for all bodies of one spec, trees to solids, warm", ("kernel", "time", "over CadQuery"), times),
        ),
        promises=tuple(promises),
        measured={
            **machine("manifold3d", "build123d", "cadquery", "cadquery-ocp"),
            "random specs": random,
            "bodies": bodies,
        },
        summary=summary(worst, times, volume),
    )


def summary(worst: dict[str, dict[str, float]], times: Sequence[tuple[str, str, float]], used: float) -> Summary:
    """Return what each kernel costs and how far it is off; `used`: share of manifold3d's bound on the volume."""
    cost = {kernel: time for kernel, time, _ in times}
    breps = min(("build123d", "CadQuery"), key={kernel: over for kernel, _, over in times}.__getitem__)
    picks = tuple(
        (f"all solids of a spec: {what}", f"{shown(worst[kernel]['volume'])} of a volume", f"{kernel}: {cost[kernel]}")
        for kernel, what in (("manifold3d", "meshes"), (breps, "B-reps"))
    )
    return Summary(picks, f"manifold3d: {used:.2g} of the bound on its volume")


def _variants(chosen: tuple[str, ...], random: int) -> Iterator[tuple[str, Variant]]:
    for name in chosen:
        yield name, Variant.of(name)
    yield from islice(_random_variants(), random)


def _random_variants() -> Iterator[tuple[str, Variant]]:
    for seed in count():
        with contextlib.suppress(Refusal):
            variant = Variant(from_data(seeded_spec(seed)))
            _ = variant.plan
            yield f"random {seed}", variant


def _makers(shapes: Sequence[Shape], segments: int) -> dict[str, Callable[[], list[Any]]]:
    """Return the kernels by name, each from trees to OCCT bodies or manifold3d solids."""
    return {
        "OCCT": lambda: occt.solids(shapes),
        "build123d": lambda: [build123d_kernel.solid(shape).wrapped for shape in shapes],
        "CadQuery": lambda: [cadquery_kernel.solid(shape).wrapped for shape in shapes],
        "manifold3d": lambda: [mesh.realise(shape, segments) for shape in shapes],
    }


def _of_mesh(solid: Any) -> Measures:
    volume, centre = mesh_volume(*mesh.arrays(solid))
    return Measures(len(solid.decompose()), volume, solid.surface_area(), mesh.bounds(solid), tuple(centre))


def _differences(exact: Measures, other: Measures) -> dict[str, float]:
    return {
        "solids": abs(exact.solids - other.solids),
        "volume": abs(other.volume / exact.volume - 1),
        "area": abs(other.area / exact.area - 1),
        "box": float(np.max(np.abs(np.subtract(exact.box, other.box)))),
        "centre": math.dist(exact.centre, other.centre),
    }
