"""The encapsulating set as a user of CadQuery would write it: workplanes, fillets, one boolean after the other."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cadquery as cq
from run_script import main

TOLERANCE, ANGLE = 0.01, 0.03
"""Of the STL: the angle makes the largest volume error that of unitcad's meshes at its default tolerance."""


def cylinder(radius: float, z0: float, z1: float) -> cq.Workplane:
    return cq.Workplane().workplane(offset=z0).circle(radius).extrude(z1 - z0)


def box(x0: float, x1: float, y0: float, y1: float, z0: float, z1: float) -> cq.Workplane:
    return cq.Workplane().box(x1 - x0, y1 - y0, z1 - z0, centered=False).translate((x0, y0, z0))


def slot(n: dict, radius: float, reach: float, half: float, z0: float, z1: float) -> cq.Workplane:
    return box(0, reach, -half, half, z0, z1).cut(cylinder(radius, z0 - 1, z1 + 1))


def layer(n: dict, i: int) -> cq.Workplane:
    inner, floor = (n["cavity"], n["core_height"]) if i == 0 else (n["radii"][i - 1], n["heights"][i - 1])
    body = cylinder(n["radii"][i], 0, n["heights"][i]).cut(cylinder(inner, 0, floor))
    return body.cut(slot(n, n["ledge"], n["radii"][-1] + 1, n["slot_width"] / 2, *n["slot_z"]))


def circuit(n: dict) -> cq.Workplane:
    low, high = n["circuit_z"]
    width, reach = n["tail"]
    return cylinder(n["pad_radius"], low, high).union(box(0, reach, -width / 2, width / 2, low, high))


def plinth(n: dict, grow: float, bottom: float) -> cq.Workplane:
    """The tapered, keyed square: lofted between two sections, since an extruded taper would move the corners' radii."""

    def section(plane: cq.Workplane, g: float) -> cq.Workplane:
        a, r, key = n["plinth"] + g, n["corner"] + g, n["key"] + (2 - 2**0.5) * g
        s = r * (1 - 0.5**0.5)
        return (
            plane.moveTo(-a + r, -a)
            .lineTo(a - r, -a)
            .threePointArc((a - s, -a + s), (a, -a + r))
            .lineTo(a, a - key)
            .lineTo(a - key, a)
            .lineTo(-a + r, a)
            .threePointArc((-a + s, a - s), (-a, a - r))
            .lineTo(-a, -a + r)
            .threePointArc((-a + s, -a + s), (-a + r, -a))
            .close()
        )

    below = section(cq.Workplane().workplane(offset=bottom), grow - bottom * n["splay"])
    return section(below.workplane(offset=-bottom), grow).loft(ruled=True)


def marked(n: dict, block: cq.Workplane) -> cq.Workplane:
    """One corner cut straight, three rounded."""
    return block.edges("|Z and >X and >Y").chamfer(n["mark"]).edges("|Z and (<X or <Y)").fillet(n["corner"])


def text(letters: list, z0: float, z1: float) -> list[cq.Workplane]:
    found = []
    for letter in letters:
        solid = cq.Workplane().workplane(offset=z0).polyline(letter["outer"]).close().extrude(z1 - z0)
        for island in letter["islands"]:
            solid = solid.cut(cq.Workplane().workplane(offset=z0).polyline(island).close().extrude(z1 - z0))
        found.append(solid)
    return found


def base(n: dict) -> cq.Workplane:
    top = -n["plinth_height"]
    bottom = top - n["plate_thickness"]
    side = 2 * n["plate"]
    body = marked(n, cq.Workplane().workplane(offset=bottom).rect(side, side).extrude(top - bottom))
    body = body.union(plinth(n, 0, top)).union(cylinder(n["cavity"], -1, n["core_height"]))
    inner, outer = n["cup"] - 1.5, n["plate"] + 1
    body = body.cut(box(inner, outer, -4, 4, n["pry_floor"], top + 0.25))
    body = body.cut(box(-outer, -inner, -4, 4, n["pry_floor"], top + 0.25))
    hole, depth = n["hole"], n["filament_groove"]
    roof = bottom + depth
    body = body.cut(cylinder(hole, n["flare_floor"], n["core_height"] + 1))
    wide, up = hole + n["flare"], roof + n["flare"]
    profile = [(0, n["flare_floor"]), (wide, n["flare_floor"]), (wide, roof), (hole, up), (0, up)]
    flare = cq.Workplane("XZ").polyline(profile).close().revolve(360, (0, 0, 0), (0, 1, 0))
    body = body.cut(flare)
    body = body.cut(box(-depth / 2, depth / 2, -(n["plate"] + 1), hole + n["flare"], bottom - 1, roof))
    half = n["slot_width"] / 2 + n["window"]
    body = body.cut(slot(n, n["ledge"], n["cavity"] + 1, half, n["slot_z"][0], n["slot_z"][1] + 1))
    for letter in text(n["base_text"], top - n["engraving"], top + 1):
        body = body.cut(letter)
    return body


