"""`unitcad accuracy`: errors against independent references, amplifications by exact laws, and its exit codes."""

import json
import math
from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
from msgspec.structs import replace as changed_struct

from tests.in_process import unitcad
from unitcad.accuracy import survey
from unitcad.accuracy.amplification import amplifications, extremes
from unitcad.accuracy.measurements import (
    REFERENCE,
    RTOLS,
    compare,
    interleaved,
    mesh_rows,
    response_rows,
    skipped_rows,
    timing,
    tolerances_of,
)
from unitcad.attenuation.inputs import Quantity
from unitcad.attenuation.layered import LayeredMedium, Response
from unitcad.estimate_inputs import estimate_input
from unitcad.kernels.mesh import area_true
from unitcad.pipeline.subjects import load_subject
from unitcad.pipeline.unit import Unit
from unitcad.shape import Revolve
from unitcad.shape.profile import Profile
from unitcad.validation import load

SPEC = load("encapsulating")
VARIANT = estimate_input(SPEC)


def _response(u, error):
    return Response(*(np.full(2, value) for value in (u, 0.0, u, error, 0.0, error)), wavenumbers=9, rtol=0.1)


def test_an_error_counts_by_what_exceeds_the_references_own_bound():
    found = compare(_response(1.03, 0.02), _response(1.0, 0.01))
    assert (found.error, found.bound, found.over_bound) == pytest.approx((0.03, 0.02, 1.0))
    assert compare(_response(1.005, 0.0), _response(1.0, 0.01)).over_bound == 0
    assert compare(_response(math.nan, 0.02), _response(1.0, 0.01)).over_bound == math.inf


@pytest.fixture(scope="module")
def rows():
    """The response's rows, measured once."""
    return response_rows(VARIANT, repeats=1)


def test_every_row_of_the_response_is_within_its_bound_and_its_rtol(rows):
    assert [row["rtol"] for row in rows] == list(RTOLS)
    assert all(row["over_bound"] <= 1 and row["bound"] <= row["rtol"] and row["s"] > 0 for row in rows)


def test_amplifications_obey_the_laws_of_scale():
    """Moduli, viscosities and density times c: the same wavelengths, and 1/c of the motion."""
    viscous = [changed_struct(layer, damping_law="kelvin_voigt", damping=Quantity(5.0)) for layer in VARIANT.tissue]
    found = amplifications(SPEC, changed_struct(VARIANT, tissue=tuple(viscous)))
    *levels, motion, decay = (one["by"] for one in found["results"])
    scaled = ("tissue shear modulus", "tissue damping", "tissue density")
    assert sum(motion[name] for name in scaled) == pytest.approx(-1, abs=1e-4)
    assert sum(decay[name] for name in scaled) == pytest.approx(0, abs=1e-4)
    # A level reads nothing of the body.
    assert [[level[name] for name in scaled] for level in levels] == [[0, 0, 0]] * 3
    published = levels[1]  # moduli and densities of the silicones times c: the same waves, and the same level
    own = [published[f"layers.{i}.{key}"] for i in (0, 1) for key in ("youngs_modulus_kpa", "density_g_cm3")]
    assert sum(own) == pytest.approx(0, abs=1e-3)
    assert max(map(abs, own)) > 0.3
    worst = found["results"][3]
    assert worst["amplification"] == max(map(abs, motion.values())) == abs(motion[worst["worst"]])


def test_an_extreme_design_is_named_with_its_place():
    assert not any(row["extreme"] for row in extremes(SPEC, VARIANT))
    thin = [changed_struct(layer, poisson_ratio=0.49999) for layer in VARIANT.tissue]
    thin[0] = changed_struct(thin[0], thickness=Quantity(1e-5))
    found = {row["what"]: row for row in extremes(SPEC, changed_struct(VARIANT, tissue=tuple(thin)))}
    named = {what for what, row in found.items() if row["extreme"]}
    assert named == {"tissue: thinnest layer / its shear wavelength", "tissue: least 1 - 2 nu"}
    film = found["tissue: thinnest layer / its shear wavelength"]
    skin = thin[0]
    speed = abs((skin.shear_modulus.middle * (1 + 1j * skin.damping.middle) / skin.density) ** 0.5)
    assert skin.damping_law == "loss_factor"
    assert film["at"] == skin.name
    assert film["value"] == pytest.approx(1e-5 * VARIANT.frequency.middle / speed)


