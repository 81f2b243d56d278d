"""The map of one unit: its table against the solver, its figures against root finding, its picture, and refusals."""

import base64
import gzip
import json
import math
import re

import numpy as np
import pytest
from msgspec.structs import replace
from PIL import Image
from scipy import optimize

from tests.in_process import unitcad
from unitcad.attenuation.curve import contact
from unitcad.attenuation.inputs import tissue_medium
from unitcad.attenuation.layered import UniformDisc
from unitcad.attenuation.radial import panel_ends
from unitcad.catalogue import touch
from unitcad.errors import Refusal
from unitcad.estimate_inputs import answer_spec, estimate_input
from unitcad.export.field import contour_lines
from unitcad.skin_map import LARGEST_KB, amplitude, field_of, map_data, table_of, unit_map
from unitcad.validation import load

FLAT, AXIAL = (load("encapsulating", [f"motor.drive={drive}"]) for drive in ("flat", "axial"))
MAPS = {spec.motor.drive: unit_map(spec) for spec in (FLAT, AXIAL)}


def solved(spec, radii, rtol=1e-9):
    """u_r, u_theta and u_z over |u| at the edge, by the solver alone."""
    variant = estimate_input(spec)
    load_ = UniformDisc(variant.motor_diameter / 2, "tangential" if variant.drive == "flat" else "normal")
    found = tissue_medium(variant.tissue).response(
        load_, 2 * math.pi * variant.frequency.middle, np.append(radii, variant.diameter / 2), rtol=rtol
    )
    u = np.stack([np.broadcast_to(part, len(radii) + 1) for part in (found.u_r, found.u_theta, found.u_z)])
    return u[:, :-1] / np.linalg.norm(u[:, -1])


@pytest.mark.parametrize("spec", [FLAT, AXIAL], ids=["flat", "axial"])
def test_the_table_is_the_solver_at_100_random_points(spec):
    """40 of them next to the disc's edge, where the slope is infinite; the table as a page gets it."""
    kind = MAPS[spec.motor.drive].kinds[0]
    table, rng = table_of(json_kind(kind)), np.random.default_rng(7)
    disc = spec.motor.diameter_mm / 2e3
    near = disc + np.concatenate([rng.normal(0, 1e-4, 20), rng.normal(0, 1e-6, 20)])
    radii = np.concatenate([rng.uniform(0, table.reach, 60), near])
    exact = solved(spec, radii)
    assert np.max(np.abs(table.at(radii) - exact)) < 1e-6 * np.max(np.abs(exact))
    assert kind.error < 1e-6


def json_kind(kind):
    """The kind as it is after its way through JSON."""
    data = json.loads(json.dumps(map_data(MAPS[kind.drive])))["kinds"][0]
    return replace(kind, ends_mm=tuple(data["ends_mm"]), terms=tuple(map(tuple, data["terms"])))


def test_the_data_fit_a_page():
    assert all(len(json.dumps(map_data(made))) < 1000 * LARGEST_KB / 8 for made in MAPS.values())


def farthest(spec, share, own):
    """The last radius (mm) of a share, by root finding on the solver; own: bare skin, or an end of a unit's effect."""
    radius = spec.diameter_mm / 2

    def above(mm):
        factor = 1.0 if own is None else contact(spec.motor.drive, mm - radius)[own]
        return float(np.linalg.norm(solved(spec, np.array([1e-3 * mm]), 1e-8)[:, 0]) * factor - share)

    grid = np.arange(2.0, 121.0, 2.0)
    sizes = np.linalg.norm(solved(spec, 1e-3 * grid, 1e-6), axis=0)
    if own is not None:
        sizes = sizes * contact(spec.motor.drive, grid - radius)[own]
    last = np.flatnonzero(sizes > share)[-1]
    return optimize.brentq(above, grid[last], grid[last + 1], xtol=1e-6)


