"""Heights of the cured unit as the printed tools make them, and those that come out wrong, with what would print right."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from msgspec import structs

from unitcad.designs.dimensions import poured
from unitcad.designs.printed import OVER_ALL, SHORT, Height, in_layers, printed_heights
from unitcad.errors import Refusal
from unitcad.moulds.mould_set import MouldSet
from unitcad.spec import Spec, printer_of
from unitcad.spec.layers import layers_of
from unitcad.text import join_words, number

NEAR = 0.02
"""Share of a layer within which a height counts as on the grid."""
MOST_ERROR = 0.05
"""Error of a printed height, as a share, from which a person is warned."""
LAYER_HEIGHTS = (0.05, 0.08, 0.1, 0.12, 0.15, 0.16, 0.2, 0.24, 0.25, 0.28, 0.3)
"""Layer heights that slicers' profiles have, mm."""
MOST_OF_NOZZLE = 0.75
"""Largest layer over the nozzle's bore (usual advice of slicers)."""


def unit_heights(moulds: MouldSet) -> list[Height]:
    """Return the cavity's depth, every layer's height over its ground, the height over all, and the tongue's thickness.

    Those of silicone are of the cured unit: it shrinks from the tools' lengths. Of cups by complement they are those
    of the layers' tops; none are known of a body that is turned, or under a roof with channels.
    """
    plan, spec, layers = moulds.plan, moulds.spec, layers_of(moulds.spec)
    if not plan.of_kind("cup"):  # a tray, whose floor is its plate's face
        bottom, (step, *_) = -moulds.plate[0], plan.steps
        sheet = layers.printed(bottom + step.rim) - layers.printed(bottom)
        return [Height("sheet's thickness", round(step.rim, 4), round(sheet, 4))]
    if not plan.concentric and not plan.pins:
        if plan.way or any(step.gated for step in plan.steps):
            return []
        tops = [(f"layer {step.index}'s height", step.rim) for step in plan.steps]
        tops.append((OVER_ALL, plan.steps[-1].rim))
        return [Height(what, round(top, 4), round(layers.printed(top), 4)) for what, top in tops]
    found = printed_heights(spec, moulds.dimensions, plan.dimensions, -moulds.plate[0])
    exit = plan.dimensions.exit
    if exit and any(tool.made == "printed" for tool in plan.of_kind("tongue")):
        found.append(Height(TONGUE, round(exit.height, 4), layers.printed(exit.height)))
    return found


TONGUE = "tongue's thickness"


def as_printed(moulds: MouldSet) -> str:
    """Write the height over all and the caps as the printer makes them; "" if it makes them as drawn.

    A curved array has no height over all.
    """
    heights = unit_heights(moulds.inner or moulds)
    total = next((each for each in heights if each.what == OVER_ALL and not moulds.inner), None)
    caps = [each for each in heights if each.what.endswith("'s cap")]
    near, known = NEAR * moulds.spec.moulds.layer_mm, [*([total] if total else []), *caps]
    if all(abs(each.printed_mm - each.asked_mm) <= near for each in known):
        return ""
    drawn, printed = [number(each.asked_mm, 3) for each in known], [number(each.printed_mm, 3) for each in known]
    named = f"cap{'s' * (len(caps) > 1)} {join_words(printed[-len(caps) :])}" if caps else ""
    if total is None:
        return f"{named} mm (drawn {join_words(drawn)})"
    return f"{printed[0]} mm high (drawn {drawn[0]}){f', {named}' if named else ''}"


def off_layers(moulds: MouldSet) -> list[Height]:
    """Return those of them that whole layers change."""
    layer = moulds.spec.moulds.layer_mm
    return [each for each in unit_heights(moulds) if abs(each.asked_mm - each.printed_mm) > NEAR * layer]


def film_mm(moulds: MouldSet) -> float:
    """Return by how much the rim of an open ring is printed above its core, mm: silicone closes the ring there."""
    plan, layers, seat = moulds.plan, layers_of(moulds.spec), -moulds.plate[0]
    if not plan.concentric or moulds.dimensions.heights[0] > moulds.dimensions.core_height:
        return 0.0
    core = layers.printed(seat + plan.dimensions.core_height) - layers.printed(seat)
    return max(round(layers.printed(height) - core, 4) for height in plan.dimensions.heights)


@dataclass(frozen=True)
class Miss:
    """A height that comes out wrong, and the sentence that says so and what prints right."""

    height: Height
    said: str


