"""The map of an array: against a direct superposition of the solver, which shares no code with it; and on a limb."""

import base64
import gzip
import json
import math
import re
import shutil
import subprocess
from importlib import resources

import numpy as np
import pytest
from msgspec.structs import replace

from tests.in_process import unitcad
from unitcad.arrays.array_file import load_array
from unitcad.arrays.array_map import array_map
from unitcad.attenuation import UniformDisc
from unitcad.attenuation.inputs import tissue_medium
from unitcad.errors import Refusal
from unitcad.estimate_inputs import answer_spec, estimate_input
from unitcad.pipeline.write import build as build_array
from unitcad.report import write_report
from unitcad.skin_map import amplitude, map_data, table_of

UNIT = {"like": "encapsulating", "fpcb": {"tail_length_mm": 1.0}}


def three(drive="flat", second="single-embedded", **tables):
    """Three units in a row that is not straight, the second of another kind."""
    place = [{"at": "P2", "unit": {**UNIT, "like": second, "motor": {"drive": drive}}}]
    layout = {"kind": "list", "points_mm": [[0.0, 0.0], [21.0, 5.0], [38.0, -8.0]]}
    return load_array(
        {"name": "three", "array": "pockets", "unit": {**UNIT, "motor": {"drive": drive}}, "layout": layout}
        | {"place": place, "sheet": {"thickness_mm": 1.5}, **tables}
    )


def direct(array, x, y, phases):
    """|u| (over one edge level) by two forces in quadrature along x and y, or one along z, in Cartesian axes."""
    total = np.zeros((len(x), 3), dtype=complex)
    for place in array.places:
        if place.name not in phases:
            continue
        variant = estimate_input(place.unit)
        medium, omega, a = tissue_medium(variant.tissue), 2 * math.pi * variant.frequency.middle, variant.motor_diameter
        dx, dy = x - place.x, y - place.y
        r, theta = np.append(np.hypot(dx, dy), place.unit.diameter_mm / 2) * 1e-3, np.append(np.arctan2(dy, dx), 0.0)
        u = np.zeros((len(r), 3), dtype=complex)
        forces = [(1.0, 0.0), (-1j, math.pi / 2)] if variant.drive == "flat" else [(1.0, None)]
        for phase, axis in forces:
            direction = "normal" if axis is None else "tangential"
            found = medium.response(UniformDisc(a / 2, direction), omega, r, rtol=1e-9)
            out, around, up = found.u_r, found.u_theta, found.u_z
            if axis is not None:
                out, around, up = out * np.cos(theta - axis), around * np.sin(theta - axis), up * np.cos(theta - axis)
            u[:, 0] += phase * (out * np.cos(theta) - around * np.sin(theta))
            u[:, 1] += phase * (out * np.sin(theta) + around * np.cos(theta))
            u[:, 2] += phase * up
        total += np.exp(1j * math.radians(phases[place.name])) * u[:-1] / np.linalg.norm(u[-1])
    return np.linalg.norm(total, axis=1)


@pytest.mark.parametrize("drive", ["flat", "axial"])
def test_the_map_is_the_direct_sum_at_100_random_points(drive):
    """Without levels, so that every unit moves its edge by one."""
    array = three(drive)
    made = array_map(array)
    made = replace(made, kinds=tuple(replace(kind, edge_um=None) for kind in made.kinds))
    rng = np.random.default_rng(5)
    x, y = rng.uniform(*made.box_mm[::2], 100), rng.uniform(*made.box_mm[1::2], 100)
    phases = {"P1": 0.0, "P2": 130.0}
    for on in (phases, phases | {"P3": -75.0}):
        found, _ = amplitude(made, x, y, on)
        exact = direct(array, x, y, on)
        assert np.max(np.abs(found - exact)) < 1e-6 * np.max(exact)


def test_levels_weigh_the_units():
    array = three()
    made = array_map(array)
    for place in array.places:
        edge = np.array([place.x + place.unit.diameter_mm / 2]), np.array([place.y])
        alone, felt = amplitude(made, *edge, {place.name: 40.0})
        level = answer_spec(place.unit).level * place.unit.estimate.amplitude_um
        assert alone[0] == pytest.approx(level, rel=1e-6)
        assert felt[0] == pytest.approx(level / made.kinds[0].threshold.um.value, rel=1e-6)


def test_the_skin_around_a_limb_is_unrolled():
    """Units on a ring see each other the shorter way round; the map shows the limb once."""
    array = load_array("wrist-band")
    made = array_map(array)
    turn = 2 * math.pi * array.radius_mm
    assert made.wrap_mm == pytest.approx(turn)
    x0, _, x1, _ = made.box_mm
    assert x1 - x0 <= turn * (1 + 1e-12)
    name, seam = made.places[0].name, np.linspace(-40, 40, 9)
    left, _ = amplitude(made, np.full(9, x0), seam, {name: 0.0})
    right, _ = amplitude(made, np.full(9, x0 + turn), seam, {name: 0.0})
    assert left == pytest.approx(right, rel=1e-9)
    along = array.radius_mm / array.middle_radius_mm
    assert [place.x for place in made.places] == pytest.approx([along * place.x for place in array.places])


def test_motors_of_several_frequencies_add_without_phase():
    array = three(second="single-embedded", place=[{"at": "P2", "unit": {**UNIT, "estimate": {"frequency_hz": 150}}}])
    made = array_map(array)
    assert not made.synchronous
    at = np.array([10.0]), np.array([3.0])
    apart = [amplitude(made, *at, {name: 0.0})[0][0] for name in ("P1", "P2")]
    for phase in (0.0, 180.0):
        assert amplitude(made, *at, {"P1": 0.0, "P2": phase})[0][0] == pytest.approx(math.hypot(*apart))
    assert any("no phase lasts" in line for line in made.lines)


