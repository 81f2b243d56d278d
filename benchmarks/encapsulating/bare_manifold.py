"""The encapsulating set in bare manifold3d calls: what the kernel alone costs. Polygons of unitcad's segment count."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from manifold3d import CrossSection, Manifold, OpType
from run_script import main

SEGMENTS = 56
"""What unitcad takes for a radius of 7 at its default tolerance of 0.01 mm."""
SWELL = math.sqrt((2 * math.pi / SEGMENTS) / math.sin(2 * math.pi / SEGMENTS))


def cylinder(radius: float, z0: float, z1: float) -> Manifold:
    return Manifold.cylinder(z1 - z0, radius * SWELL, circular_segments=SEGMENTS).translate((0, 0, z0))


def box(x0: float, x1: float, y0: float, y1: float, z0: float, z1: float) -> Manifold:
    return Manifold.cube((x1 - x0, y1 - y0, z1 - z0)).translate((x0, y0, z0))


def corner(x: float, y: float, r: float, start: float) -> list[tuple[float, float]]:
    steps = SEGMENTS // 4
    angles = [start + math.pi / 2 * i / steps for i in range(steps + 1)]
    return [(x + r * math.cos(a), y + r * math.sin(a)) for a in angles]


def block(half: float, r: float, mark: float, z0: float, z1: float) -> Manifold:
    i = half - r
    points = [*corner(i, -i, r, -math.pi / 2), (half, half - mark), (half - mark, half), *corner(-i, i, r, math.pi / 2)]
    points += corner(-i, -i, r, math.pi)
    return Manifold.extrude(CrossSection([points]), z1 - z0).translate((0, 0, z0))


def slot(n: dict, radius: float, reach: float, half: float, z0: float, z1: float) -> Manifold:
    return box(0, reach, -half, half, z0, z1) - cylinder(radius, z0 - 1, z1 + 1)


def layer(n: dict, i: int) -> Manifold:
    inner, floor = (n["cavity"], n["core_height"]) if i == 0 else (n["radii"][i - 1], n["heights"][i - 1])
    body = cylinder(n["radii"][i], 0, n["heights"][i]) - cylinder(inner, -1, floor)
    return body - slot(n, n["ledge"], n["radii"][-1] + 1, n["slot_width"] / 2, *n["slot_z"])


def circuit(n: dict) -> Manifold:
    low, high = n["circuit_z"]
    width, reach = n["tail"]
    return cylinder(n["pad_radius"], low, high) + box(0, reach, -width / 2, width / 2, low, high)


def plinth(n: dict, grow: float, bottom: float) -> Manifold:
    def section(g: float, z: float) -> list[tuple[float, float, float]]:
        a, r, key = n["plinth"] + g, n["corner"] + g, n["key"] + (2 - 2**0.5) * g
        i = a - r
        flat = [*corner(i, -i, r, -math.pi / 2), (a, a - key), (a - key, a)]
        flat += corner(-i, i, r, math.pi / 2) + corner(-i, -i, r, math.pi)
        return [(x, y, z) for x, y in flat]

    return Manifold.hull_points(np.array(section(grow - bottom * n["splay"], bottom) + section(grow, 0.0)))


def text(letters: list, z0: float, z1: float) -> list[Manifold]:
    return [
        Manifold.extrude(CrossSection([a["outer"], *(island[::-1] for island in a["islands"])]), z1 - z0).translate(
            (0, 0, z0)
        )
        for a in letters
    ]


def base(n: dict) -> Manifold:
    top = -n["plinth_height"]
    bottom = top - n["plate_thickness"]
    body = (
        block(n["plate"], n["corner"], n["mark"], bottom, top)
        + plinth(n, 0, top)
        + cylinder(n["cavity"], -1, n["core_height"])
    )
    inner, outer = n["cup"] - 1.5, n["plate"] + 1
    hole, depth = n["hole"], n["filament_groove"]
    roof = bottom + depth
    half = n["slot_width"] / 2 + n["window"]
    wide = hole + n["flare"]
    flare = Manifold.cylinder(n["flare"], wide * SWELL, hole * SWELL, SEGMENTS).translate((0, 0, roof))
    tools = [
        box(inner, outer, -4, 4, n["pry_floor"], top + 0.25),
        box(-outer, -inner, -4, 4, n["pry_floor"], top + 0.25),
        cylinder(hole, n["flare_floor"], n["core_height"] + 1),
        flare,
        cylinder(wide, n["flare_floor"], roof),
        box(-depth / 2, depth / 2, -(n["plate"] + 1), wide, bottom - 1, roof),
        slot(n, n["ledge"], n["cavity"] + 1, half, n["slot_z"][0], n["slot_z"][1] + 1),
        *text(n["base_text"], top - n["engraving"], top + 1),
    ]
    return Manifold.batch_boolean([body, *tools], OpType.Subtract)


def recess(n: dict) -> Manifold:
    ribs = [Manifold.hull_points(np.array(below + above)) for rib in n["ribs"] for below, above in pairwise(rib)]
    return Manifold.batch_boolean([plinth(n, n["recess"], n["skirt_end"]), *ribs], OpType.Subtract)


def cup(n: dict, i: int) -> Manifold:
    rim, radius = n["heights"][i], n["radii"][i]
    inner, depth = radius + n["land"], min(n["groove"][1], rim / 2)
    outer = inner + n["groove"][0]
    groove = cylinder(outer, rim - depth, rim + 1) - cylinder(inner, rim - depth - 1, rim + 2)
    half, low, high = n["windows"][i]
    if rim - depth - high < n["least_wall"]:
        groove -= box(0, outer + 1, -half - n["least_wall"], half + n["least_wall"], 0, rim + 2)
    tools = [
        recess(n),
        cylinder(radius, -1, rim + 1),
        groove,
        box(0, n["cup"] + 1, -half, half, low, high),
        *text(n["cup_texts"][i], rim - n["engraving"], rim + 1),
    ]
    body = block(n["cup"], n["corner"], n["mark"], n["skirt_end"], rim)
    return Manifold.batch_boolean([body, *tools], OpType.Subtract)


def tongue(n: dict) -> Manifold:
    gap, length, width = n["grip"]
    x0, x1 = n["cup"] + gap, n["cup"] + gap + length
    half = max(width, n["slot_width"] + 4) / 2
    return slot(n, n["ledge"], x1 - 1, n["slot_width"] / 2, *n["slot_z"]) + box(x0, x1, -half, half, *n["slot_z"])


def filament(n: dict) -> Manifold:
    r = n["filament"]
    elbow = -n["plinth_height"] - n["plate_thickness"] + r
    length = n["plate"] + 1 - r + n["stub_tail"] - 1
    ball = Manifold.sphere(r, SEGMENTS).translate((0, 0, elbow))
    lying = cylinder(r, 0, length).rotate((90, 0, 0)).translate((0, 0, elbow))
    return cylinder(r, elbow, n["core_height"]) + ball + lying


def blade(n: dict) -> Manifold:
    t, e, h = n["blade"]
    section = CrossSection([[(0, 0), (e, 0), (t, 2 * (t - e)), (t, h), (0, h)]])
    solid = Manifold.extrude(section, 2 * n["plate"]).rotate((90, 0, 0))
    return solid.translate((0, n["plate"], n["heights"][-1]))


def make(n: dict[str, Any]) -> dict[str, Manifold]:
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


def write(parts: dict[str, Manifold], out: Path, formats: str) -> None:
    """Binary STL, nothing else."""
    record = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("colour", "<u2")])
    for name, part in parts.items():
        mesh = part.to_mesh64()
        corners = mesh.vert_properties[:, :3][mesh.tri_verts]
        facets = np.zeros(len(corners), dtype=record)
        facets["corners"] = corners
        facets["normal"] = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        (out / f"{name}.stl").write_bytes(bytes(80) + np.uint32(len(facets)).tobytes() + facets.tobytes())


if __name__ == "__main__":
    main(make, write)