def test_the_two_figures_are_roots_of_the_solver():
    spec, kind, one = FLAT, MAPS["flat"].kinds[0], answer_spec(FLAT)
    um, low, high = touch()["forearm"].at(spec.estimate.frequency_hz)
    motor = spec.estimate.amplitude_um
    assert kind.felt_mm.value == pytest.approx(farthest(spec, um / (one.level * motor), None), abs=1e-3)
    assert kind.felt_mm.low == pytest.approx(farthest(spec, high / (one.low * motor), 0), abs=1e-3)
    assert kind.felt_mm.high == pytest.approx(farthest(spec, low / (one.high * motor), 1), abs=1e-3)
    assert kind.pitch_mm.value == pytest.approx(farthest(spec, 0.1, None), abs=1e-3)
    assert kind.pitch_mm.low == pytest.approx(farthest(spec, 0.1, 0), abs=1e-3)
    assert MAPS["axial"].kinds[0].pitch_mm.value == pytest.approx(farthest(AXIAL, 0.1, None), abs=1e-3)


def test_the_map_is_the_table_around_the_unit():
    """A flat motor's force turns, so |u| is alike at every angle, and the unit's edge has its level."""
    made = MAPS["flat"]
    angle = np.linspace(0, 6, 25)
    whole, felt = amplitude(made, 7 * np.cos(angle), 7 * np.sin(angle))
    level = 1e-6 * FLAT.estimate.amplitude_um * answer_spec(FLAT).level
    assert whole == pytest.approx(np.full(25, 1e6 * level), rel=1e-6)
    assert felt == pytest.approx(whole / touch()["forearm"].at(125)[0])


def test_the_curve_of_touch_has_verrillos_slopes():
    curve = touch()["forearm"]
    at = {hertz: curve.at(hertz)[0] for hertz in (55, 110, 220, 440)}
    decibels = {hertz: 20 * math.log10(um / at[220]) for hertz, um in at.items()}
    assert decibels == pytest.approx({55: 24, 110: 12, 220: 0, 440: 9})
    assert curve.at(39.9) is None
    assert curve.at(701) is None
    assert curve.threshold_um.status == "assumed"
    assert "scilit" in curve.corner_hz.source


def test_a_contour_is_where_the_values_pass_the_limit():
    y, x = np.mgrid[0:60, 0:80]
    ends = contour_lines(np.hypot(x - 40.0, y - 30.0), 20.0)
    assert np.hypot(ends[..., 0] - 40, ends[..., 1] - 30) == pytest.approx(np.full(ends.shape[:2], 20.0), abs=0.01)
    length = np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).sum()
    assert length == pytest.approx(2 * math.pi * 20, rel=2e-3)
    assert contour_lines(np.ones((3, 3)), 2.0).shape == (0, 2, 2)


def test_the_picture_has_the_line_where_the_felt_radius_is():
    made = MAPS["flat"]
    field = field_of(made)
    values, limit, _ = field.contour
    x0, y0, x1, _ = made.box_mm
    step = (x1 - x0) / (values.shape[1] - 1)
    ends = contour_lines(values, limit) * step + [x0, y0]
    assert np.linalg.norm(ends, axis=-1) == pytest.approx(made.kinds[0].felt_mm.value, abs=0.05)


@pytest.mark.parametrize("form", ["svg", "png", "html"])
def test_the_command_writes_the_map_and_prints_both_figures(form, tmp_path):
    path = tmp_path / f"map.{form}"
    done = unitcad("estimate", "encapsulating", "--map", str(path), "--threshold", "2", "--share", "20")
    assert done.returncode == 0, done.stderr
    assert "Felt radius: 33 mm" in done.stdout
    assert "2 um, typed" in done.stdout
    assert "less than 20 % of the motion at its own edge: 28 mm" in done.stdout
    assert f"Map: {path}" in done.stdout
    if form == "svg":
        assert path.read_text().count("<image") == 2
        assert "Felt radius: 33 mm" in path.read_text()
    elif form == "html":
        (packed,) = re.findall(r'id="data">([^<]+)<', path.read_text())
        data = json.loads(gzip.decompress(base64.b64decode(packed)))["skin_map"]
        typed = {"um": dict.fromkeys(("value", "low", "high"), 2.0), "site": "", "status": "typed", "source": "typed"}
        assert data["kinds"][0]["threshold"] == typed
        assert "WebGLRenderer" not in path.read_text()
        assert path.stat().st_size < 100_000
    else:
        picture = np.asarray(Image.open(path))
        assert (picture == (255, 106, 19)).all(axis=-1).sum() > 500


