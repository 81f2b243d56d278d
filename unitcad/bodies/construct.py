"""The construction: the first way of casting a body whose tools keep every mould check.

The core asks for it if moulds by complement are refused or fail a check. The refusal of a body without any way says how
each was tried.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import islice

from manifold3d import Manifold
from msgspec import UNSET

from unitcad.bodies.parted import Impossible, Mould, closed_cups, draw, inside
from unitcad.bodies.search import Way, ways, ways_at
from unitcad.checks import check_geometry, strains
from unitcad.checks.finding import MouldFinding, at_least, at_most
from unitcad.checks.overlap import OF_UNIT
from unitcad.checks.strain import CAPTIVE
from unitcad.designs import design_of
from unitcad.designs.design import Tooling
from unitcad.errors import UNIT_ALONE, Refusal
from unitcad.export.printing import TooThin, print_ready, resolution
from unitcad.kernels.mesh import arrays, bounds, realise, segment_count, thick_pieces
from unitcad.moulds.complement import films
from unitcad.moulds.mould_set import MouldSet, origin_of
from unitcad.moulds.plan import Plan
from unitcad.shape import ProfileError, Shape
from unitcad.shape.tree import Body
from unitcad.spec import Spec

BENCH = "unitcad.bodies.bench"
CLOSED = "as drawn: cups closed above, filled through a gate"
MOST_DRAWN = 8
"""Ways that are drawn and checked before a body is refused."""
MOST_STRETCHED = 100.0
"""Strain of a peel up to which a way is taken, percent: what the stiffest shipped silicones bear with a margin of 3."""
_AS_DRAWN = "as drawn, a cup that lifts off: "
_OF_THE_BODY = ("design", "moulds.pour")
"""Fields of refusals for which another way may help."""
SAID = 4
"""Failed ways that a refusal names."""


def tooling(spec: Spec, cast: Sequence[Shape], first: Tooling | Refusal, planned: Callable[[Tooling], Plan]) -> Tooling:
    """Return the tooling of the first way whose checks hold: moulds by complement, then those of the search.

    `first` is the tooling by complement, or its refusal; `planned` makes a plan of a tooling. Raises Refusal if no way
    can be drawn.
    """
    if len(cast) > 1:
        return _closed(spec, cast, first, planned) if isinstance(first, Refusal) else first
    if design_of(spec).laid_in:
        return _or_raise(first)
    if spec.moulds.parting is not UNSET:
        return _named(spec, cast[0], str(spec.moulds.parting), planned)
    tried = [_AS_DRAWN]
    if isinstance(first, Tooling):
        failed = _failed(spec, planned(first))
        if not failed or any(finding.where.startswith(OF_UNIT) for finding in failed):
            return first
        tried[0] += _said(failed[0])
    elif first.field in _OF_THE_BODY:
        tried[0] += _reason(first)
    else:
        raise first
    _refuse_hollows(spec, cast[0])
    stretchy: Tooling | None = None
    for way, drawn in _drawn(spec, cast[0]):
        if isinstance(drawn, str):
            tried.append(f"{way.said}: {drawn}")
            continue
        made = replace(drawn.tooling, way=way.said, bench=BENCH)
        failed = _failed(spec, planned(made))
        if not failed:
            return made
        tried.append(f"{way.said}: {_said(failed[0])}")
        if not stretchy and all(each.code == "C310" and each.value < CAPTIVE for each in failed):
            stretchy = made
    if stretchy:
        return stretchy  # whether a silicone bears it, C310 says
    if isinstance(first, Tooling):
        return first  # its findings say what is wrong with it
    raise Refusal("design", spec.design, f"no mould was found; tried {'; '.join(tried[:SAID])}{UNIT_ALONE}")


def _named(spec: Spec, body: Shape, parting: str, planned: Callable[[Tooling], Plan]) -> Tooling:
    """Return the tooling of the first way that comes apart at the named plane. Raises Refusal if none does."""
    axis, place = "xyz".index(parting[0]), float(parting[2:])
    box, tried = bounds(realise(body, _segments(spec))), list[str]()
    low, high = box[axis], box[axis + 3]
    if not low < place < high:
        limit = f"the plane misses the body, which reaches from {low:.4g} to {high:.4g} mm"
        raise Refusal("moulds.parting", parting, limit, f"{parting[0]}={(low + high) / 2:.4g}")
    _refuse_hollows(spec, body)
    for way, drawn in _made(spec, body, ways_at(axis, place)):
        if isinstance(drawn, str):
            tried.append(f"{way.said}: {drawn}")
            continue
        made = replace(drawn.tooling, way=way.said, bench=BENCH)
        if not (failed := _failed(spec, planned(made))):
            return made
        tried.append(f"{way.said}: {_said(failed[0])}")
    limit = f"no mould that comes apart there was found; tried {'; '.join(tried[:SAID])}; leave it out to search"
    raise Refusal("moulds.parting", parting, limit)


def _segments(spec: Spec) -> int:
    return segment_count(spec.diameter_mm / 2, spec.output.tolerance_mm)


def _closed(spec: Spec, cast: Sequence[Shape], first: Refusal, planned: Callable[[Tooling], Plan]) -> Tooling:
    """Return the tooling of several pours in closed cups. Raises the first refusal if that does not help either."""
    if first.field not in _OF_THE_BODY:
        raise first
    try:
        made = replace(closed_cups(spec, cast), way=CLOSED, bench=BENCH)
        failed = _failed(spec, planned(made))
        if not failed:
            return made
        why = _said(failed[0])
    except (Impossible, ProfileError) as error:
        why = str(error)
    except Refusal as refusal:
        why = _reason(refusal)
    if why == _reason(first):
        raise first
    limit = f"{first.limit.removesuffix(UNIT_ALONE)}; with closed cups: {why}{UNIT_ALONE}"
    raise Refusal(first.field, first.value, limit, first.nearest)


def _or_raise(first: Tooling | Refusal) -> Tooling:
    if isinstance(first, Refusal):
        raise first
    return first


def _refuse_hollows(spec: Spec, body: Shape) -> None:
    """Raise Refusal for a hollow that is closed all round: no mould forms it, whichever way it comes apart."""
    solid = realise(body, _segments(spec))
    x0, y0, z0, x1, y1, z1 = bounds(solid)
    block = Manifold.cube((x1 - x0 + 2, y1 - y0 + 2, z1 - z0 + 2)).translate((x0 - 1, y0 - 1, z0 - 1))
    _, *hollows = sorted(thick_pieces(block - solid, films(spec)), key=lambda piece: -bounds(piece)[3])
    for hollow in hollows:
        x, y, z = (round(v, 2) + 0.0 for v in inside(hollow))
        why = f"a hollow of {hollow.volume():.3g} mm3 at x = {x:g}, y = {y:g}, z = {z:g} mm is closed all round"
        limit = f"{why}: no mould forms it; open it, or draw it as two layers with an insert between them{UNIT_ALONE}"
        raise Refusal("design", spec.design, limit)


def _drawn(spec: Spec, body: Shape) -> Iterator[tuple[Way, Mould | str]]:
    """Yield the ways in the order of the search, drawn, or the reason why one can't be."""
    yield from _made(spec, body, islice(ways(*arrays(realise(body, _segments(spec)))), MOST_DRAWN))


