"""The printer that a spec's tools are printed on."""

from __future__ import annotations

from functools import lru_cache

from msgspec import structs

from unitcad import catalogue
from unitcad.spec.effective import Moulds, Spec


def printer_of(spec: Spec) -> catalogue.Printer:
    """Return the catalogue's printer with what the spec's moulds override."""
    return _overridden(catalogue.printers(spec.printers)[spec.moulds.printer], spec.moulds)


@lru_cache(maxsize=16)
def _overridden(printer: catalogue.Printer, moulds: Moulds) -> catalogue.Printer:
    overridden = {
        name: catalogue.Value(value, "spec", "moulds")
        for name, value in structs.asdict(moulds).items()
        if hasattr(printer, name) and float(getattr(printer, name) or 0.0) != value
    }
    return structs.replace(printer, **overridden)
