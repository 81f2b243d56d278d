"""The text of a lab's fit that a spec brings along, as a `LabFit`."""

from __future__ import annotations

import tomllib
from functools import lru_cache
from typing import TYPE_CHECKING

from unitcad.errors import Refusal, UnknownKey
from unitcad.spec import convert
from unitcad.spec.raw import EstimateTable

if TYPE_CHECKING:
    from unitcad.attenuation.edge.ranges import LabFit

FIELD = "estimate.fit"


def check_fit(table: EstimateTable) -> None:
    """Raise Refusal for a fit that can't be used: no name or no text, damaged, by other moduli than the estimate's."""
    if table.fit is None or table.fit_source is None:
        key = "fit" if table.fit is None else "fit_source"
        raise Refusal(f"estimate.{key}", None, "is required beside the other of fit and fit_source")
    fit = lab_fit(table.fit_source)
    if fit.moduli != table.moduli:
        limit = f"{table.fit} has its constants by {fit.moduli} moduli"
        raise Refusal("estimate.moduli", table.moduli, limit, fit.moduli)


@lru_cache(maxsize=16)
def lab_fit(text: str) -> LabFit:
    """Return the fit of a lab-fit.toml's text. Raises Refusal, at `estimate.fit`, for the first fault."""
    from unitcad.attenuation.edge.ranges import LabFit, fault

    try:
        fit = convert(tomllib.loads(text), LabFit)
    except (tomllib.TOMLDecodeError, RecursionError, ValueError) as error:
        raise Refusal(FIELD, None, f"not TOML: {error}") from None
    except Refusal as refusal:
        limit = "unknown key; name a lab-fit.toml of unitcad fit" if isinstance(refusal, UnknownKey) else refusal.limit
        raise Refusal(f"{FIELD}: {refusal.field}", refusal.value, limit) from None
    wrong = fault(fit)
    if wrong:
        field, value, limit = wrong
        raise Refusal(f"{FIELD}: {field}", value, limit)
    return fit
