"""The circuit's outline against the strips and pads that it is made of, and the files that hold it, read back."""

import csv
import io
import math
import re
import time

import ezdxf
import numpy as np
import pytest

from unitcad.arrays.array_file import load_array
from unitcad.arrays.circuit import (
    circuit_body,
    circuit_dxf,
    circuit_svg,
    outline,
    pad_table,
    wiring,
)
from unitcad.errors import Refusal
from unitcad.shape import Profile, exact_volume, mm
from unitcad.shape.profile import points

LAYOUTS = {
    "grid": ({"kind": "grid", "columns": 3, "rows": 3, "pitch_mm": 20.0}, {}),
    "turned": ({"kind": "grid", "columns": 4, "rows": 2, "pitch_mm": [18.0, 21.0]}, {"rows": "y", "corner_mm": 0.6}),
    "hexagon": ({"kind": "hex", "rings": 1, "pitch_mm": 23.0}, {"corner_mm": 1.5}),
    "column": ({"kind": "grid", "columns": 1, "rows": 3, "pitch_mm": 18.0}, {"row_width_mm": 2.0}),
}


def made(name):
    layout, circuit = LAYOUTS[name]
    unit = {"like": "encapsulating", "fpcb": {"tail_length_mm": 1.0}}
    return load_array({"name": name, "array": "back-sheet", "unit": unit, "layout": layout, "circuit": circuit})


ARRAYS = {name: made(name) for name in LAYOUTS}


def _away(laid, at):
    """The distance of points from pads and strips, by the definitions of a disc and of a rectangle."""
    found = [np.hypot(at[:, 0] - pad.x, at[:, 1] - pad.y) - laid.pad.radius for pad in laid.places]
    for strip in laid.strips:
        (x0, y0), (x1, y1) = strip.start, strip.end
        length = math.hypot(x1 - x0, y1 - y0)
        ux, uy = (x1 - x0) / length, (y1 - y0) / length
        along = (at[:, 0] - x0) * ux + (at[:, 1] - y0) * uy - length / 2
        across = (at[:, 1] - y0) * ux - (at[:, 0] - x0) * uy
        out = np.stack([np.abs(along) - length / 2, np.abs(across) - strip.half])
        found.append(np.hypot(*np.maximum(out, 0)) + np.minimum(out.max(axis=0), 0))
    for strip in laid.spine[:-1]:
        found.append(np.hypot(at[:, 0] - strip.end[0], at[:, 1] - strip.end[1]) - strip.half)
    return np.min(found, axis=0)


def _inside(profile, at):
    corners = points(profile, 2000)
    x0, y0 = corners.T
    x1, y1 = np.roll(corners, -1, axis=0).T
    found = np.zeros(len(at), bool)
    for i, (x, y) in enumerate(at):
        up = (y0 > y) != (y1 > y)
        found[i] = np.count_nonzero(x < x0[up] + (y - y0[up]) / (y1[up] - y0[up]) * (x1[up] - x0[up])) % 2
    return found


@pytest.mark.parametrize("name", ARRAYS)
def test_the_outline_holds_pads_and_strips_and_rounds_what_lies_between(name):
    """A point is outside exactly where a disc of the corner's radius fits that keeps clear of pads and strips."""
    array = ARRAYS[name]
    laid, drawn = wiring(array), outline(array)
    corner = array.circuit.corner_mm if array.circuit else 1.0
    x0, y0, x1, y1 = drawn.bounds
    rng = np.random.default_rng(1)
    at = rng.uniform((x0, y0), (x1, y1), (500, 2))
    # Most of them next to where strips and pads meet.
    near = np.array([(pad.x, pad.y) for pad in laid.places])[rng.integers(0, len(laid.places), 4000)]
    at = np.concatenate([at, near + rng.normal(0, 5, near.shape)])
    away, inside = _away(laid, at), _inside(drawn, at)
    assert np.all(inside[away < -5e-3])
    assert not np.any(inside[away > corner])
    turns = np.linspace(0, 2 * np.pi, 72, endpoint=False)
    discs = np.concatenate([r * corner * np.stack([np.cos(turns), np.sin(turns)], 1) for r in np.linspace(0, 1, 25)])
    between = np.flatnonzero((away > 5e-3) & (away < corner))
    assert len(between) > 20
    for i in between:
        fits = np.max(_away(laid, at[i] + discs))
        if abs(fits - corner) > 0.02 * corner + 5e-3:
            assert inside[i] == (fits < corner), (at[i], fits)
    assert np.any(inside[between])


def test_a_corner_that_reaches_into_a_units_wall_is_refused_with_what_fits():
    array = load_array(ARRAYS["grid"], ["circuit.corner_mm=4.0"])
    with pytest.raises(Refusal, match="notch") as refused:
        outline(array)
    assert refused.value.field == "circuit.corner_mm"
    assert 1.0 <= refused.value.nearest < 4.0
    outline(load_array(array, [f"circuit.corner_mm={refused.value.nearest}"]))


def test_the_dxf_holds_the_outline_exactly_and_has_the_same_bytes_again():
    array = ARRAYS["hexagon"]
    laid, drawn = wiring(array), outline(array)
    data = circuit_dxf(laid, drawn)
    document = ezdxf.read(io.StringIO(data.decode()))
    assert not document.audit().has_errors
    assert document.units == ezdxf.units.MM
    space = document.modelspace()
    (line,) = space.query('LWPOLYLINE[layer=="OUTLINE"]')
    assert line.closed
    back = Profile(tuple((x, y, bulge) for x, y, bulge in line.get_points("xyb")))
    assert back.area == pytest.approx(drawn.area, rel=1e-9)
    assert [(e.dxf.center.x, e.dxf.center.y, e.dxf.radius) for e in space.query("CIRCLE")] == [
        pytest.approx((pad.x, pad.y, laid.pad.radius), abs=1e-6) for pad in laid.places
    ]
    assert [e.dxf.text for e in space.query("TEXT")] == [pad.name for pad in laid.places]
    time.sleep(1.1)
    assert circuit_dxf(wiring(made("hexagon")), outline(made("hexagon"))) == data
    assert not ezdxf.options.write_fixed_meta_data_for_testing


def test_svg_and_table_name_every_motor():
    array = ARRAYS["turned"]
    laid = wiring(array)
    svg = circuit_svg(laid, outline(array))
    assert re.findall(r"<text[^>]*>(\w+)<", svg) == [place.name for place in array.places]
    assert svg.count("A0.6 0.6") == sum(1 for v in outline(array).vertices if v[2] < 0)
    rows = list(csv.DictReader(io.StringIO(pad_table(array, laid).decode())))
    assert [(row["name"], float(row["x_mm"]), float(row["y_mm"])) for row in rows[:-1]] == [
        (place.name, pytest.approx(place.x, abs=1e-4), pytest.approx(place.y, abs=1e-4)) for place in array.places
    ]
    assert float(rows[-1]["x_mm"]) == pytest.approx(laid.spine[-1].end[0], abs=1e-4)


def test_the_body_is_as_thick_as_the_units_circuits():
    body = circuit_body(ARRAYS["grid"])
    assert exact_volume(body.shape) == pytest.approx(outline(ARRAYS["grid"]).area * (mm(2.11) - 2.0), rel=1e-9)
