"""The estimate of a unit's result: its file, and its summary in the manifest."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any

from unitcad.attenuation.edge.estimates import rounded_layered, summary
from unitcad.attenuation.inputs import EstimateInput
from unitcad.cache import Store, digest
from unitcad.estimate_inputs import estimate_input, estimate_spec
from unitcad.json_text import json_bytes
from unitcad.pipeline.manifest import EstimateSummary
from unitcad.pipeline.plan import code_version
from unitcad.pipeline.plan import forget as forget_geometry
from unitcad.spec import Spec

_ESTIMATES: dict[Hashable, tuple[EstimateSummary, bytes]] = {}
"""Estimates that this process made last, by their inputs: variants that differ only in casting share one."""
_MOST_ESTIMATES = 64


def forget() -> None:
    """Drop the results that this process caches, for a measurement of times."""
    forget_geometry()
    _ESTIMATES.clear()


def estimated(spec: Spec, store: Store) -> tuple[EstimateSummary, bytes]:
    """Return the estimate's summary and its file. The layered solver's part reads no silicone: the store shares it."""

    def layered(wanted: EstimateInput) -> dict[str, Any]:
        skin = wanted.tissue_name, wanted.tissue, wanted.frequency
        load = wanted.diameter, wanted.motor_diameter, wanted.drive
        key = digest(repr(((*skin, *load), code_version())).encode())
        return store.data(key, lambda: rounded_layered(wanted))

    reads = estimate_input(spec), spec.estimate
    if reads not in _ESTIMATES:
        while len(_ESTIMATES) >= _MOST_ESTIMATES:
            del _ESTIMATES[next(iter(_ESTIMATES))]
        data = estimate_spec(spec, layered=layered)
        _ESTIMATES[reads] = EstimateSummary(**summary(data)), json_bytes(data)
    return _ESTIMATES[reads]
