"""The procedure's pictures: one for each step that names one, each piece seen, the same bytes each time."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from unitcad.casting.bench_pictures import SIZE, pictures
from unitcad.casting.bench_views import ARROW, View, picture_path, views
from unitcad.casting.procedure import Procedure, procedure
from unitcad.export import composite
from unitcad.kernels.mesh import arrays, realise
from unitcad.moulds.mould_set import MouldSet
from unitcad.pipeline.build import build
from unitcad.shape import box, moved
from unitcad.validation import load, templates

SETS = [
    *((name,) for name in templates()),
    ("encapsulating", "moulds.pour=injected", "moulds.cavities=[2,2]"),
    ("three-layer", "moulds.printer=sla"),
]


def planned(*source: str) -> tuple[MouldSet, Procedure]:
    moulds = MouldSet(load(source[0], list(source[1:])))
    return moulds, procedure(moulds, [100.0] * len(moulds.plan.steps), 1000.0)


@pytest.mark.parametrize("source", SETS, ids=" ".join)
def test_every_picture_is_asked_for_and_every_one_asked_for_is_drawn(source: tuple[str, ...]) -> None:
    moulds, casting = planned(*source)
    steps = [*casting.preparation, *(step for pour in casting.pours for step in pour.steps)]
    steps += [*casting.release, *casting.assembly]
    assert {step.picture for step in steps if step.picture} == {picture_path(name) for name in views(moulds)}


@pytest.mark.parametrize("source", SETS, ids=" ".join)
def test_views_name_pieces_that_there_are(source: tuple[str, ...]) -> None:
    moulds, _ = planned(*source)
    plan = moulds.plan
    tools = {body.name for body in (*plan.tools, *plan.steps[-1].inserts)} | {step.name for step in plan.steps}
    for name, view in views(moulds).items():
        known = {body.name for body in moulds.unit} if view.group == "unit" else tools
        assert {part.name for part in view.parts} <= known, name


def seen(content: bytes) -> np.ndarray:
    return np.asarray(Image.open(io.BytesIO(content)).convert("RGB")).astype(int)


def hues(content: bytes, colour: tuple[float, float, float]) -> int:
    """How many pixels have the hue of a colour, light or dark."""
    pixels = seen(content).reshape(-1, 3)
    own = np.array(colour) / np.linalg.norm(colour)
    bright = np.linalg.norm(pixels, axis=1)
    return int((((pixels @ own) > 0.9995 * bright) & (bright > 60)).sum())


def test_pictures_show_what_their_views_hold_and_repeat_to_the_byte() -> None:
    moulds, _ = planned("encapsulating")
    drawn, shown = pictures(moulds), views(moulds)
    assert drawn == pictures(MouldSet(moulds.spec))
    for name, view in shown.items():
        content = drawn[picture_path(name)]
        assert Image.open(io.BytesIO(content)).size == SIZE
        arrows = any(extra.colour == ARROW for extra in view.extras)
        assert (hues(content, ARROW) > 30) == arrows, name
    tongue = next(tool.colour for tool in moulds.plan.tools if tool.kind == "tongue")
    there = {name for name in shown if hues(drawn[picture_path(name)], tongue) > 100}
    assert there == {name for name, view in shown.items() if any(part.name == "tongue" for part in view.parts)}


def test_a_nearer_body_hides_one_behind_it_whatever_the_order() -> None:
    eye, points = (0.0, -1.0, 0.0), np.array([[-2.0, -2.0, -2.0], [2.0, 2.0, 2.0]])
    camera = composite.view(eye, points, (40, 40))

    def drawn(y: float, colour: tuple[float, float, float]) -> composite.DrawnBody:
        vertices, faces = arrays(realise(moved(box(-1, 1, -0.5, 0.5, -1, 1), y=y), 32))
        return composite.drawn(np.asarray(vertices), np.asarray(faces), colour, camera)

    near, far = drawn(-1, (1, 0, 0)), drawn(1, (0, 1, 0))
    one, other = composite.together([near, far], camera), composite.together([far, near], camera)
    assert one == other
    red, green, blue = seen(one)[20, 20]
    assert red > 200
    assert green == blue == 0
    assert (seen(composite.together([far], camera))[20, 20] == [0, red, 0]).all()
    assert (seen(one)[1, 1] == 255).all()


def test_a_build_writes_the_pictures_and_names_them(tmp_path: Path) -> None:
    done = build(load("embedded"), tmp_path, only=("casting",), check=False)
    text = (done.folder / "casting.md").read_text("utf-8")
    listed = {path for path in done.manifest["files"] if path.startswith("steps/")}
    assert listed
    assert all(f"]({path})" in text and (done.folder / path).is_file() for path in listed)


def test_a_view_is_data() -> None:
    """Nothing is meshed to name the pictures."""
    assert all(isinstance(view, View) for view in views(planned("encapsulating")[0]).values())
