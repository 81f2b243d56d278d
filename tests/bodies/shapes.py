"""Bodies that are hard to cast, as code: text, cones, flares, ribs, chamfers, tori, shells; and the way of each."""

HEAD = """
import math
from unitcad.shape import *
from unitcad.shape.lettering import engraving
Q = math.tan(math.pi / 8)
def disc(r=7, z0=0, z1=4): return cylinder(r, z0, z1)
def cone(r0, r1, z0, z1): return Revolve(polygon(*dict.fromkeys([(0, z0), (r0, z0), (r1, z1), (0, z1)])))
def torus(R, r, z): return Revolve(Profile(((R + r, z, Q), (R, z + r, Q), (R - r, z, Q), (R, z - r, Q))))
def ball(r, z): return Revolve(Profile(((0, z - r, Q), (r, z, Q), (0, z + r, 0.0))))
def text(letters, s, z0, z1):
    return moved(engraving(letters, s, z0, z1), -(len(letters) * 4 - 1) * s / 2, -2.5 * s)
"""
LIFTS, TRAY, TURNED = "", "as drawn: one tray", "upside down: one tray"
HALVES, SIDES = "parted level", "side pieces"
BODIES = {
    "text raised": ('union([disc(), text("A8", .8, 3.5, 4.6)])', TURNED),
    "thin text raised": ('union([disc(), text("A8F", .3, 3.5, 4.3)])', TURNED),
    "text engraved": ('cut(disc(), [text("L8", .8, 3.4, 5)])', TURNED),
    "thin text engraved": ('cut(disc(), [text("L80", .2, 3.6, 5)])', TURNED),
    "text engraved below": ('cut(disc(), [text("E5", .8, -1, .6)])', LIFTS),
    "text raised below": ('union([moved(disc(), z=.5), text("E5", .8, 0, .6)])', LIFTS),
    "text on a side": ('union([disc(7, 0, 6), moved(turned(text("A", .7, 0, 1), "x", 1), 0, -6.5, 3)])', TRAY),
    "cone, wide above": ("cone(5, 7, 0, 4)", TRAY),
    "cone, wide below": ("cone(7, 5, 0, 4)", LIFTS),
    "cone, wide above, with a pocket": ("cut(cone(5, 7, 0, 4), [cylinder(3.5, -1, 2)])", TRAY),
    "cone to a point": ("cone(7, 0, 0, 5)", TURNED),
    "cone under a lip": ("union([cone(7, 4, 0, 3), cylinder(6, 3, 4)])", SIDES),
    "flare below": ("Revolve(Profile(((0, 0, 0), (7, 0, -Q), (4, 3, 0), (4, 5, 0), (0, 5, 0))))", LIFTS),
    "flare above": ("Revolve(Profile(((0, 0, 0), (4, 0, 0), (4, 2, -Q), (7, 5, 0), (0, 5, 0))))", TRAY),
    "hourglass": ("union([cone(6, 3, 0, 3), cone(3, 6, 3, 6)])", SIDES),
    "barrel": ("union([cone(4, 6, 0, 3), cone(6, 4, 3, 6)])", HALVES),
    "ribs upright": (
        'union([disc(5, 0, 5), *[rotated(box(4, 7, -.5, .5, 0, 5), "z", 60 * i) for i in range(6)]])',
        LIFTS,
    ),
    "ribs round": ("union([disc(5, 0, 6), *[cylinder(6, 1 + 2 * i, 2 + 2 * i) for i in range(2)]])", HALVES),
    "ribs above": ("union([disc(), *[box(-5, 5, 2 * i - .3, 2 * i + .3, 3, 5) for i in (-1, 0, 1)]])", TURNED),
    "grooves below": ("cut(disc(), [box(-20, 20, 2 * i - .5, 2 * i + .5, -1, 1) for i in (-1, 0, 1)])", LIFTS),
    "chamfer above": ("Revolve(polygon((0, 0), (7, 0), (7, 3), (6, 4), (0, 4)))", LIFTS),
    "chamfer below": ("Revolve(polygon((0, 0), (6, 0), (7, 1), (7, 4), (0, 4)))", TRAY),
    "torus": ("torus(5, 2, 2)", HALVES),
    "torus with flats": ("Common((torus(5, 2, 1.5), box(-9, 9, -9, 9, 0, 3)))", HALVES),
    "half a torus": ("Common((torus(5, 2, 0), box(-9, 9, -9, 9, 0, 3)))", TURNED),
    "ball": ("ball(5, 5)", HALVES),
    "half a ball": ("Common((ball(6, 0), box(-9, 9, -9, 9, 0, 9)))", TURNED),
    "bowl": ("cut(disc(7, 0, 6), [ball(6, 7)])", TURNED),
    "shell, open above": ("cut(disc(7, 0, 6), [cylinder(6, 1, 9)])", TURNED),
    "shell, open below": ("cut(disc(7, 0, 6), [cylinder(6, -1, 5)])", LIFTS),
    "hole across": ('cut(disc(7, 0, 6), [moved(turned(cylinder(1, -9, 9), "x", 1), z=3)])', HALVES),
    "pins": (
        "union([box(-6, 6, -4, 4, 0, 2), *[moved(cylinder(.6, 1.5, 4), x, y) for x in (-4, 4) for y in (-2, 2)]])",
        TURNED,
    ),
    "stairs": ("union([box(-6, 6, -5, 5, 0, 1), box(-6, 2, -5, 5, 0, 2), box(-6, -2, -5, 5, 0, 4)])", TURNED),
    "tilted box": ('moved(rotated(box(-4, 4, -4, 4, -2, 2), "x", 20), z=4)', "+x up: one tray"),
    "tilted cylinder": ('moved(rotated(cylinder(3, -4, 4), "y", 30), z=6)', HALVES),
    "cones on a disc": ("union([disc(), *[moved(cone(.8, 0, 4, 6), x, 0) for x in (-4, 0, 4)]])", TURNED),
    "dimples": ("cut(disc(), [moved(ball(1.5, 4), x, 0) for x in (-4, 0, 4)])", TURNED),
    "dovetail": (
        "cut(disc(7, 0, 5), [box(-1, 1, -9, 9, 4, 6), Extrude(polygon((-1.5, -9), (1.5, -9), (1.5, 9), (-1.5, 9)), 2.5, 4,"
        " top=polygon((-1, -9), (1, -9), (1, 9), (-1, 9)))])",
        HALVES,
    ),
    "thimble": (
        "cut(union([cone(8, 7, 0, 8), Common((ball(7, 8), box(-9, 9, -9, 9, 8, 20)))]),"
        " [cone(6.5, 5.5, -1, 8), ball(5.5, 8)])",
        HALVES,
    ),
    "bellows": (
        "cut(union([cone(4, 6, 2 * i, 2 * i + 1) for i in range(3)] + [cone(6, 4, 2 * i + 1, 2 * i + 2)"
        " for i in range(3)]), [cylinder(3, -1, 9)])",
        SIDES,
    ),
    "suction cup": (
        "cut(union([cone(8, 3, 0, 4), cylinder(3, 4, 7), cylinder(5, 7, 9)]), [cone(7, 2, -.5, 3.5)])",
        SIDES,
    ),
    "dumbbell": ("union([ball(4, 4), cylinder(1.5, 4, 16), ball(4, 16)])", HALVES),
    "ring with pegs": (
        'union([ring(5, 7, 0, 3), *[rotated(moved(turned(cylinder(.8, 6, 9), "y", 1), z=1.5), "z", 45 * i)'
        " for i in range(8)]])",
        HALVES,
    ),
    "elbow": ('union([cylinder(2, 0, 10), moved(turned(cylinder(2, 0, 10), "y", 1), z=10), ball(2, 10)])', HALVES),
    "knob": ("union([cylinder(2, 0, 6), torus(3, 1.5, 7)])", HALVES),
    "dimples on four sides": (
        'cut(union([cylinder(5, 0, 8), cylinder(6, 0, 1)]), [rotated(moved(ball(1.5, 0), 5, 0, 5), "z", 90 * i)'
        " for i in range(4)])",
        "four side pieces",
    ),
}
"""Each body, and the way in which it is cast: part of the plan's words, "" for a cup that lifts off."""
QUICK = (
    "text raised", "text engraved", "cone, wide above", "cone to a point", "barrel", "ribs round", "chamfer below",
    "torus", "ball", "hole across", "shell, open above", "thimble", "bellows", "dimples on four sides",
)  # fmt: skip
REFUSED = {
    "closed hollow": ("cut(disc(7, 0, 6), [cylinder(5, 1, 5)])", "a hollow of 314 mm3 .* is closed all round"),
    "thin tube, standing": ("ring(6.7, 7, 0, 6)", "no mould was found; tried as drawn, a cup that lifts off: .*; "),
    "pins across holes": (
        "cut(box(-8, 8, -8, 8, 0, 2), [moved(cylinder(1, -1, 3), x, y) for x in (-5, 0, 5) for y in (-5, 0, 5)]"
        ' + [moved(turned(cylinder(.3, -9, 9), "y", 1), z=1)])',
        "no mould was found; tried as drawn",
    ),
    "touching along an edge": ("union([box(-4, 0, -4, 0, 0, 3), box(0, 4, 0, 4, 0, 3)])", "touch along an edge only"),
}
