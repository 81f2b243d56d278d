"""The beads of a G-code, object by object and layer by layer: what a printer lays down, as polygons."""

import math
import re
from dataclasses import dataclass, field
from functools import cached_property

import pytest

shapely = pytest.importorskip("shapely", reason="reads the slicer's paths by shapely")

FILAMENT_MM2 = math.pi * 1.75**2 / 4
SKIPPED = ("Skirt", "Skirt/Brim", "Support material", "Support material interface")


@dataclass
class Layer:
    """Beads of one layer: its top and its height, mm; `lines` are ((x, y), (x, y), width)."""

    top: float
    height: float
    lines: list = field(default_factory=list)

    @cached_property
    def area(self):
        """All beads as one polygon, each as wide as its filament makes it."""
        paths = [shapely.LineString(ends).buffer(width / 2, quad_segs=8) for *ends, width in self.lines]
        return shapely.union_all(paths)


def layers_of(code):
    """The layers of each object by its name, lowest first; copies are name#1 ..."""
    found, name, x, y, last, relative = {}, None, 0.0, 0.0, 0.0, True
    top, height, kind = 0.0, 0.0, ""
    for line in code.splitlines():
        if line.startswith("; printing object "):
            whole = re.fullmatch(r"; printing object (.+?)(?: id:\d+ copy (\d+))?", line)
            name = whole[1] + (f"#{whole[2]}" if whole[2] not in (None, "0") else "")
        elif line.startswith("; stop printing object"):
            name = None
        elif line.startswith(";Z:"):
            top = float(line[3:])
        elif line.startswith(";HEIGHT:"):
            height = float(line[8:])
        elif line.startswith(";TYPE:"):
            kind = line[6:]
        elif line.startswith(("M82", "M83")):
            relative = line.startswith("M83")
        elif line.startswith("G92 E"):
            last = 0.0
        elif line.startswith("G1 "):
            words = {word[0]: float(word[1:]) for word in line.split(";")[0].split()[1:]}
            to = words.get("X", x), words.get("Y", y)
            given = words.get("E", 0.0 if relative else last)
            fed = given if relative else given - last
            last = given if "E" in words else last
            length = math.dist((x, y), to)
            if name and fed > 0 and length > 1e-4 and kind not in SKIPPED:
                # A bead is a rectangle with round sides: area = height (width - height (1 - pi / 4)).
                width = fed * FILAMENT_MM2 / length / height + height * (1 - math.pi / 4)
                layers = found.setdefault(name, {})
                layers.setdefault(round(top, 4), Layer(round(top, 4), height)).lines.append(((x, y), to, width))
            x, y = to
    return {name: [layers[z] for z in sorted(layers)] for name, layers in found.items()}


def section(mesh, z):
    """A solid's section at z, as a polygon."""
    solid = shapely.Polygon()
    for loop in mesh.slice(z).to_polygons():
        solid = solid.symmetric_difference(shapely.Polygon(loop).buffer(0))
    return solid
