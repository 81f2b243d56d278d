"""The printer and the motor that a spec chooses from the catalogue."""

from __future__ import annotations

from collections.abc import Container
from functools import lru_cache

from msgspec import structs

from unitcad import catalogue
from unitcad.spec.raw import FpcbTable
from unitcad.spec.resolved import Moulds, Spec
from unitcad.text import number

MOTOR_SIZES = ("diameter_mm", "thickness_mm")


def printer_of(spec: Spec) -> catalogue.Printer:
    """Return the catalogue's printer with the lengths that the spec's moulds override."""
    return _override(catalogue.printers(spec.printers)[spec.moulds.printer], spec.moulds)


@lru_cache(maxsize=16)
def _override(printer: catalogue.Printer, moulds: Moulds) -> catalogue.Printer:
    overridden = {
        name: catalogue.Value(value, "spec", "moulds")
        for name, value in structs.asdict(moulds).items()
        if hasattr(printer, name) and float(getattr(printer, name) or 0.0) != value
    }
    return structs.replace(printer, **overridden)


def motor_of(spec: Spec) -> catalogue.Motor | None:
    """Return the catalogue's motor, or None if the spec names none or overrides a size beyond the entry's range."""
    motor = catalogue.motors(spec.motors)[spec.motor.part] if spec.motor.part else None
    if motor and all(_within(getattr(spec.motor, size), getattr(motor, size)) for size in MOTOR_SIZES):
        return motor
    return None


def assumed_lengths(spec: Spec, given: Container[str] = ()) -> dict[str, str]:
    """Return the assumption about each length that nobody has measured, by its key, but for those `given`."""
    motor = motor_of(spec)
    sizes = [(size, getattr(motor, size)) for size in MOTOR_SIZES] if motor else []
    found = {
        f"motor.{size}": f"{number(value.low, 3)} to {number(value.high, 3)}"
        for size, value in sizes
        if value.status == "assumed" and value.value == getattr(spec.motor, size)
    }
    if (key := "motor.thickness_mm") in found and motor and motor.thickness_mm.high:
        proud = motor.thickness_mm.high - spec.motor.thickness_mm
        found[key] += f": up to {number(proud, 2)} mm out of the skin's plane"
    if spec.fpcb and spec.fpcb.thickness_mm == FpcbTable().thickness_mm:
        found["fpcb.thickness_mm"] = "usual stock"
    return {key: how for key, how in found.items() if key not in given}


def said_of(spec: Spec, key: str) -> str:
    """Return "key = value" for a length of a spec."""
    table, _, name = key.partition(".")
    return f"{key} = {number(getattr(getattr(spec, table), name), 3)}"


def _within(size: float, entry: catalogue.Value[float]) -> bool:
    low, high = (entry.value if end is None else end for end in (entry.low, entry.high))
    return low <= size <= high
