"""The elements of 3MF model parts, and what a part says as plain data: resources, objects, uses of objects."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from unitcad.geometry.arrays import Floats, Ints
from unitcad.meshcheck.findings import Finding, Location
from unitcad.meshcheck.rules.registry import Rule

CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
MATERIAL = "http://schemas.microsoft.com/3dmanufacturing/material/2015/02"
PRODUCTION = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06"
SLICE = "http://schemas.microsoft.com/3dmanufacturing/slice/2015/07"
BEAM = "http://schemas.microsoft.com/3dmanufacturing/beamlattice/2017/02"
BALLS = "http://schemas.microsoft.com/3dmanufacturing/beamlattice/balls/2020/07"
TRIANGLE_SETS = "http://schemas.microsoft.com/3dmanufacturing/trianglesets/2021/07"
BOOLEAN = "http://schemas.3mf.io/3dmanufacturing/booleanoperations/2023/07"
DISPLACEMENT = "http://schemas.3mf.io/3dmanufacturing/displacement/2023/10"
OLD_DISPLACEMENT = "http://schemas.microsoft.com/3dmanufacturing/displacement/2022/07"
ALTERNATIVES = "http://schemas.microsoft.com/3dmanufacturing/production/alternatives/2021/04"
VOLUMETRIC = "http://schemas.3mf.io/3dmanufacturing/volumetric/2022/01"
IMPLICIT = "http://schemas.3mf.io/3dmanufacturing/implicit/2023/12"
# Extensions whose required use does not hinder a check of the meshes of a file. Secure content is not among them: what
# is encrypted cannot be checked.
KNOWN = {CORE, MATERIAL, PRODUCTION, SLICE, BEAM, BALLS, TRIANGLE_SETS, BOOLEAN, DISPLACEMENT}
KNOWN |= {OLD_DISPLACEMENT, ALTERNATIVES, VOLUMETRIC, IMPLICIT}

_LIMIT = 2**31
Test = Callable[[str], object]
"""Whether an attribute's text is of its type, as the 3MF schemas name it, by truth."""


def _pattern(pattern: str) -> Test:
    return re.compile(pattern, re.ASCII).fullmatch


_WORD = re.compile(r"[^ \t\r\n]+")
number = _pattern(r"[ \t\r\n]*[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?[ \t\r\n]*")
boolean = _pattern(r"[ \t\r\n]*(?:true|false|0|1)[ \t\r\n]*")
color = _pattern(r"#(?:[0-9A-Fa-f]{6}|[0-9A-Fa-f]{8})")
part_name = _pattern(r"(?s:/.*)")
text = _pattern(r"(?s:.*)")
_integer = _pattern(r"[ \t\r\n]*\+?\d{1,12}[ \t\r\n]*")


def words(text: str) -> list[str]:
    """Return the words of a text between the blanks that XML knows."""
    return _WORD.findall(text)


def index(text: str) -> bool:
    """Test for ST_ResourceIndex: 0 to 2^31 - 1."""
    return bool(_integer(text)) and int(text) < _LIMIT


def resource_id(text: str) -> bool:
    """Test for ST_ResourceID: 1 to 2^31 - 1."""
    return index(text) and int(text) > 0


def one_of(*values: str) -> Test:
    """Return the test of an enumeration."""
    return lambda text: text in values


def many(test: Test) -> Test:
    """Return the test of a space-separated list, at least one."""
    return lambda text: bool(words(text)) and all(test(part) for part in words(text))


@dataclass(frozen=True)
class ElementSchema:
    """Content of one element; `children` are (name, least, most) in order; `open_`: foreign attributes."""

    required: Mapping[str, Test] = field(default_factory=dict)
    optional: Mapping[str, Test] = field(default_factory=dict)
    children: tuple[tuple[str, int, int], ...] = ()
    ordered: bool = True
    open_: bool = True


_MANY = _LIMIT
_DISPLAY = {"displaypropertiesid": resource_id}
_TILE = one_of("wrap", "mirror", "clamp", "none")
_OBJECT_TYPE = one_of("model", "solidsupport", "support", "surface", "other")