def test_a_body_without_layers_has_no_thinnest_one():
    bone = changed_struct(VARIANT, tissue=VARIANT.tissue[-1:])
    film = next(row for row in extremes(SPEC, bone) if "thinnest layer" in row["what"])
    assert (film["value"], film["at"], film["extreme"]) == (math.inf, "no layer", False)


def test_a_cylinder_is_as_far_off_as_its_area_true_polygon():
    """Its corners are r (a - 1) outside, which is its bound, and its volume is exact."""
    pytest.importorskip("OCP")
    radius = 7.0
    shape = Revolve(Profile(((0, 0, 0), (radius, 0, 0), (radius, 5, 0), (0, 5, 0))))
    moulds = SimpleNamespace(
        unit=[SimpleNamespace(name="can", shape=shape)],
        plan=SimpleNamespace(tools=[]),
        dimensions=SimpleNamespace(outer_radius=radius),
        spec=SPEC,
    )
    rows = mesh_rows(moulds, lambda stage: None, repeats=1)
    for row in rows:
        assert row["distance_mm"] == pytest.approx(radius * (area_true(row["segments"]) - 1), rel=1e-6)
        assert row["distance_mm"] == pytest.approx(row["distance_bound_mm"], rel=1e-6)
        assert row["volume"] < 1e-12
        assert row["within_bounds"]
        assert row["body"] == "can"


def test_the_specs_own_tolerance_is_among_the_five():
    assert tolerances_of(0.02) == (0.1, 0.02, 0.01, 0.003, 0.001)
    assert tolerances_of(0.0005) == (0.1, 0.03, 0.01, 0.003, 0.0005)


def test_a_request_leaves_out_what_it_does_not_ask_for(monkeypatch):
    monkeypatch.setattr("unitcad.accuracy.measurements.interleaved", partial(interleaved, warm=False))
    spec = load("single-embedded", ["output.formats=['stl']"])
    rows = {row["request"]: row for row in skipped_rows(Unit(spec), repeats=1)}
    left = {name: {one["output"] for one in row["skipped"]} for name, row in rows.items()}
    assert {"moulds", "estimate", "casting"} <= left["unit only"]
    assert left["STL, no checks"] >= {"mould checks", "mesh checks"}
    assert "boundary representation" in left["as the spec asks"] - left["everything"]
    assert rows["unit only"]["s"] + rows["unit only"]["saved_s"] == pytest.approx(rows["everything"]["s"])


def test_a_saving_below_its_own_spread_is_not_printed(monkeypatch):
    """Five interleaved runs each: "as the spec asks" is everything once more, and its noise is no saving."""
    asked = []

    def timed(subject, requests, repeats):
        asked.append(repeats)
        seconds = {"everything": [2.0, 2.6, 2.1, 2.5, 2.2], "as the spec asks": [2.9, 2.1, 2.0, 2.4, 2.0]}
        usual = [1.0, 1.1, 1.2, 1.1, 1.0]
        return {name: timing(seconds.get(name, usual), {"skipped": []}) for name in requests}

    monkeypatch.setattr("unitcad.accuracy.measurements.time_requests", timed)
    rows = {row["request"]: row for row in skipped_rows(Unit(SPEC))}
    assert asked == [5]
    assert rows["everything"]["saved_s"] is rows["as the spec asks"]["saved_s"] is None
    assert rows["STL only"]["saved_s"] == pytest.approx(2.2 - 1.1)
    assert (rows["everything"]["s_low"], rows["everything"]["s_high"]) == pytest.approx((2.1, 2.5))
    others = {"mesh_rows": [{"distance_mm": 0}], "response_rows": [], "extremes": [], "amplifications": {"results": []}}
    for part, made in others.items():
        monkeypatch.setattr(f"unitcad.accuracy.accuracy_command.{part}", lambda *_, made=made: made)
    shown = unitcad("accuracy", "encapsulating").stdout.partition("Time saved")[2].splitlines()
    assert [line.split()[-1] for line in shown if line.strip().startswith(("everything", "as the spec"))] == ["-", "-"]


