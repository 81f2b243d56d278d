"""The encapsulating set in bare OCCT calls: what the kernel alone costs, from its import to named STEP assemblies."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepBuilderAPI import (
    BRepBuilderAPI_MakeEdge,
    BRepBuilderAPI_MakeFace,
    BRepBuilderAPI_MakePolygon,
    BRepBuilderAPI_MakeWire,
)
from OCP.BRepOffsetAPI import BRepOffsetAPI_ThruSections
from OCP.BRepPrimAPI import (
    BRepPrimAPI_MakeBox,
    BRepPrimAPI_MakeCone,
    BRepPrimAPI_MakeCylinder,
    BRepPrimAPI_MakePrism,
    BRepPrimAPI_MakeSphere,
)
from OCP.GC import GC_MakeArcOfCircle
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt, gp_Vec
from OCP.STEPCAFControl import STEPCAFControl_Writer
from OCP.STEPControl import STEPControl_StepModelType
from OCP.TCollection import TCollection_ExtendedString
from OCP.TDataStd import TDataStd_Name
from OCP.TDocStd import TDocStd_Document
from OCP.TopTools import TopTools_ListOfShape
from OCP.XCAFDoc import XCAFDoc_DocumentTool
from run_script import main

SQRT = 2**0.5


def cylinder(radius: float, z0: float, z1: float) -> Any:
    return BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(0, 0, z0), gp_Dir(0, 0, 1)), radius, z1 - z0).Shape()


def box(x0: float, x1: float, y0: float, y1: float, z0: float, z1: float) -> Any:
    return BRepPrimAPI_MakeBox(gp_Pnt(x0, y0, z0), gp_Pnt(x1, y1, z1)).Shape()


def combined(kind: type, body: Any, tools: Sequence[Any]) -> Any:
    """One boolean with all tools at once."""
    made, arguments, others = kind(), TopTools_ListOfShape(), TopTools_ListOfShape()
    arguments.Append(body)
    for tool in tools:
        others.Append(tool)
    made.SetArguments(arguments)
    made.SetTools(others)
    made.Build()
    return made.Shape()


def cut(body: Any, *tools: Any) -> Any:
    return combined(BRepAlgoAPI_Cut, body, tools)


def fuse(body: Any, *tools: Any) -> Any:
    return combined(BRepAlgoAPI_Fuse, body, tools)


def keyed_square(a: float, r: float, key: float, z: float) -> Any:
    """Three corners rounded, one cut straight, as a wire."""
    d = r * (1 - 1 / SQRT)
    lines = [((-a + r, -a), (a - r, -a)), ((a, -a + r), (a, a - key)), ((a, a - key), (a - key, a))]
    lines += [((a - key, a), (-a + r, a)), ((-a, a - r), (-a, -a + r))]
    arcs = [
        ((a - r, -a), (a - d, -a + d), (a, -a + r)),
        ((-a + r, a), (-a + d, a - d), (-a, a - r)),
        ((-a, -a + r), (-a + d, -a + d), (-a + r, -a)),
    ]
    edges: list[Any] = [BRepBuilderAPI_MakeEdge(*(gp_Pnt(x, y, z) for x, y in line)).Edge() for line in lines]
    edges += [
        BRepBuilderAPI_MakeEdge(GC_MakeArcOfCircle(*(gp_Pnt(x, y, z) for x, y in arc)).Value()).Edge() for arc in arcs
    ]
    wire = BRepBuilderAPI_MakeWire()
    for i in (0, 5, 1, 2, 3, 6, 4, 7):  # each edge begins where the one before ends
        wire.Add(edges[i])
    return wire.Wire()


def prism(face: Any, height: float) -> Any:
    return BRepPrimAPI_MakePrism(face, gp_Vec(0, 0, height)).Shape()


def block(half: float, r: float, mark: float, z0: float, z1: float) -> Any:
    return prism(BRepBuilderAPI_MakeFace(keyed_square(half, r, mark, z0)).Face(), z1 - z0)


def polygon(points: Sequence[Sequence[float]], z: float | None = None) -> Any:
    made = BRepBuilderAPI_MakePolygon()
    for point in points:
        made.Add(gp_Pnt(*point) if z is None else gp_Pnt(point[0], point[1], z))
    made.Close()
    return made.Wire()


def through(wires: Sequence[Any]) -> Any:
    """A ruled solid through sections."""
    made = BRepOffsetAPI_ThruSections(True, True)
    for wire in wires:
        made.AddWire(wire)
    return made.Shape()


def slot(n: dict, radius: float, reach: float, half: float, z0: float, z1: float) -> Any:
    return cut(box(0, reach, -half, half, z0, z1), cylinder(radius, z0 - 1, z1 + 1))


def layer(n: dict, i: int) -> Any:
    inner, floor = (n["cavity"], n["core_height"]) if i == 0 else (n["radii"][i - 1], n["heights"][i - 1])
    opening = slot(n, n["ledge"], n["radii"][-1] + 1, n["slot_width"] / 2, *n["slot_z"])
    return cut(cylinder(n["radii"][i], 0, n["heights"][i]), cylinder(inner, -1, floor), opening)


def circuit(n: dict) -> Any:
    low, high = n["circuit_z"]
    width, reach = n["tail"]
    return fuse(cylinder(n["pad_radius"], low, high), box(0, reach, -width / 2, width / 2, low, high))


def plinth(n: dict, grow: float, bottom: float) -> Any:
    def section(g: float, z: float) -> Any:
        return keyed_square(n["plinth"] + g, n["corner"] + g, n["key"] + (2 - SQRT) * g, z)

    return through([section(grow - bottom * n["splay"], bottom), section(grow, 0.0)])


def text(letters: list, z0: float, z1: float) -> list[Any]:
    made = []
    for letter in letters:
        face = BRepBuilderAPI_MakeFace(polygon(letter["outer"], z0))
        for island in letter["islands"]:
            face.Add(polygon(island[::-1], z0))
        made.append(prism(face.Face(), z1 - z0))
    return made


def base(n: dict) -> Any:
    top = -n["plinth_height"]
    bottom = top - n["plate_thickness"]
    plate = block(n["plate"], n["corner"], n["mark"], bottom, top)
    body = fuse(plate, plinth(n, 0, top), cylinder(n["cavity"], -1, n["core_height"]))
    inner, outer = n["cup"] - 1.5, n["plate"] + 1
    hole, depth = n["hole"], n["filament_groove"]
    roof = bottom + depth
    wide = hole + n["flare"]
    axis = gp_Ax2(gp_Pnt(0, 0, roof), gp_Dir(0, 0, 1))
    half = n["slot_width"] / 2 + n["window"]
    return cut(
        body,
        box(inner, outer, -4, 4, n["pry_floor"], top + 0.25),
        box(-outer, -inner, -4, 4, n["pry_floor"], top + 0.25),
        cylinder(hole, n["flare_floor"], n["core_height"] + 1),
        BRepPrimAPI_MakeCone(axis, wide, hole, n["flare"]).Shape(),
        cylinder(wide, n["flare_floor"], roof),
        box(-depth / 2, depth / 2, -(n["plate"] + 1), wide, bottom - 1, roof),
        slot(n, n["ledge"], n["cavity"] + 1, half, n["slot_z"][0], n["slot_z"][1] + 1),
        *text(n["base_text"], top - n["engraving"], top + 1),
    )


def cup(n: dict, i: int) -> Any:
    rim, radius = n["heights"][i], n["radii"][i]
    inner, depth = radius + n["land"], min(n["groove"][1], rim / 2)
    outer = inner + n["groove"][0]
    groove = cut(cylinder(outer, rim - depth, rim + 1), cylinder(inner, rim - depth - 1, rim + 2))
    half, low, high = n["windows"][i]
    if rim - depth - high < n["least_wall"]:
        groove = cut(groove, box(0, outer + 1, -half - n["least_wall"], half + n["least_wall"], 0, rim + 2))
    ribs = [through([polygon(ring) for ring in rib]) for rib in n["ribs"]]
    return cut(
        block(n["cup"], n["corner"], n["mark"], n["skirt_end"], rim),
        cut(plinth(n, n["recess"], n["skirt_end"]), *ribs),
        cylinder(radius, -1, rim + 1),
        groove,
        box(0, n["cup"] + 1, -half, half, low, high),
        *text(n["cup_texts"][i], rim - n["engraving"], rim + 1),
    )


def tongue(n: dict) -> Any:
    gap, length, width = n["grip"]
    x0, x1 = n["cup"] + gap, n["cup"] + gap + length
    half = max(width, n["slot_width"] + 4) / 2
    return fuse(slot(n, n["ledge"], x1 - 1, n["slot_width"] / 2, *n["slot_z"]), box(x0, x1, -half, half, *n["slot_z"]))


def filament(n: dict) -> Any:
    r = n["filament"]
    elbow = -n["plinth_height"] - n["plate_thickness"] + r
    length = n["plate"] + 1 - r + n["stub_tail"] - 1
    lying = BRepPrimAPI_MakeCylinder(gp_Ax2(gp_Pnt(0, 0, elbow), gp_Dir(0, -1, 0)), r, length).Shape()
    return fuse(cylinder(r, elbow, n["core_height"]), BRepPrimAPI_MakeSphere(gp_Pnt(0, 0, elbow), r).Shape(), lying)


def blade(n: dict) -> Any:
    t, e, h = n["blade"]
    y, z = n["plate"], n["heights"][-1]
    corners = [(0, 0), (e, 0), (t, 2 * (t - e)), (t, h), (0, h)]
    face = BRepBuilderAPI_MakeFace(polygon([(x, y, z + up) for x, up in corners])).Face()
    return BRepPrimAPI_MakePrism(face, gp_Vec(0, -2 * y, 0)).Shape()


def make(n: dict[str, Any]) -> dict[str, dict[str, Any]]:
    """All parts by name, in two assemblies."""
    unit = {
        "layer1": layer(n, 0),
        "layer2": layer(n, 1),
        "motor": cylinder(n["motor"][0], 0, n["motor"][1]),
        "fpcb": circuit(n),
    }
    moulds = {"base": base(n), "cup1": cup(n, 0), "cup2": cup(n, 1), "tongue": tongue(n), "filament": filament(n)}
    return {"unit": unit, "moulds": {**moulds, "blade": blade(n)}}


def write(made: dict[str, dict[str, Any]], out: Path, formats: str) -> None:
    """Two STEP files with named parts."""
    for assembly, parts in made.items():
        document = TDocStd_Document(TCollection_ExtendedString("XmlOcaf"))
        tool = XCAFDoc_DocumentTool.ShapeTool_s(document.Main())
        for name, part in parts.items():
            TDataStd_Name.Set_s(tool.AddShape(part, False), TCollection_ExtendedString(name))
        writer = STEPCAFControl_Writer()
        writer.SetNameMode(True)
        writer.Transfer(document, STEPControl_StepModelType.STEPControl_AsIs)
        writer.Write(str(out / f"{assembly}.step"))


if __name__ == "__main__":
    main(make, write)
