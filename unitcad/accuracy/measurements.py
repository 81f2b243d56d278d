"""Measurements for one spec: meshes and response at five tolerances, and the outputs that a build skips, with times."""

from __future__ import annotations

import gc
import math
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from typing import Any, TypeVar

import numpy as np

from unitcad.attenuation.inputs import EstimateInput, tissue_medium
from unitcad.attenuation.layered import Response
from unitcad.attenuation.layered.loads import UniformDisc
from unitcad.cache import MemoryStore
from unitcad.kernels import bounds, mesh
from unitcad.moulds.mould_set import MouldSet
from unitcad.pipeline.make import make
from unitcad.pipeline.manifest import Manifest
from unitcad.pipeline.result import Progress
from unitcad.pipeline.subject import Subject
from unitcad.pipeline.unit_estimate import forget
from unitcad.shape import Shape
from unitcad.spec.raw import OUTPUTS

K = TypeVar("K")
PROCESSOR = time.process_time
"""A clock that counts only this process's processor seconds."""
PROCESSOR_NOTE = (
    "Times are processor seconds of all threads: waiting on a busy machine is not in them, a cache that is shared with "
    "other programs is."
)


@dataclass(frozen=True)
class Timing:
    """Seconds: median, lower and upper quartile, all equal for a single run; `value`: the last run's result."""

    median: float
    low: float
    high: float
    value: Any = None

    def __str__(self) -> str:
        spread = f" ({_seconds(self.low)} to {_seconds(self.high)})" if self.high > self.low else ""
        return _seconds(self.median) + spread


def interleaved(
    calls: Mapping[K, Callable[[], Any]],
    repeats: int,
    warm: bool = True,
    clock: Callable[[], float] = time.perf_counter,
) -> dict[K, Timing]:
    """Time every call `repeats` times, in turn; a first round warms up and does not count.

    clock: seconds; `PROCESSOR` for work in one thread, for which waiting on a busy machine must not count.
    """
    seconds: dict[K, list[float]] = {name: [] for name in calls}
    values: dict[K, Any] = {}
    for round_ in range(repeats + warm):
        for name, call in calls.items():
            gc.collect()
            start = clock()
            values[name] = call()
            taken = clock() - start
            if round_ or not warm:
                seconds[name].append(taken)
    return {name: timing(seconds[name], values[name]) for name in calls}


def timing(seconds: list[float], value: Any = None) -> Timing:
    """Return the median and quartiles of some runs."""
    if len(seconds) < 2:
        return Timing(seconds[0], seconds[0], seconds[0], value)
    low, middle, high = statistics.quantiles(seconds, n=4, method="inclusive")
    return Timing(middle, low, high, value)


def _seconds(value: float) -> str:
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("us", 1e-6)):
        if value >= size:
            return f"{value / size:.3g} {unit}"
    return f"{value / 1e-9:.3g} ns"


TOLERANCES = (0.1, 0.03, 0.01, 0.003, 0.001)
"""mm."""
SAMPLES = 100
_ROUNDING = 1e-6
"""How far OCCT's distances and volumes may be off: mm, and relative."""

Mesh = tuple[np.ndarray, np.ndarray]
"""Vertices (n, 3) in mm and faces (m, 3)."""


def tolerances_of(own: float) -> tuple[float, ...]:
    """Return five tolerances, the coarsest first: `own` instead of the nearest of `TOLERANCES`."""
    nearest = min(TOLERANCES, key=lambda one: abs(np.log(one / own)))
    return tuple(own if one == nearest else one for one in TOLERANCES)


def mesh_rows(moulds: MouldSet, say: Callable[[str], object], repeats: int = 3) -> list[dict[str, Any]]:
    """Return triangles, errors, bounds and time of all bodies' meshes, a row for each tolerance.

    Distances are of `SAMPLES` points of each mesh, in mm; volumes relative. Each is that of the worst body, and so is
    its bound. Without the extra `step` there is no exact surface to compare with: the errors are None.
    """
    shapes = {body.shape: body.name for body in (*moulds.unit, *moulds.plan.tools)}
    radius = moulds.dimensions.outer_radius
    segments = {one: mesh.segment_count(radius, one) for one in tolerances_of(moulds.spec.output.tolerance_mm)}
    say("meshes")
    times = interleaved({one: partial(_realise, tuple(shapes), segments[one]) for one in segments}, repeats)
    exact = _exact(tuple(shapes)) if find_spec("OCP") else {}
    rows: list[dict[str, Any]] = []
    for tolerance, timed in times.items():
        say(f"distances at {tolerance:g} mm")
        row: dict[str, Any] = {"tolerance_mm": tolerance, "segments": segments[tolerance]}
        row["triangles"] = sum(len(faces) for _, faces in timed.value)
        volumes = [mesh.realise(shape, segments[tolerance]).volume() for shape in shapes]
        off = [bounds.deviation(shape, segments[tolerance]) for shape in shapes]
        less = [bounds.volume_bound(shape, segments[tolerance]) / v for shape, v in zip(shapes, volumes, strict=True)]
        row |= {"distance_bound_mm": max(off), "volume_bound": max(less), "distance_mm": None, "volume": None}
        if exact:
            from unitcad.accuracy.occt_distance import distance

            far = [distance(v, f, exact[s][0], SAMPLES) for s, (v, f) in zip(shapes, timed.value, strict=True)]
            wrong = [abs(v / exact[s][1] - 1) for s, v in zip(shapes, volumes, strict=True)]
            worst = max(range(len(far)), key=far.__getitem__)
            row |= {"distance_mm": far[worst], "body": [*shapes.values()][worst], "volume": max(wrong)}
            kept = all(a <= b + _ROUNDING for a, b in (*zip(far, off, strict=True), *zip(wrong, less, strict=True)))
            row["within_bounds"] = kept
        rows.append({**row, "s": timed.median})
    return rows


