"""A whole phantom: description, recipes, box, coupons and expected response, each worked out once."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from unitcad.catalogue import Printer, choose, printers, tissue
from unitcad.errors import Refusal
from unitcad.estimating import tissue_layer
from unitcad.kernels.mesh import bounds, realise
from unitcad.lab.phantom import tensile_coupons
from unitcad.lab.phantom.description import PhantomTable
from unitcad.lab.phantom.marked_lid import expect_apart
from unitcad.lab.phantom.phantom_response import ACRYLIC, POISSON, Expected, echo_pct, expected, wall_distance
from unitcad.lab.phantom.recipe import Recipe, recipe, stiffening
from unitcad.lab.phantom.screed_box import BoxLengths, cast, lengths, pieces
from unitcad.shape.body import Body

SEGMENTS = 96
_STEP_MM = 5.0
LONGEST_SOURCE = 500
"""Characters of a source in a spec."""


@dataclass(frozen=True)
class PhantomSet:
    """A phantom ready to be written.

    `volumes_mm3` and `coupon_mm3`: of each layer, skin first, and of its coupons.
    """

    table: PhantomTable
    recipes: tuple[Recipe, ...]
    printer: Printer
    inside_mm: float
    size: BoxLengths
    tools: tuple[Body, ...]
    layers: tuple[Body, ...]
    volumes_mm3: tuple[float, ...]
    coupon_mm3: float
    expected: Expected


def phantom_set(table: PhantomTable) -> PhantomSet:
    """Work out a phantom; its response is compared with that of the catalogue's forearm.

    Raises Refusal for walls that echo too much, for layers that nobody tested, and for pieces beyond the bed.
    """
    recipes = tuple(recipe(one, table.frequency_hz, f"layers.{i}") for i, one in enumerate(table.layers))
    if len({layer.name for layer in table.layers}) < len(table.layers):
        raise Refusal("layers", ", ".join(layer.name for layer in table.layers), "each layer needs a name of its own")
    expect_apart(table.points_mm)
    printer = choose("printer", table.printer, printers())
    wall = wall_distance(table, recipes)
    inside = _inside(table, recipes, wall)
    size = lengths(table, inside, printer)
    tools = (*pieces(table, size, printer), *tensile_coupons.moulds(table, printer))
    _expect_bed(table, recipes, printer, tools, inside)
    layers = tuple(cast(table, size))
    volumes = tuple(float(realise(body.shape, SEGMENTS).volume()) for body in layers)
    forearm = tuple(map(tissue_layer, tissue()))
    response = expected(table, recipes, inside / 2, wall, forearm)
    coupons = tensile_coupons.volume_mm3(table.coupons)
    return PhantomSet(table, recipes, printer, inside, size, tools, layers, volumes, coupons, response)


def tissue_table(phantom: PhantomSet) -> dict[str, dict[str, object]]:
    """Return the layers of [tissue.NAME] of a spec, skin first, the plate last."""
    found: dict[str, dict[str, object]] = {}
    for layer, one in zip(phantom.table.layers, phantom.recipes, strict=True):
        modulus = {"value": _four(one.modulus_kpa), "low": _four(one.low_kpa), "high": _four(one.high_kpa)}
        loss, low, high = one.loss
        hertz = phantom.table.frequency_hz
        also = f"; high: also times {stiffening(hertz):.3g}, what {hertz:g} Hz may bring (assumed)"
        source = f"{one.silicone.name} + {one.thinner_pct:g} % thinner, {one.source}"
        ended = "" if one.measured and one.measured.dynamic else also
        found[layer.name] = {
            "status": "measured" if one.measured else "secondary",
            "source": source[: LONGEST_SOURCE - len(ended)] + ended,
            "thickness_mm": layer.thickness_mm,
            "density_kg_m3": _four(1e3 * one.density_g_cm3),
            "youngs_modulus_kpa": modulus,
            "poisson_ratio": {"value": POISSON, "status": "assumed", "source": "silicone hardly changes its volume"},
            "loss_factor": {
                "value": _four(loss),
                "low": _four(low),
                "high": _four(high),
                "status": "measured" if one.loss_source else "assumed",
                "source": one.loss_source[:LONGEST_SOURCE] or "tan delta of soft silicones at 100 to 150 Hz",
            },
        }
    found["plate"] = {"status": "secondary", "source": "cast acrylic, data sheets", **ACRYLIC}
    return found


def printed(tools: Sequence[Body]) -> list[Body]:
    """Return the pieces that a printer makes."""
    return [body for body in tools if body.made == "printed"]


def _inside(table: PhantomTable, recipes: tuple[Recipe, ...], wall: float) -> float:
    if math.isinf(wall):
        limit = f"no wall is far enough for an echo below {table.most_echo_pct:g} % at {max(table.points_mm):g} mm"
        raise Refusal("most_echo_pct", table.most_echo_pct, limit)
    needed = _STEP_MM * math.ceil(2 * wall / _STEP_MM)
    if table.inside_mm is None:
        return needed
    if table.inside_mm < 2 * wall:
        echo = echo_pct(table, recipes, table.inside_mm / 2)
        limit = (
            f"the walls' echo is {echo:.3g} % at {max(table.points_mm):g} mm; for {table.most_echo_pct:g} % they must "
            f"be {wall:g} mm from the unit's centre"
        )
        raise Refusal("inside_mm", table.inside_mm, limit, needed)
    return table.inside_mm


def _expect_bed(
    table: PhantomTable, recipes: tuple[Recipe, ...], printer: Printer, tools: Sequence[Body], inside: float
) -> None:
    bed = sorted((float(printer.bed_x_mm), float(printer.bed_y_mm)))
    for body in printed(tools):
        x0, y0, z0, x1, y1, z1 = bounds(realise(body.shape, SEGMENTS))
        sides = sorted((x1 - x0, y1 - y0))
        if sides[0] <= bed[0] and sides[1] <= bed[1] and z1 - z0 <= float(printer.bed_z_mm):
            continue
        fitting = [name for name, one in printers().items() if _fits(sides, z1 - z0, one)]
        over = max(sides[0] - bed[0], sides[1] - bed[1], 0.0)
        left = inside - over
        limit = (
            f"the {body.name} is {sides[1]:.0f} x {sides[0]:.0f} x {z1 - z0:.0f} mm, the bed {bed[1]:g} x {bed[0]:g}"
        )
        if over and left > 40 and (math.isclose(left, inside) or body.kind != "coupon"):
            limit += (
                f"; about {left:.0f} mm inside would fit, whose walls echo {echo_pct(table, recipes, left / 2):.2g} %"
            )
        raise Refusal("printer", printer.name, limit, fitting[0] if fitting else None)


def _fits(sides: Sequence[float], height: float, printer: Printer) -> bool:
    bed = sorted((float(printer.bed_x_mm), float(printer.bed_y_mm)))
    return sides[0] <= bed[0] and sides[1] <= bed[1] and height <= float(printer.bed_z_mm)


def _four(value: float) -> float:
    return float(f"{value:.4g}")
