"""The resolved spec of a haptic unit, which validation makes of a typed spec and which every other module reads.

Every value is there. `None` and "fill" remain only with a meaning: no circuit, no wires, as many vents as
clear the air, as many cavities as the bed takes. Lengths in mm, the unit in each name.
"""

from __future__ import annotations

import inspect
from collections.abc import Container
from functools import lru_cache
from importlib import import_module
from typing import TYPE_CHECKING, Any

from msgspec import UNSET, Struct, UnsetType, structs

from unitcad import catalogue, text
from unitcad.catalogue import MaterialEntry, MotorEntry, PrinterEntry, TissueEntry
from unitcad.errors import UnitcadError
from unitcad.spec.raw import (
    DERIVED,
    BodyTable,
    CastingTable,
    EstimateTable,
    Format,
    FpcbTable,
    LayerTable,
    MotorTable,
    MouldsTable,
    OutputTable,
    RawSpec,
    WiresTable,
)
from unitcad.text import number

_MOST_LAYERS = 3
"""Layers that a spec's summary lists."""


class MotorSize(MotorTable, frozen=True, kw_only=True):
    """The motor's size and drive; `part` names its catalogue entry, or None.

    `absent`: a custom design without a motor. Nothing is drawn for it; the sizes are placeholders.
    """

    absent: bool | UnsetType = UNSET


class CastLayer(LayerTable, frozen=True, kw_only=True):
    """One silicone layer: its wall, and its cap if the design has caps (0: an open ring)."""

    cap_mm: float = 0.0


if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    _Validated = type(Struct)
    _Keys = Mapping[str, object]
else:

    class _Validated(type(Struct)):
        """Metaclass of Spec: a call takes the keys of a TOML file and validates them."""

        def __call__(cls, /, *values: object, **keys: Any) -> Spec:
            if values:
                raise UnitcadError("Spec takes its keys by name, as in Spec(name=..., design=...); `load` reads a file")
            # Validation knows the designs and is above this room: it is loaded when a spec is asked for.
            return import_module("unitcad.validation").from_tables(keys)

        @property
        def __signature__(cls) -> inspect.Signature:
            return inspect.signature(RawSpec)


class Spec(RawSpec, frozen=True, kw_only=True, metaclass=_Validated):
    """A haptic unit with every value resolved.

    Parameters
    ----------
    name : str
        A name; the result's folder begins with it.
    design : str
        A design (``unitcad list designs``), "FILE.py:NAME", or a file of bodies.
    diameter_mm : float
        Diameter of the unit, mm.
    body : Body or dict, optional
        The outer surface from a file, in place of design and diameter.
    skin_mm : float, optional
        Thickness of the film that closes the skin side, mm. Default: 0, no film.
    layers : sequence of Layer or dict
        The silicone layers, from the inside out; one is a single-layer control.
    motor : Motor or dict, optional
        The motor. Default: the part LCM0720A3463F.
    fpcb : Fpcb, dict or False, optional
        The flexible circuit. Default: none, as False.
    wires : Wires, dict or False, optional
        Wires in place of a circuit. Default: none, as False.
    moulds, casting, estimate, output : Moulds, Casting, Estimate, Output or dict, optional
        Settings. Default: the defaults of each class.
    materials, motors, printers, tissue : mapping, optional
        Entries of the spec's own, by name.
    parameters : mapping of str to bool, int, float or str, optional
        Values that a custom design reads.
    design_source : str, optional
        Text of a custom design's file; unitcad fills it in.

    Raises
    ------
    Refusal
        For an invalid value, with the same sentence as for a file.

    Examples
    --------
    >>> import unitcad
    >>> layer = unitcad.Layer(material="ecoflex-00-30", wall_mm=2.5)
    >>> unitcad.Spec(name="control", design="embedded", diameter_mm=14, layers=[layer])
    Spec('control': embedded, 14 mm, ecoflex-00-30 2.5)
    """

    motor: MotorSize = DERIVED
    fpcb: FpcbTable | None = None
    wires: WiresTable | None = None
    layers: tuple[CastLayer, ...]

    if TYPE_CHECKING:

        def __init__(
            self,
            *,
            name: str,
            design: str = ...,
            diameter_mm: float = ...,
            layers: Sequence[LayerTable | _Keys],
            body: BodyTable | _Keys = ...,
            skin_mm: float = 0.0,
            motor: MotorTable | _Keys | bool = ...,
            fpcb: FpcbTable | _Keys | bool | None = None,
            wires: WiresTable | _Keys | bool | None = None,
            moulds: MouldsTable | _Keys = ...,
            casting: CastingTable | _Keys = ...,
            estimate: EstimateTable | _Keys = ...,
            output: OutputTable | _Keys = ...,
            materials: Mapping[str, MaterialEntry | _Keys] = ...,
            motors: Mapping[str, MotorEntry | _Keys] = ...,
            printers: Mapping[str, PrinterEntry | _Keys] = ...,
            tissue: Mapping[str, Mapping[str, TissueEntry | _Keys]] = ...,
            parameters: Mapping[str, bool | int | float | str] = ...,
            design_source: str | None = None,
        ) -> None: ...

    @classmethod
    def settled(cls, **values: Any) -> Spec:
        """Return the spec of complete values, without checks: only for validation."""
        return type(Struct).__call__(cls, **values)

    @property
    def summary(self) -> str:
        """Name, design, diameter and layers in at most 160 characters."""
        layers = [f"{layer.material} {layer.wall_mm:g}" for layer in self.layers]
        listed = " / ".join(layers) if len(layers) <= _MOST_LAYERS else f"{len(layers)} layers"
        unit = f"{text.shorten(self.design, 40)}, {self.diameter_mm:g} mm"
        return text.shorten(f"{text.shorten(self.name, 40)!r}: {unit}, {listed}", 160)

    def __repr__(self) -> str:
        return f"Spec({self.summary})"

    def _repr_html_(self) -> str:
        rows = [
            ("design", self.design),
            ("diameter_mm", self.diameter_mm),
            ("motor", None if self.motor.absent else f"{self.motor.diameter_mm:g} x {self.motor.thickness_mm:g} mm"),
            ("circuit", self.fpcb and f"tail {self.fpcb.tail}, {self.fpcb.tail_width_mm:g} mm wide"),
            *(
                (f"layers.{i}", f"{layer.material}, wall {layer.wall_mm:g} mm, cap {layer.cap_mm:g} mm")
                for i, layer in enumerate(self.layers)
            ),
            ("printer", self.moulds.printer),
            ("estimate", f"{self.estimate.frequency_hz:g} Hz on {self.estimate.tissue}"),
        ]
        return text.table((), rows, self.name)


