"""The same polygons written as PLY, OBJ and OFF in the ways that their formats allow."""

import struct

PLY_TYPES = {"char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I"}
PLY_TYPES |= {"int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I"}
PLY_TYPES |= {"float": "f", "double": "d", "float32": "f", "float64": "d"}


def ply(
    points,
    faces,
    order="<",
    *,
    coordinate="double",
    count="uchar",
    index="int",
    extra=False,
):
    """A PLY; `order` is < or > for binary, "" for text. `extra` adds properties, lists and an element."""
    name = {"<": "binary_little_endian", ">": "binary_big_endian", "": "ascii"}[order]
    head = ["ply", f"format {name} 1.0", "comment made for a test", f"element vertex {len(points)}"]
    head += ["property uchar red"] * extra + [f"property {coordinate} {axis}" for axis in "xyz"]
    head += ["property list uchar short ring"] * extra + ["element material 2", "property float shine"] * extra
    head += [f"element face {len(faces)}", *["property float area"] * extra]
    head += [
        f"property list {count} {index} vertex_indices",
        *["property list int double uv"] * extra,
        "end_header",
        "",
    ]
    records = []
    for i, point in enumerate(points):
        row = [("B", 200)] if extra else []
        row += [(PLY_TYPES[coordinate], float(value)) for value in point]
        records.append(row + ([("B", i % 3), *[("h", -i % 99)] * (i % 3)] if extra else []))
    records += [[("f", 0.5)], [("f", 1.0)]] * extra
    for i, face in enumerate(faces):
        row = [("f", 0.25)] if extra else []
        row += [(PLY_TYPES[count], len(face)), *((PLY_TYPES[index], corner) for corner in face)]
        records.append(row + ([("i", i % 2), *[("d", 0.5)] * (i % 2)] if extra else []))
    if order:
        body = b"".join(
            struct.pack(order + kind, int(v) if kind in "bBhHiI" else v) for row in records for kind, v in row
        )
    else:
        body = "\n".join(" ".join(f"{v:.17g}" for _, v in row) for row in records).encode() + b"\n"
    return "\n".join(head).encode() + body


def obj(points, faces, *, negative=False, form="{}"):
    """An OBJ; `form` writes an index."""
    rows = [f"v {x:.17g} {y:.17g} {z:.17g}" for x, y, z in points]
    lines = ["# made for a test", "mtllib a.mtl", "vt 0 0", "vn 0 0 1", *rows]
    for face in faces:
        names = [form.format(i - len(points) if negative else i + 1) for i in face]
        lines.append(f"f {' '.join(names)}")
    return "\n".join([*lines, ""]).encode()


def off(points, faces, *, kind="", colors=False, comments=False):
    """An OFF of a kind such as CN; `colors` follow the faces."""
    more = " 0.1 0.2 0.3" * ("N" in kind) + " 255 0 0 255" * ("C" in kind) + " 0.5 0.5" * ("ST" in kind)
    note = "  # a note: 3 0 1 2" if comments else ""
    rows = [f"{x:.17g} {y:.17g} {z:.17g}{more}{note}" for x, y, z in points]
    rows += [f"{len(face)} {' '.join(map(str, face))}{' 1 0 0' * colors}{note}" for face in faces]
    head = [f"{kind}OFF{note}", *["# whole line", ""] * comments, f"{len(points)} {len(faces)} 0{note}"]
    return "\n".join([*head, *rows, ""]).encode()


def every_way(points, faces):
    """Files of the polygons by a name with the format's suffix."""
    made = {}
    for order, said in (("<", "little"), (">", "big"), ("", "text")):
        made[f"{said}.ply"] = ply(points, faces, order)
        made[f"{said}-extra.ply"] = ply(points, faces, order, extra=True, count="int", index="ushort")
    made["single.ply"] = ply(points, faces, "<", coordinate="float", count="ushort", index="uint32")
    made |= {"plain.obj": obj(points, faces), "back.obj": obj(points, faces, negative=True)}
    made["slashes.obj"] = obj(points, faces, form="{0}//1")
    made["full.obj"] = obj(points, faces, form="{0}/1/1")
    made |= {f"{kind}plain.off": off(points, faces, kind=kind) for kind in ("", "C", "N", "STCN")}
    made["noted.off"] = off(points, faces, colors=True, comments=True)
    return made
