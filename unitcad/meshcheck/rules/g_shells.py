"""Shells against each other: inversion (T008), overlap (G002), cavities (G006), zero volume (G007), specks (G010)."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from unitcad.geometry.arrays import Bools, Floats
from unitcad.meshcheck.findings import Finding, Location, counted, number, point, tally
from unitcad.meshcheck.geometry.predicates import without_area
from unitcad.meshcheck.geometry.resolution import Resolution
from unitcad.meshcheck.geometry.topology import Topology, diagonals
from unitcad.meshcheck.rules.inspection import Inspection, at_region
from unitcad.meshcheck.rules.registry import Rule
from unitcad.meshcheck.rules.severity import by_layers

G002 = Rule("""
    G002 error: shells overlap
    Two shells share volume: they pass through each other, or one faces outwards inside the other. Fill rules decide
    what is solid, and they differ between slicers. A warning, unless --strict is given, if a printer cannot show it, as
    in G001. In a 3MF file a warning, since the core specification (4.1) says what is solid. The solids of a STEP file
    are compared by meshes of them.
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
    Information if it is a slit, thinner than 0.2 mm on average: designers use slits to add perimeters.
    Example: A box has a bubble inside.
    Fix: Open it, or fill it.
""")

G007 = Rule("""
    G007 error: volume about zero
    A shell encloses less than a millionth of its area times its diagonal: a sheet without thickness. Faces without an
    area are T010 alone. A warning, unless --strict is given, if the sheet is narrower than 0.2 mm on average and other
    shells have a volume.
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

BODY = 1.0  # G010, mm; the size of a body beside which a speck is one


def check_mesh(part: Inspection) -> Iterator[Finding]:
    """Apply the rules but for G005, for which a number must be expected."""
    topology, n = part.topology, part.topology.n_shells
    volumes, low, high = topology.volumes, topology.low, topology.high
    if n == 0:
        yield G007.finding("no face has an area")
    if not topology.closed.any():
        return
    nesting = part.nesting
    which = np.flatnonzero(nesting.flat & ~_without_area(topology, nesting.flat))
    if len(which):
        worst = which[np.argmax(nesting.area[which])]
        text = f"volume {number(volumes[worst], 3)} mm3 over {number(nesting.area[worst], 3)} mm2 of surface"
        across = diagonals(low[which], high[which])
        lost = nesting.flat.all() or (nesting.area[which] / 2 >= topology.resolution.feature * across).any()
        severity = None if lost or part.strict else "warning"
        yield G007.finding(text, len(which), (_where(topology, i) for i in which.tolist()), severity)
    sound = nesting.sound
    yield from specks(low, high, sound & (volumes > 0))
    pairs = nesting.overlaps
    text = f"{tally(len(pairs), 'pair')} of shells that share volume"
    yield from by_layers(part, G002, text, len(pairs), (_where(topology, *pair) for pair in pairs))
    if nesting.stopped is not None:
        raise nesting.stopped
    inwards = sound & (volumes < 0)
    for rule, which, one, many in (
        (T008, np.flatnonzero(inwards & (nesting.depth % 2 == 0)), "inverted shell", ""),
        (G006, np.flatnonzero(inwards & (nesting.depth % 2 == 1)), "closed cavity", "closed cavities"),
    ):
        if len(which) and not (rule is T008 and n == 1 and part.crossings.crossed):
            places = (_where(topology, i) for i in which.tolist())
            thick = 2 * -volumes[which] / nesting.area[which]
            shows = rule is T008 or (thick >= topology.resolution.feature).any()
            yield rule.finding(tally(len(which), one, many), len(which), places, None if shows else "info")


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
    tiny = np.flatnonzero(asked & (side < Resolution().thin))
    if not len(tiny) or side.max() < BODY:
        return []
    places = [Location(xyz=point(middle)) for middle in (low[tiny] + high[tiny]) / 2]
    text = f"{tally(len(tiny), 'speck')}, the largest {number(side[tiny].max(), 3)} mm across"
    return [G010.finding(text, len(tiny), places)]


def _where(topology: Topology, *shells: int) -> Location:
    """Return the middle of what the boxes of the shells have in common, with all faces of the shells."""
    which = list(shells)
    middle = (topology.low[which].max(axis=0) + topology.high[which].min(axis=0)) / 2
    return at_region(topology.kept[np.isin(topology.shells, which)], middle)