def _core() -> dict[str, ElementSchema]:
    shape = (("metadatagroup", 0, 1), ("mesh", 0, 1), ("components", 0, 1))
    part = {"partnumber": text}
    triangle = {"v1": index, "v2": index, "v3": index}
    props = {"p1": index, "p2": index, "p3": index, "pid": resource_id}
    return {
        "model": ElementSchema(
            {},
            {"unit": text, "requiredextensions": text, "recommendedextensions": text, "thumbnail": part_name},
            (("metadata", 0, _MANY), ("resources", 1, 1), ("build", 1, 1)),
        ),
        "metadata": ElementSchema({"name": text}, {"preserve": boolean, "type": text}),
        "metadatagroup": ElementSchema(children=(("metadata", 1, _MANY),), open_=False),
        "resources": ElementSchema(children=(("basematerials", 0, _MANY), ("object", 0, _MANY)), ordered=False),
        "basematerials": ElementSchema({"id": resource_id}, _DISPLAY, (("base", 1, _MANY),)),
        "base": ElementSchema({"name": text, "displaycolor": color}, _DISPLAY),
        "object": ElementSchema(
            {"id": resource_id},
            {"type": _OBJECT_TYPE, "thumbnail": part_name, "name": text, "pid": resource_id, "pindex": index} | part,
            shape,
        ),
        "mesh": ElementSchema(children=(("vertices", 1, 1), ("triangles", 0, 1)), open_=False),
        "vertices": ElementSchema(children=(("vertex", 0, _MANY),), open_=False),
        "triangles": ElementSchema(children=(("triangle", 0, _MANY),), open_=False),
        "vertex": ElementSchema({"x": text, "y": text, "z": text}),
        "triangle": ElementSchema(triangle, props),
        "components": ElementSchema(children=(("component", 1, _MANY),), open_=False),
        "component": ElementSchema({"objectid": resource_id}, {"transform": text}),
        "build": ElementSchema(children=(("item", 0, _MANY),)),
        "item": ElementSchema({"objectid": resource_id}, {"transform": text} | part, (("metadatagroup", 0, 1),)),
    }


def _material() -> dict[str, ElementSchema]:
    id_ = {"id": resource_id}
    return {
        "colorgroup": ElementSchema(id_, _DISPLAY, (("color", 1, _MANY),)),
        "color": ElementSchema({"color": color}),
        "texture2d": ElementSchema(
            id_ | {"path": part_name, "contenttype": one_of("image/png", "image/jpeg")},
            {"tilestyleu": _TILE, "tilestylev": _TILE, "filter": one_of("auto", "linear", "nearest")},
        ),
        "texture2dgroup": ElementSchema(id_ | {"texid": resource_id}, _DISPLAY, (("tex2coord", 1, _MANY),)),
        "tex2coord": ElementSchema({"u": number, "v": number}),
        "compositematerials": ElementSchema(
            id_ | {"matid": resource_id, "matindices": many(index)}, _DISPLAY, (("composite", 1, _MANY),)
        ),
        "composite": ElementSchema({"values": many(number)}),
        "multiproperties": ElementSchema(
            id_ | {"pids": many(resource_id)},
            _DISPLAY | {"blendmethods": many(one_of("mix", "multiply", "none"))},
            (("multi", 1, _MANY),),
        ),
        "multi": ElementSchema({"pindices": many(index)}),
    }


def _beams() -> dict[str, ElementSchema]:
    clip = {"clippingmode": one_of("none", "inside", "outside"), "clippingmesh": resource_id}
    ball = {"ballmode": text, "ballradius": number}
    shape = clip | ball | {"representationmesh": resource_id, "cap": text, "pid": resource_id, "pindex": index}
    ends = {"r1": number, "r2": number, "p1": index, "p2": index, "pid": resource_id, "cap1": text, "cap2": text}
    sets = {"name": text, "identifier": text, "pid": resource_id, "pindex": index}
    return {
        "beamlattice": ElementSchema(
            {"radius": number, "minlength": number},
            shape | {"precision": number},
            (("beams", 1, 1), ("beamsets", 0, 1)),
        ),
        "beams": ElementSchema(children=(("beam", 0, _MANY),)),
        "beam": ElementSchema({"v1": index, "v2": index}, ends),
        "beamsets": ElementSchema(children=(("beamset", 0, _MANY),)),
        "beamset": ElementSchema({}, sets, (("ref", 0, _MANY),)),
        "ref": ElementSchema({"index": index}),
    }


