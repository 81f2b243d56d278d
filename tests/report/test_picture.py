"""Shaded pictures: what they show, and what happens on a machine that can't draw."""

from __future__ import annotations

import io
import json
import math
import os
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from unitcad.export import picture
from unitcad.export.picture import Drawn, NoPicture, Scene, draw
from unitcad.kernels.mesh import arrays, realise
from unitcad.pipeline.scenes import moments, pictures, taken_apart, unit_apart
from unitcad.pipeline.variant import Variant
from unitcad.shape import box

pytest.importorskip("vtkmodules", reason="pictures need VTK: pip install 'unitcad[cadquery]'")
Image = pytest.importorskip("PIL.Image", reason="reading the pictures back needs Pillow")

RED, GREEN = (0.9, 0.1, 0.1), (0.1, 0.7, 0.1)
NO_DISPLAY = {**os.environ, "VTK_DEFAULT_OPENGL_WINDOW": "vtkXOpenGLRenderWindow"}
NO_DISPLAY.pop("DISPLAY", None)


def drawn(*shape: float, colour: tuple[float, float, float] = RED, label: str = "") -> Drawn:
    return Drawn(colour, *arrays(realise(box(*shape), 24)), label)


def pixels(png: bytes) -> np.ndarray:
    """(height, width, 3), 0 to 255."""
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB")).astype(int)


def like(image: np.ndarray, colour: tuple[float, float, float]) -> np.ndarray:
    """Where a pixel has the hue of `colour`, however lit: the angle between the two is under five degrees."""
    length = np.linalg.norm(image, axis=2)
    along = image @ (np.array(colour) / np.linalg.norm(colour))
    return (length > 60) & (along > math.cos(math.radians(5)) * length)


def test_a_picture_shows_its_parts_in_their_places() -> None:
    front = drawn(0, 10, -10, 0, 0, 10)
    above = drawn(0, 10, -10, 0, 12, 20, colour=GREEN)
    image = pixels(draw([Scene((front, above), (0, -1, 0.2), (300, 400))])[0])
    assert image.shape == (400, 300, 3)
    red, green = like(image, RED), like(image, GREEN)
    assert red.mean() > 0.1
    assert green.mean() > 0.1
    assert np.argwhere(green)[:, 0].mean() < np.argwhere(red)[:, 0].mean()
    # Nothing is cut off, and the drawing fills the picture: the border is white, its inside is not.
    border = np.concatenate([image[:3].reshape(-1, 3), image[-3:].reshape(-1, 3), image[:, 0], image[:, -1]])
    assert border.min() == 255
    rows = np.argwhere((image.min(axis=2) < 250).any(axis=1)).ravel()
    assert rows.max() - rows.min() > 0.85 * 400


def test_what_lies_behind_is_hidden() -> None:
    behind = drawn(2, 8, 5, 6, 2, 8, colour=GREEN)
    image = pixels(draw([Scene((drawn(0, 10, 0, 4, 0, 10), behind), (0, -1, 0), (200, 200))])[0])
    assert not like(image, GREEN).any()


def test_a_label_stands_left_of_the_parts() -> None:
    plain, named = draw(
        [Scene((drawn(0, 9, 0, 9, 0, 9, label=text),), (0.5, -1, 0.5), (400, 300)) for text in ("", "cup 1")]
    )
    left = pixels(named)[:, :110]
    assert (left.max(axis=2) < 120).sum() > 30
    assert like(pixels(plain), RED).sum() > like(pixels(named), RED).sum()


