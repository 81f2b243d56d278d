"""The text of a lab's fit that a spec brings along, as a `LabFit`."""

from __future__ import annotations

import tomllib
from functools import lru_cache
from typing import TYPE_CHECKING

from unitcad.errors import Refusal, UnknownKey
from unitcad.rooms import kind_of
from unitcad.spec import convert
from unitcad.spec.raw import EstimateTable
from unitcad.text import with_article

if TYPE_CHECKING:
    from unitcad.attenuation.edge.ranges import LabFit

FIELD = "estimate.fit"
_NEXT = "name a lab-fit.toml, which `unitcad fit LAB` writes from measured units"


def check_fit(table: EstimateTable) -> None:
    """Raise Refusal for a fit that can't be used: no name or no text, damaged, by other moduli than the estimate's."""
    if table.fit is None or table.fit_source is None:
        key = "fit" if table.fit is None else "fit_source"
        raise Refusal(f"estimate.{key}", None, "is required beside the other of fit and fit_source")
    try:
        fit = lab_fit(table.fit_source)
    except Refusal as refusal:
        if refusal.field != FIELD:
            raise
        raise Refusal(FIELD, table.fit, refusal.limit) from None
    if fit.moduli != table.moduli:
        limit = f"{table.fit} has its constants by {fit.moduli} moduli"
        raise Refusal("estimate.moduli", table.moduli, limit, fit.moduli)


@lru_cache(maxsize=16)
def lab_fit(text: str) -> LabFit:
    """Return the fit of a lab-fit.toml's text. Raises Refusal, at `estimate.fit`, for the first fault."""
    from unitcad.attenuation.edge.ranges import LabFit, fault

    try:
        data = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError, ValueError) as error:
        raise Refusal(FIELD, None, f"not TOML: {error}") from None
    if kind := kind_of(data):
        raise Refusal(FIELD, None, f"is {with_article(kind.name)}, not a fit; {_NEXT}")
    try:
        fit = convert(data, LabFit)
    except Refusal as refusal:
        limit = f"unknown key; {_NEXT}" if isinstance(refusal, UnknownKey) else refusal.limit
        raise Refusal(f"{FIELD}: {refusal.field}", refusal.value, limit) from None
    wrong = fault(fit)
    if wrong:
        field, value, limit = wrong
        raise Refusal(f"{FIELD}: {field}", value, limit)
    return fit
