"""Shells against each other: inversion (T008), overlap (G002), cavities (G006), zero volume (G007), specks (G010)."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from manifold3d import Manifold

from unitcad.geometry.arrays import Bools, Floats, Ints, among, group_labels
from unitcad.geometry.boxes import Interrupted, Tick, TooMany, box_pairs
from unitcad.meshcheck.findings import Finding, Location, counted, number, point
from unitcad.meshcheck.geometry.mesh import solid_of
from unitcad.meshcheck.geometry.predicates import without_area
from unitcad.meshcheck.geometry.rays import winding_numbers
from unitcad.meshcheck.geometry.topology import Topology, diagonals
from unitcad.meshcheck.rules.inspection import Inspection, at_region
from unitcad.meshcheck.rules.registry import Rule

G002 = Rule("""
    G002 error: shells overlap
    Two shells share volume: one faces outwards inside the other, or where their faces meet, they share more than a
    millionth of the smaller one. Fill rules decide what is solid, and they differ between slicers. A warning, unless
    --strict is given, if the part that they share is less than 0.02 mm thick. In a 3MF file a warning, since the core
    specification (4.1) says what is solid. The solids of a STEP file are compared by meshes of them.
    Example: A box lies inside a larger one, and both face outwards.
    Fix: Unite the bodies with a boolean.
""")

G005 = Rule("""
    G005 warning: shell count other than expected
    The file has more or fewer shells than --shells or the manifest says: a loose chip, or a lost piece.
    Example: `--shells 1` for a file that holds a part and a chip beside it.
    Fix: Look for loose pieces.
""")

G006 = Rule("""
    G006 warning: closed cavity
    A shell lies inside another one and faces inwards: a hollow with no way in or out. Resin and support stay inside.
    Example: A box has a bubble inside.
    Fix: Open it, or fill it.
""")

G007 = Rule("""
    G007 error: volume about zero
    A shell encloses less than a millionth of its area times its diagonal: a sheet without thickness. Faces without an
    area are T010 alone.
    Example: A sheet is drawn as two faces back to back.
    Fix: Give it thickness.
""")

G010 = Rule("""
    G010 warning: speck
    A closed shell or an instance is less than 0.02 mm across, a tenth of the least feature of the finest printer in the
    catalogue, beside a body of 1 mm or more: what a boolean or a scan left over. No printer makes it, and it counts as
    a shell.
    Example: A closed shell of 0.005 mm lies beside a bracket of 40 mm.
    Fix: Delete it.
""")

T008 = Rule("""
    T008 error: inverted shell
    An outermost shell encloses a negative volume: all its faces point inwards.
    Example: All faces of a box are flipped.
    Fix: Flip the normals.