def recess(n: dict) -> cq.Workplane:
    """The plinth's room less its ribs, each lofted through its four sections."""
    sections = [[cq.Wire.makePolygon([cq.Vector(*c) for c in ring], close=True) for ring in rib] for rib in n["ribs"]]
    ribs = cq.Compound.makeCompound([cq.Solid.makeLoft(rings, True) for rings in sections])
    return plinth(n, n["recess"], n["skirt_end"]).cut(cq.Workplane(ribs))


def cup(n: dict, i: int) -> cq.Workplane:
    rim, radius, side = n["heights"][i], n["radii"][i], 2 * n["cup"]
    body = cq.Workplane().workplane(offset=n["skirt_end"]).rect(side, side).extrude(rim - n["skirt_end"])
    body = marked(n, body)
    body = body.cut(recess(n)).cut(cylinder(radius, -1, rim + 1))
    inner, depth = radius + n["land"], min(n["groove"][1], rim / 2)
    outer = inner + n["groove"][0]
    groove = cylinder(outer, rim - depth, rim + 1).cut(cylinder(inner, rim - depth, rim + 1))
    half, low, high = n["windows"][i]
    if rim - depth - high < n["least_wall"]:
        groove = groove.cut(box(0, outer + 1, -half - n["least_wall"], half + n["least_wall"], 0, rim + 2))
    body = body.cut(groove).cut(box(0, n["cup"] + 1, -half, half, low, high))
    for letter in text(n["cup_texts"][i], rim - n["engraving"], rim + 1):
        body = body.cut(letter)
    return body


def tongue(n: dict) -> cq.Workplane:
    gap, length, width = n["grip"]
    x0, x1 = n["cup"] + gap, n["cup"] + gap + length
    half = max(width, n["slot_width"] + 4) / 2
    strip = slot(n, n["ledge"], x1 - 1, n["slot_width"] / 2, *n["slot_z"])
    return strip.union(box(x0, x1, -half, half, *n["slot_z"]))


def filament(n: dict) -> cq.Workplane:
    r = n["filament"]
    elbow = -n["plinth_height"] - n["plate_thickness"] + r
    length = n["plate"] + 1 - r + n["stub_tail"] - 1
    lying = cq.Workplane("XZ", origin=(0, 0, elbow)).circle(r).extrude(length)
    ball = cq.Workplane(origin=(0, 0, elbow)).sphere(r)
    return cylinder(r, elbow, n["core_height"]).union(ball).union(lying)


def blade(n: dict) -> cq.Workplane:
    t, e, h = n["blade"]
    section = [(0, 0), (e, 0), (t, 2 * (t - e)), (t, h), (0, h)]
    body = cq.Workplane("XZ", origin=(0, n["plate"], n["heights"][-1])).polyline(section).close()
    return body.extrude(2 * n["plate"])


def make(n: dict[str, Any]) -> dict[str, cq.Workplane]:
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


def write(parts: dict[str, cq.Workplane], out: Path, formats: str) -> None:
    if formats in ("stl", "both"):
        for name, part in parts.items():
            cq.exporters.export(part, str(out / f"{name}.stl"), tolerance=TOLERANCE, angularTolerance=ANGLE)
    if formats in ("step", "both"):
        for group, names in (("unit", list(parts)[:4]), ("moulds", list(parts)[4:])):
            assembly = cq.Assembly(name=group)
            for name in names:
                assembly.add(parts[name], name=name, color=cq.Color("gray"))
            assembly.export(str(out / f"{group}.step"))


if __name__ == "__main__":
    main(make, write)
