"""Shaded pictures of a unit, its moulds and their pours: what they show."""

import io
import json
import math

import numpy as np
import pytest
from PIL import Image

from unitcad.api.variant import Variant
from unitcad.export.raster import Surface, draw
from unitcad.kernels.mesh import arrays, realise
from unitcad.pipeline.scenes import exploded_moves, moments, pictures, unit_apart
from unitcad.pipeline.write import build
from unitcad.shape import box
from unitcad.validation import load

RED, GREEN = (0.9, 0.1, 0.1), (0.1, 0.7, 0.1)


def drawn(*shape, colour=RED, label=""):
    return Surface(*arrays(realise(box(*shape), 24)), colour, label)


def pixels(png):
    """(height, width, 3), 0 to 255."""
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB")).astype(int)


def like(image, colour):
    """Where a pixel has the hue of `colour`, however lit: the angle between the two is under five degrees."""
    length = np.linalg.norm(image, axis=2)
    along = image @ (np.array(colour) / np.linalg.norm(colour))
    return (length > 60) & (along > math.cos(math.radians(5)) * length)


def test_a_picture_shows_its_parts_in_their_places():
    front = drawn(0, 10, -10, 0, 0, 10)
    above = drawn(0, 10, -10, 0, 12, 20, colour=GREEN)
    image = pixels(draw([front, above], (0, -1, 0.2), (300, 400)))
    assert image.shape[1] == 300
    assert image.shape[0] <= 400
    red, green = like(image, RED), like(image, GREEN)
    assert red.mean() > 0.1
    assert green.mean() > 0.1
    assert np.argwhere(green)[:, 0].mean() < np.argwhere(red)[:, 0].mean()
    # Nothing is cut off, and the drawing fills the picture: the border is white, its inside is not.
    border = np.concatenate([image[:3].reshape(-1, 3), image[-3:].reshape(-1, 3), image[:, 0], image[:, -1]])
    assert border.min() == 255
    rows = np.argwhere((image.min(axis=2) < 250).any(axis=1)).ravel()
    assert rows.max() - rows.min() > 0.85 * 400


def test_the_same_surfaces_give_the_same_bytes_and_an_empty_one_is_left_out():
    parts = [drawn(0, 9, 0, 9, 0, 9, label="cup 1"), drawn(2, 3, 2, 3, 9, 12, colour=GREEN)]
    nothing = Surface(np.empty((0, 3)), np.empty((0, 3), np.int64), GREEN, "nothing")
    assert draw(parts, (0.5, -1, 0.5), (400, 300)) == draw([*parts, nothing], (0.5, -1, 0.5), (400, 300))


def test_a_build_draws_the_pictures_that_png_asks_for(tmp_path):
    done = build(load("single-embedded", ['output.formats=["png"]']), tmp_path, only=("unit", "moulds"), check=False)
    manifest = json.loads((done.folder / "manifest.json").read_text("utf-8"))
    assert manifest["pictures"] == ["unit.png", "moulds/exploded.png", "moulds/step1.png"]
    written = {path: (done.folder / path).read_bytes() for path in manifest["pictures"]}
    assert written == {path: picture() for path, picture in pictures(Variant.of("single-embedded")).items()}


def test_every_picture_of_the_encapsulating_unit():
    variant = Variant.of("encapsulating")
    images = {path: picture() for path, picture in pictures(variant).items()}
    assert list(images) == ["unit.png", "moulds/exploded.png", "moulds/step1.png", "moulds/step2.png"]
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


def test_moments_of_casting():
    parts = {moment.title: moment.parts for moment in moments(Variant.of("encapsulating"))}
    assert list(parts.values()) == [
        ("base", "filament"),
        ("base", "filament", "cup1"),
        ("base", "filament", "cup1", "tongue"),
        ("base", "filament", "layer1", "cup1", "tongue"),
        ("base", "filament", "layer1", "cup1"),
        ("base", "filament", "layer1"),
        ("base", "filament", "layer1", "cup2"),
        ("base", "filament", "layer1", "cup2", "tongue"),
        ("base", "filament", "layer1", "layer2", "cup2", "tongue"),
        ("base", "filament", "layer1", "layer2", "cup2"),
        ("base", "filament", "layer1", "layer2"),
        ("layer1", "layer2", "motor", "fpcb"),
    ]


@pytest.mark.parametrize("name", ["embedded", "three-layer", "pass-through"])
def test_taken_apart_nothing_meets(name):
    variant = Variant.of(name)
    for offsets, bodies in (
        (exploded_moves(variant), (*variant.unit, *variant.plan.tools)),
        (unit_apart(variant), variant.unit),
    ):
        solids = {b.name: variant.mesh(b).translate(offsets[b.name]) for b in bodies if b.name in offsets}
        names = sorted(solids)
        for i, one in enumerate(names):
            for other in names[i + 1 :]:
                assert (solids[one] ^ solids[other]).volume() == 0, (one, other)