def _realise(shapes: Sequence[Shape], segments: int) -> list[Mesh]:
    mesh.forget()
    return [mesh.arrays(mesh.realise(shape, segments)) for shape in shapes]


def _exact(shapes: Sequence[Shape]) -> dict[Shape, tuple[Any, float]]:
    """Return each shape's solid by OCCT, and its volume (mm3)."""
    from unitcad.kernels import occt

    return {s: (solid, occt.volume(solid)) for s, solid in zip(shapes, occt.solids(shapes), strict=True)}


RTOLS = (0.1, 1e-3, 1e-5, 1e-7, 1e-9)
REFERENCE = 1e-11
"""The rtol of the reference: a hundredth of the least of `RTOLS`."""
COMPONENTS = ("r", "theta", "z")
_DISTANCES = np.arange(31) * 1e-3
"""From the unit's edge outwards, m: the estimate's curve."""


@dataclass(frozen=True)
class Comparison:
    """A response compared with its reference: the largest error and its bound, both over the largest |u|.

    over_bound: largest error over its own bound, of one component at one radius. An error is counted only by as much as
    it exceeds the reference's own bound.
    """

    error: float
    bound: float
    over_bound: float


def compare(response: Response, reference: Response) -> Comparison:
    """Compare a response with its reference; NaN has an infinite error."""
    u, exact, bound, doubt = (
        np.array([getattr(one, f"{kind}_{name}") for name in COMPONENTS])
        for one, kind in ((response, "u"), (reference, "u"), (response, "error"), (reference, "error"))
    )
    if not (np.isfinite(u).all() and np.isfinite(bound).all()):
        return Comparison(math.inf, math.inf, math.inf)
    off = np.abs(u - exact)
    excess = np.maximum(off - doubt, 0.0)
    ratio = np.divide(excess, bound, out=np.where(excess > 0, math.inf, 0.0), where=bound > 0)
    return Comparison(float(off.max() / reference.largest), response.error / reference.largest, float(ratio.max()))


def respond(variant: EstimateInput, distances: Any, rtol: float) -> Response:
    """Return the skin's response to the motor's drive at distances (m) from the unit's edge."""
    load = UniformDisc(variant.motor_diameter / 2.0, "tangential" if variant.drive == "flat" else "normal")
    omega = 2.0 * math.pi * variant.frequency.middle
    return tissue_medium(variant.tissue).response(
        load, omega, variant.diameter / 2.0 + np.asarray(distances), rtol=rtol
    )


def response_rows(variant: EstimateInput, repeats: int = 3) -> list[dict[str, Any]]:
    """Return error, bound and time of the response at the distances of the estimate's curve, a row for each rtol."""
    reference = respond(variant, _DISTANCES, REFERENCE)
    times = interleaved({rtol: partial(respond, variant, _DISTANCES, rtol) for rtol in RTOLS}, repeats, clock=PROCESSOR)
    return [
        {"rtol": rtol, **vars(compare(time.value, reference)), "wavenumbers": time.value.wavenumbers, "s": time.median}
        for rtol, time in times.items()
    ]


Request = tuple[Sequence[str], Sequence[str], bool]
"""Outputs, formats, checks."""
EVERYTHING = "everything"
REQUESTS: dict[str, Request] = {
    EVERYTHING: (OUTPUTS, ("step", "stl", "3mf", "svg", "glb"), True),
    "STL only": (OUTPUTS, ("stl",), True),
    "STL, no checks": (("unit", "moulds"), ("stl",), False),
    "unit only": (("unit",), ("stl",), True),
    "estimate only": (("estimate",), ("stl",), True),
}
"""Without shaded pictures."""


def time_requests(subject: Subject, requests: Mapping[str, Request], repeats: int) -> dict[str, Timing]:
    """Return the time of each request, made from an empty store in this process; the value is its manifest."""
    return interleaved({name: partial(_manifest, subject, request) for name, request in requests.items()}, repeats)


def saving(one: Timing, whole: Timing) -> float | None:
    """Return the seconds that a request saves, between the medians; None if the quartiles of both overlap."""
    return whole.median - one.median if one.high < whole.low else None


def skipped_rows(subject: Subject, repeats: int = 5) -> list[dict[str, Any]]:
    """Return a row for each request: its time with quartiles, its `saving` against all outputs, the skipped outputs."""
    requests = {EVERYTHING: REQUESTS[EVERYTHING], "as the spec asks": (OUTPUTS, subject.formats, True), **REQUESTS}
    times = time_requests(subject, requests, repeats)
    return [
        {
            "request": name,
            "s": time.median,
            "s_low": time.low,
            "s_high": time.high,
            "saved_s": saving(time, times[EVERYTHING]),
            "skipped": time.value["skipped"],
        }
        for name, time in times.items()
    ]


def _manifest(subject: Subject, request: Request) -> Manifest:
    only, formats, check = request
    forget()
    return make(subject.with_formats(formats), only, check, MemoryStore(), Progress()).manifest  # type: ignore[arg-type]
