"""Faces that cross, touch or cover each other: G001, G003, G004, G008 and G009."""

from __future__ import annotations

from collections.abc import Iterator

from unitcad.check import overlap
from unitcad.check.findings import Finding
from unitcad.check.rules.inspection import Inspection
from unitcad.check.rules.rule import Rule

G001 = Rule(
    "G001",
    "error",
    "self-crossing",
    cause=(
        "Two faces pass through each other. Decided exactly: touching is not crossing. In a 3MF file a warning, "
        "since the core specification (4.1) says what is solid."
    ),
    example="A bolt passes through a wall and is not united with it.",
    fix="Unite the bodies with a boolean, or move the surfaces apart.",
)

G003 = Rule(
    "G003",
    "warning",
    "shells touch",
    cause=(
        "Two shells meet in a point, line or face and do not pass through each other there. What they share is a "
        "millionth of the smaller one at most; if it is more, G002 says so too. Rounding decides whether they "
        "print as one."
    ),
    example="The tip of a cone meets the top of a box.",
    fix="Overlap them and unite, or leave a gap.",
)

G004 = Rule(
    "G004",
    "warning",
    "coplanar overlap",
    cause="Two faces lie in one plane and cover each other in part.",
    example="A box stands on a larger one: its underside covers a part of the other's top.",
    fix="Unite the bodies with a boolean.",
)

G008 = Rule(
    "G008",
    "error",
    "shell overlaps itself",
    cause=(
        "A shell passes through itself along edges that four or more of its faces share, or two of its faces "
        "cover each other in one plane and look the same way: its winding number takes another value than 0 and "
        "1, such as 2 in the middle of a pentagram or -1 in one half of a bow tie. In a 3MF file a warning, since "
        "the core specification (4.1) says what is solid."
    ),
    example="A prism stands on a pentagram that is drawn in one stroke.",
    fix="Unite the body with itself by a boolean, or correct the outline that it was made from.",
)

G009 = Rule(
    "G009",
    "error",
    "wall or gap without thickness",
    cause=(
        "Two faces cover each other in one plane and look opposite ways, and they do not belong to two solids "
        "that lie side by side: a fin, a fold, a crack, or a cavity that reaches the surface. Also where two "
        "neighbours fold onto each other to within two float32 steps."
    ),
    example="A fin is drawn as one surface and exported with both of its sides.",
    fix="Give the wall or the gap a thickness, or remove both faces.",
)


def check_mesh(part: Inspection) -> Iterator[Finding]:
    """Apply the rules to all pairs of faces, then along the edges."""
    yield from part.crossings.findings
    yield from overlap.judge(part.topology)
