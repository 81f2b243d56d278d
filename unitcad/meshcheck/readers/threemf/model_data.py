"""What a 3MF model part says, as plain data: resources, objects, uses of objects."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace

from unitcad.geometry.arrays import Floats, Ints
from unitcad.meshcheck.findings import Finding, Location
from unitcad.meshcheck.rules.registry import Rule

LINE = 7  # column of a triangle's line
_NOTED = 200  # findings kept of one part


@dataclass
class Resource:
    """A resource by id: its element's name, its rank in the file, its attributes, its members' attributes, its line."""

    kind: str
    id: int
    rank: int
    attributes: dict[str, str]
    members: list[dict[str, str]] = field(default_factory=list)
    line: int | None = None


@dataclass
class Use:
    """A component or build item: the object's id, its part ("" for this one) and its matrix (4 x 3, rows)."""

    object: int
    path: str
    matrix: Floats
    rank: int
    uuid: bool
    line: int | None = None


@dataclass(frozen=True)
class Triangles:
    """An object's mesh: vertices (n, 3) and rows (m, 8) of v1 v2 v3 p1 p2 p3 pid line, -1 for what is not there."""

    vertices: Floats
    rows: Ints


@dataclass
class Object(Resource):
    """An object: a mesh or components."""

    type: str = "model"
    mesh: Triangles | None = None
    components: list[Use] = field(default_factory=list)
    lattice: dict[str, str] | None = None
    beams: list[dict[str, str]] = field(default_factory=list)
    balls: list[dict[str, str]] = field(default_factory=list)
    beam_refs: list[int] = field(default_factory=list)
    other_shape: bool = False


@dataclass
class Model:
    """Content of a model part."""

    part: str
    unit: str = "millimeter"
    namespaces: dict[str, str] = field(default_factory=dict)
    required: list[str] = field(default_factory=list)
    resources: dict[int, Resource] = field(default_factory=dict)
    items: list[Use] = field(default_factory=list)
    foreign: set[int] = field(default_factory=set)
    findings: list[Finding] = field(default_factory=list)
    has_build: bool = False
    build_uuid: bool = False
    strict: bool = False
    where: Callable[[], Location] = Location

    def add(self, rule: Rule, message: str, severity: str | None = None, line: int | None = None) -> None:
        """Add a finding about this part, placed by `where`, or at `line`."""
        if len(self.findings) < _NOTED:
            place = replace(self.where(), part=self.part)
            place = place if line is None else replace(place, line=line)
            self.findings.append(rule.finding(message, 1, [place], severity))

    def add_lenient(self, rule: Rule, message: str) -> None:
        """Add a finding that real programs' files have: a warning unless the model is checked strictly."""
        self.add(rule, message, None if self.strict else "warning")

    def objects(self) -> dict[int, Object]:
        """Return the object resources by id."""
        return {id_: resource for id_, resource in self.resources.items() if isinstance(resource, Object)}