def missed(moulds: MouldSet, paths: Sequence[str] = ()) -> list[Miss]:
    """Return the heights that come out of the printer more than `MOST_ERROR` off, each with a remedy.

    `paths`: of the unit in its file, such as "place.2.unit."; none: that of the set.
    """
    wrong = [each for each in off_layers(moulds) if each.error > MOST_ERROR + 1e-9]
    layer = _better_layer(moulds) if wrong else None
    first, height = (number(each, 3) for each in (moulds.spec.moulds.first_layer_mm, moulds.spec.moulds.layer_mm))
    found = []
    for each in wrong:
        ways = []
        _, _, rest = each.what.partition(" ")
        if rest.endswith("'s cap"):
            number_of = int(rest.partition("'")[0]) - 1
            if cap := _better_cap(moulds, number_of, each):
                at = (f"{path}layers.{number_of}.cap_mm" for path in paths or [moulds.source.path])
                ways.append(f"{join_words(list(at))} = {number(cap, 3)}")
        if layer:
            ways.append(f"moulds.layer_mm = {number(layer, 3)}")
        right = f"; {' or '.join(ways)} would print right" if ways else ""
        said = (
            f"{each.what} comes out {number(each.printed_mm, 3)} mm for {number(each.asked_mm, 3)} "
            f"({number(100 * each.error, 2)} %) in layers of {height} mm, the first of {first} mm{right}"
        )
        found.append(Miss(each, said))
    return found


def height_warnings(moulds: MouldSet, paths: Sequence[str] = ()) -> list[str]:
    """Return a sentence for each height that comes out wrong, and for a film that closes an open ring.

    `paths`: as for `missed`.
    """
    said = [miss.said for miss in missed(moulds, paths)]
    film = film_mm(moulds)
    if film > SHORT:
        layer = number(moulds.spec.moulds.layer_mm, 3)
        said.append(
            f"rims come out {number(film, 2)} mm over the cores, and a film of silicone closes the rings: "
            f"moulds.first_layer_mm = {layer}, and as much in the slicer, or trim the film"
        )
    return said


def _better_cap(moulds: MouldSet, layer: int, height: Height) -> float | None:
    """Return the cap nearest to the spec's that is accepted and comes out right in these layers; None if none does."""
    spec, design, step = moulds.spec, moulds.design, moulds.spec.moulds.layer_mm
    for cap in sorted((height.printed_mm + n * step for n in (-1, 0, 1)), key=lambda cap: abs(cap - height.asked_mm)):
        layers = list(spec.layers)
        layers[layer] = structs.replace(layers[layer], cap_mm=round(cap, 4))
        changed: Spec = structs.replace(spec, layers=tuple(layers))
        dims = design.dimensions(changed)
        try:
            design.limits(changed, dims)
            tools = in_layers(changed, poured(changed, dims))
        except Refusal:
            continue
        made = {each.what: each for each in printed_heights(changed, dims, tools, -moulds.plate[0])}
        if made[height.what].error <= MOST_ERROR:
            return round(cap, 4)
    return None


def _better_layer(moulds: MouldSet) -> float | None:
    """Return the layer height nearest to the spec's with which every height comes out right; None if there is none."""
    printer, now = printer_of(moulds.spec), moulds.spec.moulds.layer_mm
    if not moulds.plan.concentric:
        return None
    most = MOST_OF_NOZZLE * float(printer.nozzle_mm) if printer.nozzle_mm else now
    right = [
        layer
        for layer in LAYER_HEIGHTS
        if layer <= most + 1e-9 and layer != now and _worst(moulds, layer) <= MOST_ERROR
    ]
    return min(right, key=lambda layer: abs(layer - now), default=None)


def _worst(moulds: MouldSet, layer: float) -> float:
    """Return the largest error of a height in other layers, as a share; the base ends whole ones of these."""
    lengths = moulds.spec.moulds
    first = layer if lengths.first_layer_mm == lengths.layer_mm else lengths.first_layer_mm
    changed = structs.replace(moulds.spec, moulds=structs.replace(lengths, layer_mm=layer, first_layer_mm=first))
    layers = layers_of(changed)
    plate, plinth = layers.up(lengths.plate_mm), layers.steps(lengths.plinth_height_mm)
    spec: Spec = structs.replace(
        changed, moulds=structs.replace(changed.moulds, plate_mm=plate, plinth_height_mm=plinth)
    )
    dims = moulds.design.dimensions(spec)
    heights = printed_heights(spec, dims, in_layers(spec, poured(spec, dims)), plate + plinth)
    return max(each.error for each in heights)
