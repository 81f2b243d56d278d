"""Tools of resin: wells against exact volumes and a flood fill, and the words of the sheet."""

import math
import re

import numpy as np
import prusa
import pytest
from faulty_sets import set_of
from manifold3d import Manifold
from scipy import ndimage

from unitcad import catalogue
from unitcad.casting.plates import mould_plates
from unitcad.casting.preparation import slicer_settings
from unitcad.casting.procedure import procedure
from unitcad.casting.resin import ATMOSPHERE, wells
from unitcad.moulds.mould_set import MouldSet
from unitcad.pipeline.plan import threemf_content
from unitcad.validation import from_data, read

LAYER = 0.1
BLOCK = Manifold.cube((20, 20, 6)).translate((-10, -10, 0))


def bore(radius, low=-1.0, high=7.0, x=0.0):
    return Manifold.cylinder(high - low, radius, radius, 200).translate((x, 0, low))


def slit(z0, z1, x0=0.0, x1=20.0, wide=2.0):
    return Manifold.cube((x1 - x0, wide, z1 - z0)).translate((x0, -wide / 2, z0))


AREA = 100 * math.sin(2 * math.pi / 200) * 9  # of a bore of radius 3


@pytest.mark.parametrize(
    ("piece", "volume", "area", "opens"),
    [
        (BLOCK - bore(3), 6 * AREA, AREA, 6.0),  # never opened: until it is done
        (BLOCK - bore(3) - slit(2, 3), 2 * AREA, AREA, 2.0),  # a window
        (BLOCK - bore(3, 2), 4 * AREA, AREA, 6.0),  # blind, open at the film
        (BLOCK - bore(3, high=1.5), 1.5 * AREA, AREA, 1.5),  # a pocket at the plate, roofed
        (BLOCK - bore(3) - slit(-1, 1), None, None, None),  # open from the first layer
        (BLOCK - bore(3, x=-5) - bore(3, x=5) - slit(4, 5, -5, 5), 2 * (6 * AREA) + 4 * 2, None, 6.0),
        # Two bores, joined by a slit that ends before the film; then one of them has a window above: both open there.
        (BLOCK - bore(3, x=-5) - bore(3, x=5) - slit(1, 2, -5, 5) - slit(4, 5, 5), None, None, 4.0),
        # A bore over an open slit is no well.
        (BLOCK - bore(3, 1) - slit(-1, 2), None, None, None),
    ],
)
def test_wells_are_those_of_the_geometry(piece, volume, area, opens):
    found = [well for well in wells(piece, LAYER) if well.volume_mm3 > 5]
    if opens is None:
        assert found == []
        return
    (well,) = found
    assert well.opens_mm == pytest.approx(opens, abs=LAYER / 2)
    if volume is not None:
        assert well.volume_mm3 == pytest.approx(volume, rel=0.06)
    if area is not None:
        assert well.area_mm2 == pytest.approx(area, rel=1e-3)
        assert well.force_n == pytest.approx(ATMOSPHERE * area, rel=1e-3)