""")

FLAT = 1e-6  # G007: a shell's volume over its area times its diagonal
SPECK = 0.02  # G010, mm; a tenth of the least feature of the finest printer in the catalogue
BODY = 1.0  # G010, mm; the size of a body beside which a speck is one
_BOOLEANS = 100_000  # pairs of shells
_SHARE = 1e-6  # of the smaller shell's volume: shells that share no more only touch


def check_mesh(part: Inspection) -> Iterator[Finding]:
    """Apply the rules but for G005, for which a number must be expected."""
    topology, crossings = part.topology, part.crossings
    labels, n = topology.shells, topology.n_shells
    volumes, low, high, sound = topology.volumes, topology.low, topology.high, topology.closed
    if n == 0:
        yield G007.finding("no face has an area")
    if not sound.any():
        return
    area = np.bincount(labels, np.sqrt(np.einsum("ij,ij->i", topology.areas, topology.areas)), n) / 2
    flat = np.abs(volumes) <= FLAT * area * diagonals(low, high)
    which = np.flatnonzero(sound & flat & ~_without_area(topology, sound & flat))
    if len(which):
        worst = which[np.argmax(area[which])]
        text = f"volume {number(volumes[worst], 3)} mm3 over {number(area[worst], 3)} mm2 of surface"
        yield G007.finding(text, len(which), (_where(topology, i) for i in which.tolist()))
    sound = sound & ~flat
    yield from specks(low, high, sound & (volumes > 0))
    depth, overlaps = np.zeros(n, int), dict[tuple[int, int], float]()
    try:
        if crossings.contact.full:
            raise TooMany(crossings.contact.most, "shells")
        if n > 1:
            meeting = box_pairs(low, high, part.tick)
            _relate(topology, np.asarray(sound), meeting, crossings.touching(), depth, overlaps, part.tick)
    except Interrupted:
        yield from _overlapping(part, overlaps)
        raise
    overlaps |= {(i, i): math.inf for i in np.flatnonzero(sound & (depth % 2 == 1) & (volumes > 0)).tolist()}
    yield from _overlapping(part, overlaps)
    inwards = sound & (volumes < 0)
    for rule, which, one, many in (
        (T008, np.flatnonzero(inwards & (depth % 2 == 0)), "inverted shell", ""),
        (G006, np.flatnonzero(inwards & (depth % 2 == 1)), "closed cavity", "closed cavities"),
    ):
        if len(which) and not (rule is T008 and n == 1 and crossings.crossed):
            places = (_where(topology, i) for i in which.tolist())
            yield rule.finding(counted(len(which), one, many), len(which), places)


def _without_area(topology: Topology, asked: Bools) -> Bools:
    """Return which shells of those `asked` have faces without area only (T010); none if no shell has any other."""
    some = np.flatnonzero(asked.take(topology.shells))
    shells = topology.shells[some]
    flat = without_area(topology.mesh.vertices[topology.mesh.faces[some]])
    found = asked & (np.bincount(shells[~flat], minlength=len(asked)) == 0)
    return found & ~found.all()


def expected(there: int | None, wanted: int | None, word: str = "shell") -> Iterator[Finding]:
    """Apply G005 where a number of shells is `wanted`, and the file has another one."""
    if wanted is not None and there is not None and there != wanted:
        yield G005.finding(f"{counted(there, word)}, {wanted} expected", abs(there - wanted))


def specks(low: Floats, high: Floats, asked: Bools) -> list[Finding]:
    """Apply G010 to the bodies `asked` of those with these boxes, (n, 3) mm, where one of them is large."""
    side = (high - low).max(axis=1, initial=0)
    tiny = np.flatnonzero(asked & (side < SPECK))
    if not len(tiny) or side.max() < BODY:
        return []
    places = [Location(xyz=point(middle)) for middle in (low[tiny] + high[tiny]) / 2]
    text = f"{counted(len(tiny), 'speck')}, the largest {number(side[tiny].max(), 3)} mm across"
    return [G010.finding(text, len(tiny), places)]


def _overlapping(part: Inspection, overlaps: dict[tuple[int, int], float]) -> Iterator[Finding]:
    """Apply G002 to pairs of shells by the mean thickness of what they share, mm; infinity if that is not shallow."""
    for shallow in (False, True):
        pairs = {pair: depth for pair, depth in overlaps.items() if math.isfinite(depth) == shallow}
        if not pairs:
            continue
        text, severity = f"{counted(len(pairs), 'pair')} of shells that share volume", None
        if shallow:
            text += f", {max(pairs.values()):.2g} mm deep at most"
            severity = None if part.strict else "warning"
        yield G002.finding(text, len(pairs), (_where(part.topology, *pair) for pair in pairs), severity)


def _relate(
    topology: Topology,
    sound: Bools,
    pairs: Ints,
    touching: Ints,
    depth: Ints,
    overlaps: dict[tuple[int, int], float],
    tick: Tick,
) -> None:
    """Add to `depth` how many sound shells each one lies in, and to `overlaps` the pairs that touch and share volume.

    `pairs` are those whose boxes meet, sorted. Shells that touch are given to manifold3d, unless their boxes have too
    little room in common.
    """
    vertices, faces, volumes = topology.mesh.vertices, topology.mesh.faces, topology.volumes
    n = topology.n_shells
    one, other = np.ascontiguousarray(pairs.T)
    both = sound.take(one) & sound.take(other)
    pairs, one, other = pairs[both], one[both], other[both]
    touch = among(one * n + other, touching[:, 0].astype(np.int64) * n + touching[:, 1])
    order, first, count = group_labels(topology.shells, n)
    by_shell = faces[order]
    low, high = topology.low, topology.high
    room = (np.minimum(high[one], high[other]) - np.maximum(low[one], low[other])).prod(axis=1)
    inside = ((low[one] >= low[other]) & (high[one] <= high[other])).all(axis=1)
    outside = ((low[one] <= low[other]) & (high[one] >= high[other])).all(axis=1)
    size = np.abs(volumes)
    least = np.minimum(size.take(one), size.take(other))
    close = np.flatnonzero(touch & (room > _SHARE * least))
    if len(close) > _BOOLEANS:
        raise TooMany(_BOOLEANS, "shells")
    solids: dict[int, Manifold] = {}
    before = -1
    for at in close.tolist():
        tick()
        a, b = pairs[at].tolist()
        if a != before:  # pairs are sorted: what comes before it comes no more
            before, solids = a, {i: solid for i, solid in solids.items() if i >= a}
        for i in (a, b):
            if i not in solids:
                own = by_shell[first[i] : first[i] + count[i]]
                used, local = np.unique(own[:, :: -1 if volumes[i] < 0 else 1], return_inverse=True)
                solids[i] = solid_of(vertices[used], local.reshape(-1, 3))  # without volume if manifold3d refuses it
        common, thickness = _shared(solids[a], solids[b])
        if volumes[a] * volumes[b] > 0 and common > _SHARE * least[at]:
            overlaps[(a, b)] = thickness if thickness < SPECK and common < least[at] / 2 else math.inf
        elif common > (1 - _SHARE) * least[at]:  # a cavity that touches the wall
            depth[a if abs(volumes[a]) < abs(volumes[b]) else b] += 1
    for inner, outer, within in ((one, other, inside), (other, one, outside)):
        some = np.flatnonzero(within & ~touch)
        shell, around = inner[some], outer[some]
        points = vertices[by_shell[first[shell], 0]]
        depth += np.bincount(
            shell[winding_numbers(vertices, by_shell, first[around], count[around], points, tick) != 0], minlength=n
        )


def _where(topology: Topology, *shells: int) -> Location:
    """Return the middle of what the boxes of the shells have in common, with all faces of the shells."""
    which = list(shells)
    middle = (topology.low[which].max(axis=0) + topology.high[which].min(axis=0)) / 2
    return at_region(topology.kept[np.isin(topology.shells, which)], middle)


def _shared(one: Manifold, other: Manifold) -> tuple[float, float]:
    """Return the volume that two solids share, mm3, and its mean thickness, mm."""
    common = one ^ other
    volume = common.volume()
    return volume, 2 * volume / max(common.surface_area(), 1e-300)
