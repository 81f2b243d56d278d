"""The encapsulating set as a user of build123d would write it: primitives, fillets, one boolean after the other."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from build123d import (
    Align,
    Axis,
    Box,
    Color,
    Compound,
    Cylinder,
    Face,
    Line,
    Plane,
    Polygon,
    Pos,
    RadiusArc,
    Rot,
    Sphere,
    Wire,
    chamfer,
    export_step,
    export_stl,
    extrude,
    fillet,
    loft,
    revolve,
)
from run_script import main

TOLERANCE, ANGLE = 0.01, 0.03
"""Of the STL: the angle makes the largest volume error that of unitcad's meshes at its default tolerance."""
LOW = (Align.MIN, Align.MIN, Align.MIN)


def cylinder(radius: float, z0: float, z1: float) -> Any:
    return Pos(0, 0, z0) * Cylinder(radius, z1 - z0, align=(Align.CENTER, Align.CENTER, Align.MIN))


def box(x0: float, x1: float, y0: float, y1: float, z0: float, z1: float) -> Any:
    return Pos(x0, y0, z0) * Box(x1 - x0, y1 - y0, z1 - z0, align=LOW)


def block(half: float, radius: float, mark: float, z0: float, z1: float) -> Any:
    """One corner cut straight, three rounded."""
    solid = box(-half, half, -half, half, z0, z1)
    *others, last = sorted(solid.edges().filter_by(Axis.Z), key=lambda edge: edge.center().X + edge.center().Y)
    solid = chamfer(last, mark)
    there = [(edge.center().X, edge.center().Y) for edge in others]
    return fillet([e for e in solid.edges().filter_by(Axis.Z) if (e.center().X, e.center().Y) in there], radius)


def slot(n: dict, radius: float, reach: float, half: float, z0: float, z1: float) -> Any:
    return box(0, reach, -half, half, z0, z1) - cylinder(radius, z0 - 1, z1 + 1)


def layer(n: dict, i: int) -> Any:
    inner, floor = (n["cavity"], n["core_height"]) if i == 0 else (n["radii"][i - 1], n["heights"][i - 1])
    body = cylinder(n["radii"][i], 0, n["heights"][i]) - cylinder(inner, 0, floor)
    return body - slot(n, n["ledge"], n["radii"][-1] + 1, n["slot_width"] / 2, *n["slot_z"])


def circuit(n: dict) -> Any:
    low, high = n["circuit_z"]
    width, reach = n["tail"]
    return cylinder(n["pad_radius"], low, high) + box(0, reach, -width / 2, width / 2, low, high)


def plinth(n: dict, grow: float, bottom: float) -> Any:
    """The tapered, keyed square: lofted between two sections, since an extruded taper would move the corners' radii."""

    def section(g: float) -> Face:
        a, r, key = n["plinth"] + g, n["corner"] + g, n["key"] + (2 - 2**0.5) * g
        outline = [
            Line((-a + r, -a), (a - r, -a)),
            RadiusArc((a - r, -a), (a, -a + r), -r),
            Line((a, -a + r), (a, a - key)),
            Line((a, a - key), (a - key, a)),
            Line((a - key, a), (-a + r, a)),
            RadiusArc((-a + r, a), (-a, a - r), -r),
            Line((-a, a - r), (-a, -a + r)),
            RadiusArc((-a, -a + r), (-a + r, -a), -r),
        ]
        return Face(Wire([line.edge() for line in outline]))

    return loft([Pos(0, 0, bottom) * section(grow - bottom * n["splay"]), section(grow)], ruled=True)


def text(letters: list, z0: float, z1: float) -> list:
    found = []
    for letter in letters:
        sketch = Polygon(*map(tuple, letter["outer"]), align=None)
        for island in letter["islands"]:
            sketch -= Polygon(*map(tuple, island), align=None)
        found.append(extrude(Pos(0, 0, z0) * sketch, z1 - z0))
    return found


