"""The severity of crossings, overlaps and folds: whether a printer would show them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

from unitcad.meshcheck.findings import Finding, Location, drawn_meshes, number
from unitcad.meshcheck.geometry.disputed import Disputed
from unitcad.meshcheck.rules.inspection import Inspection
from unitcad.meshcheck.rules.registry import Rule


def by_layers(part: Inspection, rule: Rule, text: str, n: int, places: Iterable[Location]) -> Iterator[Finding]:
    """Yield a finding about `n` places whose severity is that of the space that fill rules treat differently.

    None if there are no places, or if there is no such space beyond rounding.
    """
    if not n or not (part.disputed.thick or part.disputed.shows or part.strict):
        return
    severity = (
        None if part.disputed.shows or part.strict else _small(part.disputed.thick, part.topology.resolution.digit)
    )
    yield rule.finding(
        f"{text}{in_layers(part.disputed, part.topology.resolution.unit)}",
        n,
        _with_layer(places, part.disputed),
        severity,
    )


def _small(size: float, least: float) -> str:
    return "warning" if size >= least else "info"


def in_layers(disputed: Disputed, unit: float) -> str:
    """Say how far fill rules differ, and where; `unit`: of the file, m if it was probably drawn in metres."""
    layer, metres = disputed.layer, ", read in metres" if unit != 1.0 else ""
    if not disputed.shows:
        return f", {number(disputed.thick / unit, 2)} mm deep at most{metres}"
    if layer is None:
        return ""
    place = f"{'xyz'[layer.axis]} = {number(layer.height, 4)}"
    return f"; layers differ by up to {number(disputed.area / unit**2, 2)} mm2 between fill rules{metres}, worst at {place}"


def _with_layer(places: Iterable[Location], disputed: Disputed) -> Iterator[Location]:
    """Return the places, the first with the worst layer where findings are drawn."""
    for i, place in enumerate(places):
        yield replace(place, layer=disputed.layer) if i == 0 and drawn_meshes() is not None else place


def by_width(
    part: Inspection, rule: Rule, text: str, n: int, places: Iterable[Location], least: str | None = None
) -> Iterator[Finding]:
    """Yield a finding about `n` places without thickness: an error if a printer loses a wall there, `least` at least.

    None if there are no places, or if they are no wider than rounding.
    """
    if not n:
        return
    sheets = part.sheets
    if not (sheets.wide or sheets.wall or part.strict):
        return
    fate = "" if sheets.wall else "; slicers fill it" if sheets.gap else f", {number(sheets.wide, 2)} mm wide at most"
    severity = None if sheets.wall or part.strict else least or _small(sheets.wide, part.topology.resolution.thin)
    yield rule.finding(f"{text}{fate}", n, places, severity)