NODE = """
const fs = require("fs"), vm = require("vm");
const context = vm.createContext({ window: { unitcad: {} }, console });
vm.runInContext(fs.readFileSync(process.argv[2], "utf8"), context);
const { map, x, y, phases, shares } = JSON.parse(fs.readFileSync(process.argv[3], "utf8"));
const { motion, lastAbove, createField, amplitude, contour } = context.window.unitcad.skinMap;
const total = new Float64Array(6 * x.length), out = new Float64Array(6);
map.places.forEach((place) => {
  if (!(place.name in phases)) return;
  const [re, im] = [Math.cos(phases[place.name] * Math.PI / 180), Math.sin(phases[place.name] * Math.PI / 180)];
  x.forEach((_, i) => {
    motion(map, place, x[i], y[i], out);
    for (let k = 0; k < 6; k += 2) {
      total[6 * i + k] += re * out[k] - im * out[k + 1];
      total[6 * i + k + 1] += re * out[k + 1] + im * out[k];
    }
  });
});
const field = createField(map);
const sums = field.sums(map.places.map(({ name }) => ({ on: name in phases, phase: phases[name] || 0 })));
const limit = map.kinds[0].threshold.um.value;
console.log(JSON.stringify({
  amplitude: [...amplitude([total])],
  last: map.kinds.map((kind) => shares.map((share) => lastAbove(map, kind, share))),
  grid: [field.columns, field.rows, [...amplitude(sums)]],
  contour: contour(amplitude(sums, [limit]), field.columns, field.rows),
}));
"""


@pytest.mark.skipif(shutil.which("node") is None, reason="needs node")
def test_the_page_s_program_has_the_map_of_python(tmp_path):
    """Its motion at 100 random points, its last radii, its grid and its contour; the data through JSON."""
    made = array_map(three())
    rng = np.random.default_rng(11)
    x, y = rng.uniform(*made.box_mm[::2], 100), rng.uniform(*made.box_mm[1::2], 100)
    phases, shares = {"P1": 0.0, "P3": 250.0}, [0.5, 0.1, 40.0, 1e-9]
    asked = {"map": map_data(made), "x": x.tolist(), "y": y.tolist(), "phases": phases, "shares": shares}
    (tmp_path / "asked.json").write_text(json.dumps(asked))
    (tmp_path / "run.js").write_text(NODE)
    program = resources.files("unitcad.report") / "app" / "skinmap.js"
    run = ["node", str(tmp_path / "run.js"), str(program), str(tmp_path / "asked.json")]
    done = subprocess.run(run, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    expected, _ = amplitude(made, x, y, phases)
    assert np.max(np.abs(found["amplitude"] - expected)) < 1e-12 * expected.max()
    for kind, last in zip(made.kinds, found["last"], strict=True):
        assert last[:2] == pytest.approx([1e3 * table_of(kind).last_above(share) for share in shares[:2]], abs=1e-9)
        assert last[2:] == [0, None]
    columns, rows, values = found["grid"]
    x0, y0, x1, y1 = made.box_mm
    grid = np.meshgrid(np.linspace(x0, x1, columns), np.linspace(y0, y1, rows))
    whole, _ = amplitude(made, *grid, phases)
    assert np.array(values).reshape(rows, columns) == pytest.approx(whole, abs=1e-6 * whole.max())
    ends = np.array(found["contour"]).reshape(-1, 2) * [(x1 - x0) / (columns - 1), (y1 - y0) / (rows - 1)] + [x0, y0]
    _, felt = amplitude(made, *ends.T, phases)
    assert felt == pytest.approx(np.ones(len(ends)), rel=0.02)


def test_a_page_carries_the_map(tmp_path):
    """With crosstalk it has the section and at most 200 kB of data; without crosstalk, or with own code, no map."""
    pair = ["layout.columns=2", "layout.rows=1", "sheet.strap_slot_mm=[3, 10]", "output.formats=[]"]
    array = load_array("forearm-pockets", pair)
    folder = build_array(array, tmp_path, only=["unit", "estimate"], check=False).folder
    page = write_report(folder).read_text()
    assert "Motion of the skin" in page
    (packed,) = re.findall(r'id="data">([^<]+)<', page)
    data = json.loads(gzip.decompress(base64.b64decode(packed)))["skin_map"]
    assert [place["name"] for place in data["places"]] == ["A1", "A2"]
    assert len(json.dumps(data, separators=(",", ":"))) < 200_000
    (folder / "crosstalk.json").unlink()
    assert "Motion of the skin" not in write_report(folder).read_text()


def test_a_map_that_is_too_large_for_a_page_is_refused(monkeypatch):
    monkeypatch.setattr("unitcad.skin_map.LARGEST_KB", 20)
    with pytest.raises(Refusal, match=r"its map of 2 kinds of units has \d+ kB, the most is 20"):
        map_data(array_map(three()))


def test_the_command_writes_an_arrays_map(tmp_path):
    path = tmp_path / "patch.svg"
    sets = ["--set", "layout.columns=2", "--set", "layout.rows=1", "--set", "sheet.strap_slot_mm=[3, 10]"]
    done = unitcad("estimate", "forearm-pockets", *sets, "--map", str(path), "--json")
    assert done.returncode == 0, done.stderr
    (kind,) = json.loads(done.stdout)["map"]["kinds"]
    assert kind["unit"] == "encapsulating"
    assert kind["pitch_mm"]["value"] == pytest.approx(39.0, abs=0.1)
    assert ">A1<" in path.read_text()