def _balls() -> dict[str, ElementSchema]:
    return {
        "balls": ElementSchema(children=(("ball", 0, _MANY),)),
        "ball": ElementSchema({"vindex": index}, {"r": number, "p": index, "pid": resource_id}),
        "ballref": ElementSchema({"index": index}),
    }


ELEMENTS: dict[str, dict[str, ElementSchema]] = {
    CORE: _core(),
    MATERIAL: _material(),
    BEAM: _beams(),
    BALLS: _balls(),
}
UNCHECKED = {
    BEAM: "a beam lattice: its indices and radii are checked, its shape is not",
    SLICE: "slices are not checked",
    BALLS: "the balls of a beam lattice: their vertices are checked, their shape is not",
    BOOLEAN: "boolean operations are not checked",
    DISPLACEMENT: "displacement is not checked",
    OLD_DISPLACEMENT: "displacement is not checked",
    VOLUMETRIC: "volumetric content is not checked",
    IMPLICIT: "implicit content is not checked",
}
"""Content that a mesh check does not judge, by namespace."""


LINE = 7  # column of a triangle's line
_NOTED = 200  # findings of one rule and severity kept of one part: a flood of one does not hide another


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
    line: int | None = None


@dataclass(frozen=True)
class Triangles:
    """An object's mesh: vertices (n, 3) and rows (m, 8) of v1 v2 v3 p1 p2 p3 pid line, -1 for what is not there."""

    vertices: Floats
    rows: Ints


@dataclass
class Object(Resource):
    """An object: a mesh or components.

    `beams` (b, 5) are v1, v2, r1, r2 and the line of the beams on the mesh's vertices, `balls` (vertex, line) pairs.
    `beam_sets` and `ball_sets` are indices of beams and balls, `lattice` the attributes of the lattice.
    """

    type: str = "model"
    mesh: Triangles | None = None
    components: list[Use] = field(default_factory=list)
    other_shape: bool = False
    beams: Floats = field(default_factory=lambda: np.empty((0, 5)))
    beam_sets: list[int] = field(default_factory=list)
    balls: list[tuple[int, int]] = field(default_factory=list)
    ball_sets: list[int] = field(default_factory=list)
    lattice: dict[str, str] = field(default_factory=dict)


@dataclass
class Model:
    """Content of a model part."""

    part: str
    unit: str = "millimeter"
    namespaces: dict[str, str] = field(default_factory=dict)
    resources: dict[int, Resource] = field(default_factory=dict)
    items: list[Use] = field(default_factory=list)
    foreign: set[int] = field(default_factory=set)
    findings: list[Finding] = field(default_factory=list)
    has_build: bool = False
    strict: bool = False
    unchecked: dict[str, Location] = field(default_factory=dict)
    where: Callable[[], Location] = Location
    _noted: dict[tuple[str, str | None], int] = field(default_factory=dict)

    def add(self, rule: Rule, message: str, severity: str | None = None, line: int | None = None) -> None:
        """Add a finding about this part, placed by `where`, or at `line`."""
        kind = rule.code, severity
        if self._noted.get(kind, 0) < _NOTED:
            self._noted[kind] = self._noted.get(kind, 0) + 1
            place = replace(self.where(), part=self.part)
            place = place if line is None else replace(place, line=line)
            self.findings.append(rule.finding(message, 1, [place], severity))

    def add_lenient(self, rule: Rule, message: str, otherwise: str = "warning") -> None:
        """Add a finding that real programs' files have: of severity `otherwise` unless the model is checked strictly."""
        self.add(rule, message, None if self.strict else otherwise)

    def objects(self) -> dict[int, Object]:
        """Return the object resources by id."""
        return {id_: resource for id_, resource in self.resources.items() if isinstance(resource, Object)}
