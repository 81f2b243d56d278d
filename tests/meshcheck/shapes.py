"""Meshes and files for the tests of the checks: small solids, binary and text STL, 3MF packages."""

import io
import struct
import zipfile

import numpy as np

CORE = "http://schemas.microsoft.com/3dmanufacturing/core/2015/02"
MATERIAL = "http://schemas.microsoft.com/3dmanufacturing/material/2015/02"
PRODUCTION = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06"
SLICE = "http://schemas.microsoft.com/3dmanufacturing/slice/2015/07"
BEAM = "http://schemas.microsoft.com/3dmanufacturing/beamlattice/2017/02"
RELS = "http://schemas.openxmlformats.org/package/2006/relationships"
START = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel"
TEXTURE = "http://schemas.microsoft.com/3dmanufacturing/2013/01/3dtexture"
TICKET = "http://schemas.microsoft.com/3dmanufacturing/2013/01/printticket"
THUMBNAIL = "http://schemas.openxmlformats.org/package/2006/relationships/metadata/thumbnail"
PNG = b"\x89PNG\r\n\x1a\n" + b"\x00\x00\x00\rIHDR" + bytes(13) + b"\x00" * 4

CUBE_CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
CUBE_FACES = np.array(
    [[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
     [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]]
)  # fmt: skip


def box(size=(10, 10, 10), at=(0, 0, 0)):
    """The triangles of a box, (12, 3, 3), outwards."""
    return (CUBE_CORNERS * np.asarray(size, float) + np.asarray(at, float))[CUBE_FACES]


def prism(outline, low, high):
    """The triangles of an upright prism over a convex outline that turns anticlockwise."""
    n = len(outline)
    bottom = np.array([[x, y, low] for x, y in outline])
    top = np.array([[x, y, high] for x, y in outline])
    found = [[bottom[0], bottom[i + 1], bottom[i]] for i in range(1, n - 1)]
    found += [[top[0], top[i], top[i + 1]] for i in range(1, n - 1)]
    for i in range(n):
        j = (i + 1) % n
        found += [[bottom[i], bottom[j], top[j]], [bottom[i], top[j], top[i]]]
    return np.array(found)


def stl(triangles, *, header=b"a box", count=None, normals=None):
    """A binary STL; `normals` are zeros unless given."""
    records = np.zeros(len(triangles), np.dtype([("n", "<f4", 3), ("v", "<f4", (3, 3)), ("a", "<u2")]))
    records["v"] = triangles
    if normals is not None:
        records["n"] = normals
    return (
        header.ljust(80, b"\0")[:80] + struct.pack("<I", len(triangles) if count is None else count) + records.tobytes()
    )


def text_stl(triangles, name="box"):
    """A text STL with zero normals."""
    lines = [f"solid {name}"]
    for corners in triangles:
        lines += ["facet normal 0 0 0", " outer loop"]
        lines += [f"  vertex {x:.9g} {y:.9g} {z:.9g}" for x, y, z in corners]
        lines += [" endloop", "endfacet"]
    return "\n".join([*lines, f"endsolid {name}", ""])


def text_ply(corners, faces):
    """A text PLY of triangles."""
    head = ["ply", "format ascii 1.0", f"element vertex {len(corners)}", *(f"property double {axis}" for axis in "xyz")]
    head += [f"element face {len(faces)}", "property list uchar int vertex_indices", "end_header"]
    rows = [f"{x:.17g} {y:.17g} {z:.17g}" for x, y, z in corners] + [f"3 {a} {b} {c}" for a, b, c in faces]
    return "\n".join([*head, *rows, ""])


def obj(corners, faces):
    """A text OBJ of triangles."""
    rows = [f"v {x:.17g} {y:.17g} {z:.17g}" for x, y, z in corners]
    return "\n".join([*rows, *(f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces), ""])


FORMATS = ("binary.stl", "text.stl", "part.ply", "part.obj", "part.3mf")


def in_format(triangles, name):
    """Triangles (n, 3, 3) as a file of one of FORMATS; indexed formats list each place once."""
    if name == "binary.stl":
        return stl(triangles)
    if name == "text.stl":
        return text_stl(triangles)
    corners, faces = np.unique(np.asarray(triangles, float).reshape(-1, 3), axis=0, return_inverse=True)
    faces = faces.reshape(-1, 3)
    if name == "part.3mf":
        return package(model_xml(f'<object id="1">{mesh_xml(corners, faces)}</object>'))
    return (text_ply if name == "part.ply" else obj)(corners, faces)


def turned(triangles, seed, scale=1.0, shift=0.0, mirror=False):
    """The same body turned by odd angles, scaled, shifted by up to `shift` mm, mirrored; faces still look outwards."""
    rng = np.random.default_rng(seed)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn)) * (-1 if mirror else 1)
    found = np.asarray(triangles, float) @ turn.T * scale + rng.uniform(-shift, shift, 3)
    return found[:, ::-1] if mirror else found


