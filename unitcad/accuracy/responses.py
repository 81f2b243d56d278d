"""The response of a layered body at five tolerances, compared with the same response at a far tighter one."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from unitcad.accuracy.timing import PROCESSOR, interleaved
from unitcad.attenuation.inputs import EstimateInput, body
from unitcad.attenuation.layered import Response
from unitcad.attenuation.layered.loads import UniformDisc

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
    return body(variant.tissue).response(load, omega, variant.diameter / 2.0 + np.asarray(distances), rtol=rtol)


def response_rows(variant: EstimateInput, repeats: int = 3) -> list[dict[str, Any]]:
    """Return error, bound and time of the response at the distances of the estimate's curve, a row for each rtol."""
    reference = respond(variant, _DISTANCES, REFERENCE)
    times = interleaved({rtol: partial(respond, variant, _DISTANCES, rtol) for rtol in RTOLS}, repeats, clock=PROCESSOR)
    return [
        {"rtol": rtol, **vars(compare(time.value, reference)), "wavenumbers": time.value.wavenumbers, "s": time.median}
        for rtol, time in times.items()
    ]