def test_json_has_the_figures_without_the_tables(tmp_path):
    done = unitcad("estimate", "encapsulating", "--json", "--map", str(tmp_path / "map.svg"))
    (kind,) = json.loads(done.stdout)["map"]["kinds"]
    assert kind["felt_mm"]["value"] == pytest.approx(MAPS["flat"].kinds[0].felt_mm.value)
    assert kind["threshold"]["status"] == "assumed"
    assert "terms" not in kind


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["encapsulating", "--map", "a.pdf"], "must end with .svg, .png or .html; nearest accepted: 'a.svg'"),
        (["encapsulating", "embedded", "--map", "a.svg"], "is a picture of one SPEC"),
        (["encapsulating", "--threshold", "2"], "is for the map: give --map FILE"),
        (["encapsulating", "--map", "a.svg", "--threshold", "0"], "--threshold"),
    ],
)
def test_a_wrong_request_is_refused(words, told):
    done = unitcad("estimate", *words)
    assert done.returncode == 2
    assert told in done.stderr


def test_what_is_not_known_is_said():
    """A frequency outside the curve, a tissue without one, a unit without a level."""
    slow, gel = (unit_map(load("encapsulating", [f"estimate.{c}"])) for c in ("frequency_hz=30", "tissue=gel-50kpa"))
    dome = unit_map(load("custom/dome"))
    assert "from 40 to 700 Hz" in slow.lines[0]
    assert "no curve of touch is known for the tissue gel-50kpa" in gel.lines[0]
    reason = "the rule knows embedded and encapsulating units only"
    assert dome.lines[0] == f"No felt radius, since there is no level at the edge: {reason}."
    assert MAPS["axial"].lines[0].endswith("no level at the edge: the range is too wide.")
    assert not dome.absolute
    assert field_of(dome).contour is None
    assert field_of(dome).unit == "of the edge"
    assert all("Least pitch" in made.lines[1] for made in (slow, gel, dome))


def test_waves_that_do_not_die_have_no_last_radius():
    """An undamped tissue: at the table's end the motion still passes the share, and a later crest may too."""
    layers = {"a": {"thickness_mm": 2, "youngs_modulus_kpa": 20}, "b": {"youngs_modulus_kpa": 30}}
    sets = [
        *(f"tissue.mine.{name}.{key}={value}" for name, layer in layers.items() for key, value in layer.items()),
        *(f"tissue.mine.{name}.{key}" for name in layers for key in ("density_kg_m3=1000", "poisson_ratio=0.49")),
        "estimate.tissue=mine",
    ]
    made = unit_map(load("encapsulating", sets))
    assert made.kinds[0].pitch_mm.value is None
    assert "beyond the map" in made.lines[1]
    assert made.kinds[0].error < 1e-6


def test_waves_too_short_for_a_map_are_refused_with_a_frequency_that_is_taken():
    with pytest.raises(Refusal, match="its waves are too short for a map of this size") as told:
        unit_map(FLAT, 4000.0)
    assert told.value.field == "estimate.frequency_hz"
    slowest, disc = 1.6, FLAT.motor.diameter_mm / 2e3
    width = 4.8 * slowest / (2 * math.pi * told.value.nearest)
    assert 600 < told.value.nearest < 2000
    assert len(panel_ends(disc, 0.121, width)) <= 160