def fin(*, other_diagonals, cells=1):
    """Two coincident sheets from the origin's upright edge outwards, 5 sqrt(2) by 10; `cells` quads each way."""
    found = []
    steps = np.linspace(0, 1, cells + 1)
    for i in range(cells):
        for j in range(cells):
            ring = [np.array([-5 * s, -5 * s, 10 * t])
                    for s, t in ((steps[i], steps[j]), (steps[i], steps[j + 1]),
                                 (steps[i + 1], steps[j + 1]), (steps[i + 1], steps[j]))]  # fmt: skip
            a, b, c, d = ring
            found += [[a, b, c], [a, c, d]]
            found += [[b, a, d], [b, d, c]] if other_diagonals else [[a, c, b], [a, d, c]]
    return np.array(found)


def surface(field, rng):
    """The faces between cells of different winding number, as many as the numbers differ, with either diagonal."""
    padded, found = np.pad(field, 1), []
    for axis in range(3):
        u, v = np.eye(3)[(axis + 1) % 3], np.eye(3)[(axis + 2) % 3]
        step = np.diff(padded, axis=axis)
        for cell in np.argwhere(step):
            corner = cell + np.eye(3)[axis]
            ring = [corner, corner + u, corner + u + v, corner + v]
            rise = step[tuple(cell)]
            ring = ring[::-1] if rise > 0 else ring
            for _ in range(abs(rise)):
                k = int(rng.integers(0, 2))
                found += [[ring[k], ring[k + 1], ring[k + 2]], [ring[k], ring[k + 2], ring[(k + 3) % 4]]]
    return np.array(found)


def mesh_xml(corners=CUBE_CORNERS * 10, faces=CUBE_FACES, per_face=""):
    """A <mesh> element."""
    points = "".join(f'<vertex x="{x:.9g}" y="{y:.9g}" z="{z:.9g}"/>' for x, y, z in corners)
    rows = "".join(f'<triangle v1="{a}" v2="{b}" v3="{c}" {per_face}/>' for a, b, c in faces)
    return f"<mesh><vertices>{points}</vertices><triangles>{rows}</triangles></mesh>"


def model_xml(
    resources=None,
    build='<build><item objectid="1"/></build>',
    attributes='unit="millimeter"',
    before="",
):
    """A model part: a cube unless `resources` says otherwise."""
    if resources is None:
        resources = f'<object id="1">{mesh_xml()}</object>'
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<model xmlns="{CORE}" xmlns:m="{MATERIAL}" xmlns:p="{PRODUCTION}" '
        f'xmlns:s="{SLICE}" xmlns:b="{BEAM}" {attributes}>{before}<resources>{resources}</resources>'
        f"{build or ''}</model>"
    )


def rels_xml(*relations, mode=""):
    """A relationships part: (type, target) each."""
    rows = "".join(
        f'<Relationship Id="r{i}" Type="{kind}" Target="{target}"{mode}/>' for i, (kind, target) in enumerate(relations)
    )
    return f'<?xml version="1.0" encoding="UTF-8"?>\n<Relationships xmlns="{RELS}">{rows}</Relationships>'


TYPES = (
    '<?xml version="1.0" encoding="UTF-8"?>\n<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">'
    '<Default Extension="rels" ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
    '<Default Extension="model" ContentType="application/vnd.ms-package.3dmanufacturing-3dmodel+xml"/>'
    '<Default Extension="png" ContentType="image/png"/>'
    '<Default Extension="xml" ContentType="application/vnd.ms-printing.printticket+xml"/></Types>'
)
ROOT_RELS = rels_xml((START, "/3D/3dmodel.model"))


def package(
    model=None,
    *,
    types=TYPES,
    rels=ROOT_RELS,
    more=(),
    at="3D/3dmodel.model",
    compression=zipfile.ZIP_DEFLATED,
):
    """A 3MF package; `more` are further entries, written even if a name is there already."""
    out = io.BytesIO()
    entries = []
    if types is not None:
        entries.append(("[Content_Types].xml", types))
    if rels is not None:
        entries.append(("_rels/.rels", rels))
    entries.append((at, model_xml() if model is None else model))
    with zipfile.ZipFile(out, "w", compression) as archive:
        for name, content in (*entries, *more):
            archive.writestr(zipfile.ZipInfo(name, (2020, 1, 1, 0, 0, 0)), content, compression)
    return out.getvalue()


def finding(report, code):
    """The finding of a code; a report has one at most."""
    return next(found for found in report.findings if found.code == code)
