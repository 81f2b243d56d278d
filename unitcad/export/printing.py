"""A body for a printer's file: as printed on the bed, in the single precision that STL and slicers have, and as STL.

3MF core: one model part with mm, names and colours, the parts side by side on the bed.

Written after the 3MF Core Specification 1.3 (https://github.com/3MFConsortium/spec_core).
"""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import manifold3d
import numpy as np

from unitcad.errors import UnitcadError
from unitcad.geometry.arrays import unique_rows
from unitcad.text import xml_attribute, xml_text

ROUNDS = 6
_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


class TooThin(UnitcadError):
    """A mesh that single precision can't represent: `fault`, and the point `at` (mm) in the frame of the mesh."""

    def __init__(self, fault: str, at: np.ndarray) -> None:
        self.fault, self.at = fault, at
        x, y, z = (round(float(value), 3) + 0.0 for value in at)
        super().__init__(f"{fault}, at x = {x:g}, y = {y:g}, z = {z:g} mm")


def print_ready(vertices: np.ndarray, faces: np.ndarray, upside_down: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Lay a closed mesh (vertices (n, 3) mm, faces (m, 3)) on the bed, rounded to single precision, still closed.

    Returns float32 vertices and faces in a canonical order (vertices sorted, each face from its least vertex, faces
    sorted), every face thicker than single precision resolves at this size. Raises TooThin if that is not
    possible.
    """
    laid = lay_down(vertices, upside_down)
    try:
        return single_precision(laid, faces)
    except TooThin as error:
        nearest = int(np.linalg.norm(laid - error.at, axis=1).argmin())
        raise TooThin(error.fault, vertices[nearest]) from None


def lay_down(vertices: np.ndarray, upside_down: bool) -> np.ndarray:
    """Return vertices (n, 3) in print attitude: turned by 180 degrees about x if `upside_down`, standing on z = 0."""
    turned = vertices * ((1.0, -1.0, -1.0) if upside_down else (1.0, 1.0, 1.0))
    return turned - (0.0, 0.0, turned[:, 2].min())


def resolution(vertices: np.ndarray) -> float:
    """Return the spacing of single precision numbers at the largest coordinate of `vertices` (mm)."""
    return float(np.spacing(np.float32(np.abs(vertices).max())))


def single_precision(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Round a closed mesh to float32 without a crack: see `print_ready`.

    Rounding alone turns slivers of a boolean into faces without area. So details thinner than a few roundings are
    simplified away first, by manifold3d (which keeps the mesh closed), with a growing limit until the rounded mesh is
    sound. The surface moves by less than 4 ** ROUNDS times the resolution in the worst case, 4 times it in the usual
    one.
    """
    solid = manifold3d.Manifold(
        manifold3d.Mesh64(np.array(vertices, np.float64, order="C"), np.array(faces, np.uint64, order="C"))
    )
    step = resolution(vertices)
    for power in range(1, ROUNDS + 1):
        mesh = solid.simplify(step * 4**power).to_mesh64()
        rounded = _to_float32(np.asarray(mesh.vert_properties[:, :3]), np.asarray(mesh.tri_verts, dtype=np.int64))
        if len(rounded[1]) and _is_closed(rounded[1]) and _thinnest(*rounded) > step:
            return rounded
    found, faces = rounded
    why = "the mesh can't be rounded to single precision: "
    if len(faces) and not _is_closed(faces):
        raise TooThin(f"{why}parts of it touch along an edge only", _open_edge(found, faces))
    place = found[faces[_altitudes(found, faces).argmin(), 0]] if len(faces) else vertices[0]
    raise TooThin(f"{why}two faces are nearer than {step:.2g} mm", place)


def _to_float32(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the mesh in float32: equal vertices merged, collapsed faces dropped, in canonical order."""
    # Adding zero turns -0.0 into 0.0, which would otherwise be another vertex in the bytes.
    merged, index = unique_rows(vertices.astype(np.float32) + np.float32(0))
    faces = index[faces]
    a, b, c = faces.T
    faces = faces[(a != b) & (b != c) & (c != a)]
    least = faces.argmin(axis=1)
    faces = np.take_along_axis(faces, (least[:, None] + np.arange(3)) % 3, axis=1)
    return merged, faces[np.lexsort(faces.T[::-1])]


def _is_closed(faces: np.ndarray) -> bool:
    """Tell whether every edge is used once in each direction, so that the mesh is closed, oriented, manifold."""
    start, end = faces.ravel(), np.roll(faces, -1, axis=1).ravel()
    count = int(faces.max()) + 1
    forward = np.sort(start * count + end)
    return bool(np.all(np.diff(forward) > 0) and np.array_equal(forward, np.sort(end * count + start)))


def _open_edge(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return the first corner of an edge that is not used once in each direction."""
    edges = np.stack([faces.ravel(), np.roll(faces, -1, axis=1).ravel()], axis=1)
    used, times = np.unique(np.concatenate([edges, edges[:, ::-1]]), axis=0, return_counts=True)
    return vertices[used[times != 2][0, 0]]


def _thinnest(vertices: np.ndarray, faces: np.ndarray) -> float:
    """Return the least altitude of any face (mm)."""
    return float(_altitudes(vertices, faces).min())


def _altitudes(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return the least altitude of each face (mm)."""
    corners = vertices.astype(np.float64)[faces]
    edges = corners[:, (1, 2, 0)] - corners
    doubled_area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1)
    return doubled_area / np.linalg.norm(edges, axis=2).max(axis=1)


def stl(vertices: np.ndarray, faces: np.ndarray, name: str) -> bytes:
    """Return the bytes of a binary STL with a mesh: vertices (n, 3) in mm, faces (m, 3). The format has no unit.

    `print_ready` makes a mesh that survives the rounding. The header names the part. It never starts
    with "solid", by which some readers take a file for the ASCII kind.
    """
    corners = np.asarray(vertices, dtype=np.float32)[faces]
    edges = corners[:, 1:].astype(np.float64) - corners[:, :1]
    normals = np.cross(edges[:, 0], edges[:, 1])
    facets = np.zeros(len(faces), dtype=_FACET)
    facets["normal"] = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    facets["corners"] = corners
    header = f"unitcad, mm: {name}".encode("ascii", "replace")[:80].ljust(80)
    return header + len(faces).to_bytes(4, "little") + facets.tobytes()


GAP_MM = 5.0
_CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
_SLIC3R = "http://schemas.slic3r.org/3mf/2017/06"
_SETTINGS = "Metadata/Slic3r_PE_model.config"

_CONTENT_TYPES = """<?xml version="1.0" encoding="UTF-8"?>
<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">
 <Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>
 <Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>
 <Default Extension="config" ContentType="application/xml"/>
</Types>
"""
_RELATIONSHIPS = """<?xml version="1.0" encoding="UTF-8"?>
<Relationships xmlns="http://schemas.openxmlformats.org/package/2006/relationships">
 <Relationship Target="/3D/3dmodel.model" Id="rel0" Type="http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"/>
</Relationships>
"""


@dataclass(frozen=True)
class MeshPart:
    """A named mesh in print attitude: vertices (n, 3) float32 in mm, faces (m, 3), colour as three numbers 0 to 1.

    `copies`: the names of several that are alike; the mesh is in the file once, and each has an item of the build, its
    name as part number.
    """

    name: str
    colour: tuple[float, float, float]
    vertices: np.ndarray
    faces: np.ndarray
    copies: tuple[str, ...] = ()


def content(
    parts: Sequence[MeshPart],
    bed_mm: tuple[float, float] = (220.0, 220.0),
    settings: Mapping[str, str] = MappingProxyType({}),
    description: str = "",
) -> bytes:
    """Return the bytes of a package with `parts` in their order, in rows along x within the bed's width, GAP_MM apart.

    `settings` of each part, by PrusaSlicer's names, are in its own file of object settings: the user's printer and
    filament stay as they are. `description` has them in words for other programs. Dates, order and compression are
    fixed.
    """
    entries = {
        "[Content_Types].xml": _CONTENT_TYPES,
        "_rels/.rels": _RELATIONSHIPS,
        "3D/3dmodel.model": _model(parts, bed_mm, settings, description),
    }
    if settings:
        entries[_SETTINGS] = _object_settings(parts, settings)
    package = io.BytesIO()
    with zipfile.ZipFile(package, "w") as archive:
        for name, text in entries.items():
            entry = zipfile.ZipInfo(name, date_time=(1980, 1, 1, 0, 0, 0))
            entry.create_system = 3
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, text.encode(), compresslevel=6)
    return package.getvalue()


def layout(footprints: Sequence[tuple[float, float]], bed_mm: tuple[float, float]) -> list[tuple[float, float]]:
    """Return the place of each footprint's (x, y) lower left corner (mm), about the bed's middle.

    In rows along x, a new one at the end of the bed's width. Pieces that do not fit run over its far edges; nothing
    overlaps.
    """
    corners: list[tuple[float, float]] = []
    x = y = row_depth = reach = 0.0
    for width, depth in footprints:
        if x > 0 and x + width > bed_mm[0]:
            x, y, row_depth = 0.0, y + row_depth + GAP_MM, 0.0
        corners.append((x, y))
        reach, row_depth = max(reach, x + width), max(row_depth, depth)
        x += width + GAP_MM
    dx, dy = max(0.0, (bed_mm[0] - reach) / 2), max(0.0, (bed_mm[1] - y - row_depth) / 2)
    return [(x + dx, y + dy) for x, y in corners]


def colour_hex(colour: tuple[float, float, float]) -> str:
    """Return #RRGGBB of three numbers 0 to 1."""
    return "#" + "".join(f"{round(channel * 255):02X}" for channel in colour)


def _object_settings(parts: Sequence[MeshPart], settings: Mapping[str, str]) -> str:
    """Write PrusaSlicer's settings of each object. It wants the range of facets of the one volume in each."""
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', "<config>"]
    for index, part in enumerate(parts):
        lines.append(f'<object id="{index + 2}" instances_count="{len(part.copies) or 1}">')
        for key, value in {"name": part.name, **settings}.items():
            lines.append(f'<metadata type="object" key="{key}" value={xml_attribute(value)}/>')
        lines.append(f'<volume firstid="0" lastid="{len(part.faces) - 1}">')
        lines += [f'<metadata type="volume" key="name" value={xml_attribute(part.name)}/>', "</volume>", "</object>"]
    return "\n".join([*lines, "</config>", ""])


def _model(
    parts: Sequence[MeshPart], bed_mm: tuple[float, float], settings: Mapping[str, str], description: str
) -> str:
    low = [part.vertices.min(axis=0).astype(float) for part in parts]
    size = [part.vertices.max(axis=0).astype(float) - least for part, least in zip(parts, low, strict=True)]
    built = [(index, copy) for index, part in enumerate(parts) for copy in part.copies or ("",)]
    places = layout([(float(size[index][0]), float(size[index][1])) for index, _ in built], bed_mm)
    vendor = f' xmlns:slic3rpe="{_SLIC3R}"' if settings else ""
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        f'<model unit="millimeter" xml:lang="en-US" xmlns="{_CORE}"{vendor}>',
        '<metadata name="Application">unitcad</metadata>',
        # Without it PrusaSlicer makes an object of each copy, and gives only the first one its settings.
        *(['<metadata name="slic3rpe:Version3mf">1</metadata>'] if settings else []),
        *([f'<metadata name="Description">{xml_text(description)}</metadata>'] if description else []),
        "<resources>",
        '<basematerials id="1">',
        *(
            f"<base name={xml_attribute(part.name)} displaycolor={xml_attribute(colour_hex(part.colour))}/>"
            for part in parts
        ),
        "</basematerials>",
    ]
    for index, part in enumerate(parts):
        lines += [
            f'<object id="{index + 2}" type="model" name={xml_attribute(part.name)} pid="1" pindex="{index}">',
            "<mesh>",
            "<vertices>",
            *_rows('<vertex x="%s" y="%s" z="%s"/>', np.asarray(part.vertices, np.float32).astype(str)),
            "</vertices>",
            "<triangles>",
            *_rows('<triangle v1="%s" v2="%s" v3="%s"/>', part.faces),
            "</triangles>",
            "</mesh>",
            "</object>",
        ]
    lines += ["</resources>", "<build>"]
    for (index, copy), (x, y) in zip(built, places, strict=True):
        move = " ".join(f"{value + 0.0:.6f}" for value in (x, y, 0.0) - low[index])
        named = f" partnumber={xml_attribute(copy)}" if copy else ""
        lines.append(f'<item objectid="{index + 2}" transform="1 0 0 0 1 0 0 0 1 {move}"{named}/>')
    return "\n".join([*lines, "</build>", "</model>", ""])


def _rows(form: str, table: np.ndarray) -> list[str]:
    return [form % tuple(row) for row in table.tolist()]