def with_formats(spec: Spec, formats: tuple[Format, ...] = ()) -> Spec:
    """Return the spec with other formats, or with none: for keys that do not depend on them."""
    return structs.replace(spec, output=structs.replace(spec.output, formats=formats))


MOTOR_SIZES = ("diameter_mm", "thickness_mm")


def printer_of(spec: Spec) -> catalogue.Printer:
    """Return the catalogue's printer with the lengths that the spec's moulds override."""
    return _override(catalogue.printers(spec.printers)[spec.moulds.printer], spec.moulds)


@lru_cache(maxsize=16)
def _override(printer: catalogue.Printer, moulds: MouldsTable) -> catalogue.Printer:
    overridden = {
        name: catalogue.Value(value, "spec", "moulds")
        for name, value in structs.asdict(moulds).items()
        if hasattr(printer, name) and float(getattr(printer, name) or 0.0) != value
    }
    return structs.replace(printer, **overridden)


def motor_of(spec: Spec) -> catalogue.Motor | None:
    """Return the catalogue's motor, or None if the spec names none or overrides a size beyond the entry's range."""
    motor = _named_motor(spec)
    sizes = [size for size in MOTOR_SIZES if not (motor and motor.square and size == "diameter_mm")]
    if motor and all(_within(getattr(spec.motor, size), getattr(motor, size)) for size in sizes):
        return motor
    return None


def _named_motor(spec: Spec) -> catalogue.Motor | None:
    return catalogue.motors(spec.motors)[spec.motor.part] if spec.motor.part else None


def assumed_lengths(spec: Spec, given: Container[str] = (), path: str = "") -> dict[str, str]:
    """Return the assumption about each length that nobody has measured, by its key.

    `given`: lengths of the user's own, by their path in a file; `path`: the path of this spec in that file.
    """
    motor = _named_motor(spec)  # even of another diameter it gives the thickness that the spec leaves out
    sizes = [(size, getattr(motor, size)) for size in MOTOR_SIZES] if motor else []
    found = {
        f"motor.{size}": f"{number(value.low, 3)} to {number(value.high, 3)}"
        for size, value in sizes
        if value.status == "assumed" and value.value == getattr(spec.motor, size)
    }
    if (key := "motor.thickness_mm") in found and motor and motor.thickness_mm.high:
        proud = motor.thickness_mm.high - spec.motor.thickness_mm
        found[key] += (
            f"; a motor of {number(motor.thickness_mm.high, 3)} mm stands {number(proud, 2)} mm out at the skin"
        )
    if spec.fpcb and spec.fpcb.thickness_mm == FpcbTable().thickness_mm:
        found["fpcb.thickness_mm"] = "usual stock"
    return {key: how for key, how in found.items() if path + key not in given}


def length_text(spec: Spec, key: str) -> str:
    """Return "key = value" for a length of a spec."""
    table, _, name = key.partition(".")
    return f"{key} = {number(getattr(getattr(spec, table), name), 3)}"


def _within(size: float, entry: catalogue.Value[float]) -> bool:
    low, high = (entry.value if end is None else end for end in (entry.low, entry.high))
    return low <= size <= high