def base(n: dict) -> Any:
    top = -n["plinth_height"]
    bottom = top - n["plate_thickness"]
    body = (
        block(n["plate"], n["corner"], n["mark"], bottom, top)
        + plinth(n, 0, top)
        + cylinder(n["cavity"], -1, n["core_height"])
    )
    inner, outer = n["cup"] - 1.5, n["plate"] + 1
    body -= box(inner, outer, -4, 4, n["pry_floor"], top + 0.25)
    body -= box(-outer, -inner, -4, 4, n["pry_floor"], top + 0.25)
    hole, depth = n["hole"], n["filament_groove"]
    roof = bottom + depth
    body -= cylinder(hole, n["flare_floor"], n["core_height"] + 1)
    profile = Polygon(
        (0, n["flare_floor"]),
        (hole + n["flare"], n["flare_floor"]),
        (hole + n["flare"], roof),
        (hole, roof + n["flare"]),
        (0, roof + n["flare"]),
        align=None,
    )
    body -= revolve(Plane.XZ * profile, Axis.Z)
    body -= box(-depth / 2, depth / 2, -(n["plate"] + 1), hole + n["flare"], bottom - 1, roof)
    half = n["slot_width"] / 2 + n["window"]
    body -= slot(n, n["ledge"], n["cavity"] + 1, half, n["slot_z"][0], n["slot_z"][1] + 1)
    for letter in text(n["base_text"], top - n["engraving"], top + 1):
        body -= letter
    return body


def recess(n: dict) -> Any:
    """The plinth's room less its ribs, each lofted through its four sections."""
    ribs = [loft([Face(Wire.make_polygon(ring)) for ring in rib], ruled=True) for rib in n["ribs"]]
    return plinth(n, n["recess"], n["skirt_end"]) - ribs


def cup(n: dict, i: int) -> Any:
    rim, radius = n["heights"][i], n["radii"][i]
    body = block(n["cup"], n["corner"], n["mark"], n["skirt_end"], rim) - recess(n)
    body -= cylinder(radius, -1, rim + 1)
    inner, depth = radius + n["land"], min(n["groove"][1], rim / 2)
    outer = inner + n["groove"][0]
    groove = cylinder(outer, rim - depth, rim + 1) - cylinder(inner, rim - depth, rim + 1)
    half, low, high = n["windows"][i]
    if rim - depth - high < n["least_wall"]:
        groove -= box(0, outer + 1, -half - n["least_wall"], half + n["least_wall"], 0, rim + 2)
    body = body - groove - box(0, n["cup"] + 1, -half, half, low, high)
    for letter in text(n["cup_texts"][i], rim - n["engraving"], rim + 1):
        body -= letter
    return body


def tongue(n: dict) -> Any:
    gap, length, width = n["grip"]
    x0, x1 = n["cup"] + gap, n["cup"] + gap + length
    half = max(width, n["slot_width"] + 4) / 2
    return slot(n, n["ledge"], x1 - 1, n["slot_width"] / 2, *n["slot_z"]) + box(x0, x1, -half, half, *n["slot_z"])


def filament(n: dict) -> Any:
    r = n["filament"]
    elbow = -n["plinth_height"] - n["plate_thickness"] + r
    length = n["plate"] + 1 - r + n["stub_tail"] - 1
    lying = Pos(0, 0, elbow) * Rot(90, 0, 0) * cylinder(r, 0, length)
    return cylinder(r, elbow, n["core_height"]) + Pos(0, 0, elbow) * Sphere(r) + lying


def blade(n: dict) -> Any:
    t, e, h = n["blade"]
    section = Polygon((0, 0), (e, 0), (t, 2 * (t - e)), (t, h), (0, h), align=None)
    return Pos(0, n["plate"], n["heights"][-1]) * extrude(Plane.XZ * section, 2 * n["plate"])


def make(n: dict[str, Any]) -> dict[str, Any]:
    """All parts by name."""
    return {
        "layer1": layer(n, 0),
        "layer2": layer(n, 1),
        "motor": cylinder(n["motor"][0], 0, n["motor"][1]),
        "fpcb": circuit(n),
        "base": base(n),
        "cup1": cup(n, 0),
        "cup2": cup(n, 1),
        "tongue": tongue(n),
        "filament": filament(n),
        "blade": blade(n),
    }


def write(parts: dict[str, Any], out: Path, formats: str) -> None:
    if formats in ("stl", "both"):
        for name, part in parts.items():
            export_stl(part, out / f"{name}.stl", tolerance=TOLERANCE, angular_tolerance=ANGLE)
    if formats in ("step", "both"):
        for group, names in (("unit", list(parts)[:4]), ("moulds", list(parts)[4:])):
            children = []
            for name in names:
                solid = parts[name].solid()
                solid.label, solid.color = name, Color("gray")
                children.append(solid)
            export_step(Compound(label=group, children=children), out / f"{group}.step")


if __name__ == "__main__":
    main(make, write)