def test_an_array_is_measured_as_it_is_cast(monkeypatch):
    pair = ["layout.columns=2", "layout.rows=1", "sheet.strap_slot_mm=[3, 10]"]
    for part in ("response_rows", "skipped_rows", "amplifications"):  # as of the unit alone
        monkeypatch.setattr(f"unitcad.accuracy.accuracy_command.{part}", lambda *_: [])
    monkeypatch.setattr("unitcad.accuracy.accuracy_command.mesh_rows", partial(mesh_rows, repeats=1))
    monkeypatch.setattr("unitcad.accuracy.measurements.TOLERANCES", (0.1, 0.03))
    sets = [word for change in pair for word in ("--set", change)]
    done = unitcad("accuracy", "forearm-pockets", *sets, "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert len(found["meshes"]) == 2
    assert all(row["within_bounds"] for row in found["meshes"])
    subject = load_subject("forearm-pockets", pair)
    bodies = {body.name for body in (*subject.moulds.unit, *subject.moulds.plan.tools)}
    assert {row["body"] for row in found["meshes"]} <= bodies
    triangles = [row["triangles"] for row in found["meshes"]]
    assert triangles == sorted(triangles)


def test_a_survey_repeats_by_its_seed_and_names_what_is_worst():
    first, again, other = (survey.survey_media(2, seed, lambda stage: None) for seed in (0, 0, 1))
    errors = [[row["error"] for row in found["by_rtol"]] for found in (first, again, other)]
    assert errors[0] == errors[1] != errors[2]
    assert sum(row["bounds_broken"] for row in first["by_class"]) == 0
    worst = first["worst"]
    assert worst["over_bound"] == max(row["over_bound"] for row in first["by_rtol"])
    assert (worst["class"], worst["seed"]) in {("ordinary", 0), ("film on the forearm", 0)}


def test_a_response_off_by_more_than_its_bound_is_exit_code_1(monkeypatch):
    exact = LayeredMedium.response

    def off(*arguments, rtol, **keywords):
        found = exact(*arguments, rtol=rtol, **keywords)
        return replace(found, u_z=found.u_z * 1.2) if rtol > REFERENCE else found

    monkeypatch.setattr(LayeredMedium, "response", off)
    monkeypatch.setattr("unitcad.accuracy.accuracy_command.survey_specs", lambda *_: {"by_ranges": [], "faults": []})
    done = unitcad("accuracy", "--media", "1", "--json")
    assert done.returncode == 1
    assert json.loads(done.stdout)["media"]["by_rtol"][4]["bounds_broken"] == 1


def test_a_spec_that_is_neither_built_nor_refused_is_exit_code_1(monkeypatch):
    monkeypatch.setattr(survey, "outcome", lambda data: survey.Outcome("crash", "KeyError: 'x'"))
    found = survey.survey_specs(4, 2, lambda stage: None)
    assert [row["faults"] for row in found["by_ranges"]] == [3, 1]
    assert found["faults"][3] == {"ranges": "extreme", "seed": 200_000, "kind": "crash", "message": "KeyError: 'x'"}
    monkeypatch.setattr("unitcad.accuracy.accuracy_command.survey_media", lambda *_: {"by_rtol": [], "by_class": []})
    done = unitcad("accuracy", "--specs", "2", "--json")
    assert done.returncode == 1
    assert "fault: extreme 0: crash: KeyError: 'x'" in done.stderr


@pytest.mark.parametrize(
    ("words", "field"),
    [
        (["encapsulating", "--media", "9"], "--media"),
        (["encapsulating", "--seed", "9"], "--seed"),
        (["--set", "diameter_mm=15"], "--set"),
    ],
)
def test_options_of_the_survey_are_refused_for_a_spec(words, field):
    assert f"error: {field}" in unitcad("accuracy", *words).stderr


def test_the_command_shows_every_part(rows, monkeypatch):
    mesh_row = {"tolerance_mm": 0.1, "distance_mm": None, "triangles": 12, "within_bounds": False}
    found = {
        "mesh_rows": [mesh_row],
        "response_rows": rows,
        "amplifications": amplifications(SPEC, VARIANT),
        "skipped_rows": [],
    }
    for part, made in found.items():
        monkeypatch.setattr(f"unitcad.accuracy.accuracy_command.{part}", lambda *_, made=made: made)
    text, data = (unitcad("accuracy", "encapsulating", *form) for form in ([], ["--json"]))
    for done in (text, data):
        assert done.returncode == 1, done.stderr
        assert "an error exceeds its bound" in done.stderr
    assert list(json.loads(data.stdout)) == ["spec", "meshes", "response", "extremes", "amplification", "skipped"]
    for part in ("meshes of unit", "Response of the skin", "Stiff or extreme", "motion of the skin", "Time saved"):
        assert part in text.stdout
    assert len(text.stdout.splitlines()) < 60


def test_a_medium_without_the_finest_reference_is_compared_with_the_next():
    rows = survey._medium(("undamped", 2))
    assert all(row["over_bound"] <= 1 for row in rows)