def flooded(mesh, layer):
    """The largest hollow (mm3) that plate, walls and film close at any layer, by a flood fill of voxels."""
    x0, y0, z0, x1, y1, z1 = mesh.bounding_box()
    cell, count = 0.2, round((z1 - z0) / layer)
    xs, ys = np.arange(x0 - 3 * cell, x1 + 3 * cell, cell), np.arange(y0 - 3 * cell, y1 + 3 * cell, cell)
    solid = np.zeros((count, len(ys), len(xs)), bool)
    for i in range(count):
        loops = mesh.slice(z0 + (i + 0.5) * (z1 - z0) / count).to_polygons()
        for j, y in enumerate(ys):
            ends = [
                a[0] + (y - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
                for loop in loops
                for a, b in zip(loop, np.roll(loop, -1, axis=0), strict=True)
                if (a[1] <= y) != (b[1] <= y)
            ]
            solid[i, j] = np.searchsorted(np.sort(ends), xs) % 2 == 1
    largest = 0.0
    for i in range(count):
        if not solid[i].any():
            continue
        labels, _ = ndimage.label(~solid[: i + 1])
        sizes = np.bincount(labels.ravel())
        sizes[[0, labels[0, 0, 0]]] = 0
        for open_ in np.unique(np.concatenate([labels[:, 0].ravel(), labels[:, -1].ravel()])):
            sizes[open_] = 0
        largest = max(largest, sizes.max() * cell**2 * (z1 - z0) / count)
    return largest


def test_a_cup_s_well_is_that_of_a_flood_fill():
    moulds = set_of("encapsulating", "moulds.printer=sla")
    cup = moulds.mesh(moulds.plan.tool("cup2")).rotate((180, 0, 0))
    (well, *_) = wells(cup, 0.05)
    assert well.volume_mm3 == pytest.approx(flooded(cup, 0.2), rel=0.05)
    # The bore of 14 mm below the window.
    assert well.volume_mm3 == pytest.approx(math.pi * 49 * well.opens_mm, rel=0.02)


def texts(*source):
    casting = procedure(set_of(*source), (1.0, 1.0), 1.0)
    return " ".join(casting.printing.how), " ".join(step.text for step in casting.preparation)


def test_the_sheet_of_resin_tells_wells_wash_cure_and_a_way_out():
    plate, steps = texts("encapsulating", "moulds.printer=sla")
    assert re.search(r"cup 2 0\.3\d ml up to 2\.\d mm, held by at most 16 N", plate)
    for words in ("Expose as the resin's maker says", "level supports 3 mm high", "Let it drip"):
        assert words in plate
    for words in ("two baths of isopropanol", "bake at 60 degC", "acrylic varnish", "oomoo-25 (Shore 25A"):
        assert words in steps
    assert "no source gives its modulus" in steps
    plate, steps = texts("encapsulating")
    for words in ("Wells", "Expose", "oomoo"):
        assert words not in plate + steps


def test_an_own_silicone_of_tin_is_offered_with_its_modulus():
    own = {"our-tin": {"density_g_cm3": 1.1, "chemistry": "tin", "quasistatic_modulus_kpa": 90.0}}
    source = {**read("encapsulating"), "moulds": {"printer": "sla"}, "materials": own}
    casting = procedure(MouldSet(from_data(source)), (1.0, 1.0), 1.0)
    assert "our-tin (static modulus 90 kPa)" in " ".join(step.text for step in casting.preparation)


def test_resin_is_no_surface_to_keep_away():
    ecoflex = catalogue.materials()["ecoflex-00-30"]
    assert catalogue.surface_contact(ecoflex, catalogue.RESIN).remedy
    assert catalogue.RESIN not in catalogue.inhibitors([ecoflex])


@pytest.mark.slicer
@pytest.mark.skipif(prusa.PROGRAM is None, reason="PrusaSlicer is not installed")
def test_the_plate_s_settings_replace_those_of_the_user_s_resin_printer(tmp_path):
    moulds = set_of("single-encapsulating", "moulds.printer=sla")
    (plate,) = mould_plates(moulds).values()
    user, made = tmp_path / "user.ini", []
    user.write_text("printer_technology = SLA\nlayer_height = 0.1\ninitial_layer_height = 0.05\nsupports_enable = 1\n")
    for settings in (slicer_settings(moulds), {}):
        file, out = tmp_path / "plate.3mf", tmp_path / "plate.sl1"
        file.write_bytes(threemf_content(moulds, plate, settings))
        prusa.run("--export-sla", "--load", user, "--output", out, file)
        made.append(out.read_bytes().count(b".png"))
    z = [moulds.mesh_of(body.shape).bounding_box() for body in plate]
    layers = max(each[5] - each[2] for each in z) / 0.05
    assert made[0] / 2 == pytest.approx(layers, abs=3)  # a name stands twice in an archive
    assert made[1] < 0.8 * made[0]
