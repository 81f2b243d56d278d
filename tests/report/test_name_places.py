"""Names in pictures: none over another one or over a part, each with a leader to what it names."""

from __future__ import annotations

import pickle
import subprocess
import sys
from itertools import combinations, product, starmap
from pathlib import Path

import numpy as np
import pytest

from unitcad.export.name_places import EDGE_PX, Box, Label, nearest_free, overlap, place
from unitcad.pipeline.scenes import exploded, unit_cut_open
from unitcad.pipeline.variant import Variant
from unitcad.validation import templates

NAME = (90.0, 30.0)
ROOT = Path(__file__).parents[2]


def blocks(*boxes: tuple[int, int, int, int]) -> np.ndarray:
    """A picture of 600 by 400 pixels with a part a box (left, right, bottom, top), later ones before earlier ones."""
    owner = np.full((400, 600), -1)
    for part, (left, right, bottom, top) in enumerate(boxes):
        owner[bottom:top, left:right] = part
    return owner


def faults(owner: np.ndarray, boxes: dict[int, Box], ends: dict[int, tuple[float, float] | None]) -> list[str]:
    """What is wrong with names at `boxes` whose leaders end at `ends`."""
    height, width = owner.shape
    found = [f"{a} over {b}" for a, b in combinations(boxes, 2) if overlap(boxes[a], boxes[b])]
    for part, (left, right, bottom, top) in boxes.items():
        if left < 0 or bottom < 0 or right > width or top > height:
            found.append(f"{part} off the page")
        if (owner[max(round(bottom), 0) : round(top), max(round(left), 0) : round(right)] >= 0).any():
            found.append(f"{part} over a part")
        end = ends[part]
        if (end is None) != (not (owner == part).any()) or (end and owner[round(end[1]), round(end[0])] != part):
            found.append(f"{part}'s leader ends elsewhere")
    return found


def judged(owner: np.ndarray, labels: dict[int, Label]) -> list[str]:
    return faults(owner, {i: label.box for i, label in labels.items()}, {i: label.end for i, label in labels.items()})


@pytest.mark.parametrize("boxes", [
    [(150, 500, 100, 110), (150, 500, 112, 122), (150, 500, 124, 134), (150, 300, 0, 20)],
    [(150, 500, i, i + 3) for i in range(0, 40, 4)],
    [(150, 500, 396 - i, 399 - i) for i in range(0, 40, 4)],
    [(150, 420, 0, 180), (150, 420, 200, 400), (420, 590, 185, 195)],
    [(150, 200, 100, 200), (150, 200, 100, 200)],
    [(150, 400, 50, 350), (200, 350, 100, 300), (250, 300, 150, 200)],
])  # fmt: skip
def test_names_meet_neither_each_other_nor_a_part(boxes: list[tuple[int, int, int, int]]) -> None:
    owner = blocks(*boxes)
    labels = place(owner, dict.fromkeys(range(len(boxes)), NAME))
    assert judged(owner, labels) == []
    assert set(labels) == set(range(len(boxes)))


def test_what_stands_out_to_the_right_is_named_there() -> None:
    owner = blocks((150, 400, 100, 300), (400, 560, 190, 205))
    labels = place(owner, {0: NAME, 1: NAME})
    assert labels[0].box[1] < 150
    assert labels[1].box[0] > 400
    assert labels[1].box[1] <= 600 - EDGE_PX


def test_the_judge_sees_faults() -> None:
    owner = blocks((150, 400, 100, 300), (400, 560, 190, 205))
    end = (200.0, 200.0)
    assert faults(owner, {0: (0, 90, 10, 40), 1: (80, 100, 30, 50)}, {0: end, 1: end}) == [
        "0 over 1",
        "1's leader ends elsewhere",
    ]
    assert faults(owner, {0: (100, 160, 110, 140)}, {0: end}) == ["0 over a part"]
    assert faults(owner, {0: (-5, 90, 10, 40)}, {0: None}) == ["0 off the page", "0's leader ends elsewhere"]


CHILD = """
import pickle, sys
from unitcad.export import picture_child as child
answer = []
for size, eye, parts in pickle.load(sys.stdin.buffer):
    window, labels = child.staged(size, eye, parts)
    window.Render()
    renderer = window.GetRenderers().GetFirstRenderer()
    drawn = {}
    for prop in (renderer.GetViewProps().GetItemAsObject(i) for i in range(renderer.GetViewProps().GetNumberOfItems())):
        if prop.IsA("vtkTextActor"):
            box, at = [0.0] * 4, prop.GetPosition()
            prop.GetBoundingBox(renderer, box)
            drawn[prop.GetInput()] = (at[0] + box[0], at[0] + box[1], at[1] + box[2], at[1] + box[3])
    answer.append((child.owners(renderer, parts), labels, drawn))
sys.stdout.buffer.write(pickle.dumps(answer))
"""
SETS = [(name, []) for name in sorted(templates())] + [
    ("encapsulating", ["moulds.cavities=[2, 2]", 'moulds.pour="injected"']),
    ("encapsulating", ['moulds.printer="sla"']),
    ("templates/custom/strap-lugs.toml", []),
    ("templates/custom/film-closed.toml", []),
]


def test_names_in_the_pictures_of_all_templates() -> None:
    pytest.importorskip("vtkmodules", reason="pictures need VTK: pip install 'unitcad[cadquery]'")
    variants = [Variant.of(str(ROOT / name) if "/" in name else name, *changes) for name, changes in SETS]
    scenes = [draw(variant) for variant in variants for draw in (exploded, unit_cut_open)]
    request = pickle.dumps([(s.size, s.towards_eye, [vars(part) for part in s.parts]) for s in scenes])
    done = subprocess.run([sys.executable, "-c", CHILD], input=request, capture_output=True, check=False)
    if done.returncode < 0:
        pytest.skip("VTK can't draw here")
    assert done.returncode == 0, done.stderr.decode()
    for scene, (owner, labels, drawn) in zip(scenes, pickle.loads(done.stdout), strict=True):
        names = {i: part.label for i, part in enumerate(scene.parts) if part.label}
        assert set(labels) == set(names)
        assert set(drawn) == set(names.values())
        assert len(drawn) == len(names), "two parts of one name"
        assert judged(owner, labels) == [], names
        # As the letters are drawn, by VTK's own count.
        lettering = {i: drawn[name] for i, name in names.items()}
        assert faults(owner, lettering, {i: label.end for i, label in labels.items()}) == [], names


@pytest.mark.parametrize("parts", [0, 3, 9, 200])
def test_a_name_takes_the_nearest_place_that_covers_least(parts):
    """Counted pixel by pixel over every place, in pictures from empty to full."""
    rng = np.random.default_rng(parts)
    height, width = rng.integers(80, 400, 2)
    drawn = np.zeros((height, width), bool)
    for _ in range(parts):
        y, x = rng.integers(0, height), rng.integers(0, width)
        drawn[y : y + rng.integers(1, height), x : x + rng.integers(1, width)] = True
    x, y = rng.uniform(0, width), rng.uniform(0, height)
    wide, high = rng.integers(10, 60, 2)

    def cost(left, top):
        covered = drawn[top - 6 : top + high + 6, left - 6 : left + wide + 6].sum()
        return np.hypot(max(left - x, x - left - wide, 0.0), max(top - y, y - top - high, 0.0)) + 1e6 * covered

    places = product(range(8, width - 8 - wide + 1, 2), range(8, height - 8 - high + 1, 2))
    assert cost(*nearest_free(drawn, (x, y), (wide, high))) == min(starmap(cost, places))