def _made(spec: Spec, body: Shape, tried: Iterable[Way]) -> Iterator[tuple[Way, Mould | str]]:
    """Yield ways, each with its mould, or the reason why it can't be drawn."""
    for way in tried:
        try:
            yield way, draw(spec, body, way)
        except Impossible as error:
            yield way, str(error)
        except ProfileError as error:
            yield way, f"its tools can't be drawn: a part {error}"
        except Refusal as refusal:
            yield way, _reason(refusal)


def _failed(spec: Spec, plan: Plan) -> list[MouldFinding]:
    """Return the findings against a plan: of the checks of geometry, since variants in silicone share their tools."""
    moulds = MouldSet(spec, origin=replace(origin_of(spec), plan=lambda: plan))
    if failed := [finding for finding in check_geometry(moulds) if not finding.ok]:
        return failed
    wide = (at_most("C310", strain.where, strain.percent, MOST_STRETCHED, "%") for strain in strains(moulds))
    failed = [finding for finding in wide if not finding.ok]
    return failed or [finding for piece in plan.pieces if (finding := _too_thin(moulds, piece))]


def _too_thin(moulds: MouldSet, piece: Body) -> MouldFinding | None:
    """Return a finding if no mesh file can hold a piece: the mould has no thickness somewhere."""
    try:
        print_ready(*arrays(moulds.mesh(piece)))
    except TooThin as error:
        return at_least("C240", f"{piece.name}: {error}", 0.0, resolution(arrays(moulds.mesh(piece))[0]), "mm")
    return None


def _said(finding: MouldFinding) -> str:
    value = f"{finding.value:.3g} {finding.unit}".rstrip()
    return f"{finding.code} {finding.where}, {value} against {finding.limit:.3g}"


def _reason(refusal: Refusal) -> str:
    text = refusal.limit.removesuffix(UNIT_ALONE)
    return text.partition("can't be cast: ")[2] or text