@pytest.mark.skipif(not shutil.which("Xvfb"), reason="no Xvfb on this machine")
def test_a_child_that_falls_is_followed_by_one_under_a_virtual_display(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("DISPLAY", "VTK_DEFAULT_OPENGL_WINDOW"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("VTK_DEFAULT_OPENGL_WINDOW", "vtkXOpenGLRenderWindow")
    scene = Scene((drawn(0, 1, 0, 1, 0, 1),), (0, -1, 0.3), (120, 100))
    assert like(pixels(draw([scene])[0]), RED).mean() > 0.1


def test_no_display_and_no_server_is_a_message(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.setenv("VTK_DEFAULT_OPENGL_WINDOW", "vtkXOpenGLRenderWindow")
    monkeypatch.setattr(picture, "shutil", SimpleNamespace(which=lambda name: None))
    with pytest.raises(NoPicture, match=r"libegl1.*xvfb"):
        draw([Scene((drawn(0, 1, 0, 1, 0, 1),), (0, -1, 0))])


def test_without_vtk_is_a_message(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(picture.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(NoPicture, match="cadquery"):
        draw([])


def test_build_goes_on_without_pictures_and_says_so(tmp_path: Path) -> None:
    environment = {**NO_DISPLAY, "PATH": str(Path(sys.executable).parent)}
    command = [sys.executable, "-c", "from unitcad.cli import main; main()", "build", "single-embedded"]
    done = subprocess.run(
        [*command, "-o", str(tmp_path), "--formats", "png", "--only", "unit", "--no-check"],
        env=environment, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "no pictures" in done.stderr
    assert "xvfb" in done.stderr
    folder = Path(done.stdout.splitlines()[-1])
    assert (folder / "section.svg").is_file()
    assert not list(folder.rglob("*.png"))
    left_out = json.loads((folder / "manifest.json").read_text("utf-8"))["left_out"]
    assert "pictures" in [one["what"] for one in left_out]


def test_every_picture_of_the_encapsulating_unit() -> None:
    variant = Variant.of("encapsulating")
    scenes = {path: scene() for path, scene in pictures(variant).items()}
    assert list(scenes) == ["unit.png", "moulds/exploded.png", "moulds/step1.png", "moulds/step2.png"]
    images = dict(zip(scenes, draw(list(scenes.values())), strict=True))
    blue, green = variant.unit[0].colour, variant.unit[1].colour
    tongue = variant.plan.tool("tongue").colour
    for name, image in images.items():
        assert len(image) < 250_000, name
        shades = pixels(image)
        assert like(shades, blue).sum() > 1000 or name == "moulds/exploded.png", name
        assert (shades == 255).all(axis=2).mean() > 0.2, name
    # Layer 2 is there in the second pour and not in the first; the tongue in both.
    assert like(pixels(images["moulds/step1.png"]), green).sum() == 0
    assert like(pixels(images["moulds/step2.png"]), green).sum() > 1000
    for step in ("moulds/step1.png", "moulds/step2.png"):
        assert like(pixels(images[step]), tongue).sum() > 500


def test_moments_of_casting() -> None:
    parts = {moment.title: moment.parts for moment in moments(Variant.of("encapsulating"))}
    assert list(parts.values()) == [
        ("base", "stub"),
        ("base", "stub", "cup1"),
        ("base", "stub", "cup1", "tongue"),
        ("base", "stub", "layer1", "cup1", "tongue"),
        ("base", "stub", "layer1", "cup1"),
        ("base", "stub", "layer1"),
        ("base", "stub", "layer1", "cup2"),
        ("base", "stub", "layer1", "cup2", "tongue"),
        ("base", "stub", "layer1", "layer2", "cup2", "tongue"),
        ("base", "stub", "layer1", "layer2", "cup2"),
        ("base", "stub", "layer1", "layer2"),
        ("layer1", "layer2", "motor", "fpcb"),
    ]


@pytest.mark.parametrize("name", ["embedded", "three-layer", "chain"])
def test_taken_apart_nothing_meets(name: str) -> None:
    variant = Variant.of(name)
    for offsets, bodies in (
        (taken_apart(variant), (*variant.unit, *variant.plan.tools)),
        (unit_apart(variant), variant.unit),
    ):
        solids = {b.name: variant.mesh(b).translate(offsets[b.name]) for b in bodies if b.name in offsets}
        names = sorted(solids)
        for i, one in enumerate(names):
            for other in names[i + 1 :]:
                assert (solids[one] ^ solids[other]).volume() == 0, (one, other)
