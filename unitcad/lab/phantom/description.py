"""What a phantom's TOML file may hold. Lengths in mm; layers from the skin down, on a stiff plate."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

from msgspec import Meta, Struct
from msgspec.structs import replace

from unitcad.catalogue import entries as kinds
from unitcad.errors import WrongArgument
from unitcad.spec import convert, read_toml
from unitcad.validation.shipped_files import named_file, shipped_files

LEAST_LAYER, MOST_DEPTH = 0.5, 100.0
_LAYER_NAME = "small letters a to z, digits and -, the first a letter"
_NAME = "small letters a to z, digits and -, the first a letter or digit"


class PhantomLayer(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """One layer: a silicone of the table of thinned ones, its thinner in parts to 100 of A and B, and its thickness.

    `loss_factor`: tan delta, assumed where nobody measured it. `measured`: what `unitcad material` wrote of the layer's
    coupons; its modulus goes before the table's, and so does its loss factor.
    """

    name: Annotated[str, Meta(min_length=1, max_length=40, pattern=r"^[a-z][a-z0-9-]*$", description=_LAYER_NAME)]
    silicone: str
    thinner_pct: Annotated[float, Meta(ge=0, le=100)]
    thickness_mm: Annotated[float, Meta(ge=LEAST_LAYER, le=60)]
    loss_factor: Annotated[float, Meta(ge=0.01, le=1)] = 0.2
    measured: Annotated[str, Meta(min_length=1, max_length=1000)] | None = None


class PhantomTable(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A phantom; `inside_mm` is the box's inside, None for the least that keeps the echo below `most_echo_pct`."""

    name: Annotated[str, Meta(min_length=1, max_length=60, pattern=r"^[a-z0-9][a-z0-9-]*$", description=_NAME)]
    layers: Annotated[tuple[PhantomLayer, ...], Meta(min_length=1, max_length=6)]
    unit_diameter_mm: Annotated[float, Meta(ge=4, le=40)] = 14.0
    motor_diameter_mm: Annotated[float, Meta(ge=2, le=40)] = 7.0
    frequency_hz: kinds.Frequency = 125.0
    points_mm: Annotated[tuple[Annotated[float, Meta(ge=0, le=60)], ...], Meta(min_length=2, max_length=13)] = (
        0.0, 5.0, 10.0, 15.0, 20.0, 25.0, 30.0
    )  # fmt: skip
    inside_mm: Annotated[float, Meta(ge=40, le=400)] | None = None
    most_echo_pct: Annotated[float, Meta(ge=0.5, le=50)] = 5.0
    plate_thickness_mm: Annotated[float, Meta(ge=2, le=20, description="of the acrylic plate below")] = 5.0
    coupons: Annotated[int, Meta(ge=0, le=4, description="tensile coupons of each pour")] = 3
    stage_pitch_mm: Annotated[float, Meta(ge=5, le=50, description="of the table's threaded holes")] = 25.0
    stage_bolt_mm: Annotated[float, Meta(ge=2, le=12, description="thread of the table's holes")] = 6.0
    printer: str = "fdm-0.4"
    waste: Annotated[float, Meta(ge=0, le=2, description="extra mix as a fraction")] = 0.1
    scale_resolution_g: Annotated[float, Meta(ge=1e-4, le=10)] = 0.1
    room_c: Annotated[float, Meta(ge=5, le=45)] = 23.0

    @property
    def depth_mm(self) -> float:
        """All layers together."""
        return sum(layer.thickness_mm for layer in self.layers)


def phantoms() -> dict[str, Path]:
    """Return the shipped phantoms by name."""
    return shipped_files("phantoms")


def load_phantom(source: str | os.PathLike[str]) -> PhantomTable:
    """Return the phantom of a shipped name or of a file, from whose folder its `measured` files are seen.

    Raises Refusal or UnitcadError for what is not valid.
    """
    path = named_file(os.fspath(source), phantoms(), "phantom", WrongArgument)
    table = convert(read_toml(path), PhantomTable)
    layers = (
        replace(layer, measured=str(path.parent / layer.measured)) if layer.measured else layer
        for layer in table.layers
    )
    return replace(table, layers=tuple(layers))
