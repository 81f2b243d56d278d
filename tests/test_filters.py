"""`unitcad list` with filters, against a filter of one's own; and the motors: each is built or refused for a reason."""

import json
import math

import pytest

from tests.in_process import unitcad
from unitcad import catalogue
from unitcad.catalogue.entries import kinds_of
from unitcad.catalogue.filters import keep, range_of, unit_of
from unitcad.errors import Refusal, WrongArgument
from unitcad.estimate_inputs import estimate_input
from unitcad.moulds.mould_set import MouldSet
from unitcad.spec import motor_of
from unitcad.validation import from_data, load, read, warnings

MOTORS = catalogue.motors()


@pytest.mark.parametrize(
    ("text", "unit", "low", "high"),
    [
        ("10..60kPa", "kPa", 10, 60),
        ("10kPa..0.06MPa", "kPa", 10, 60),
        (" 10 .. 60 ", "kPa", 10, 60),
        ("20..", "min", 20, math.inf),
        ("..1h", "min", -math.inf, 60),
        ("8", "mm", 8, 8),
        ("0.8cm", "mm", 8, 8),
        ("8mm..1cm", "mm", 8, 10),
        ("1e2..2.5e3", "", 100, 2500),
        ("0", "", 0, 0),
    ],
)
def test_a_range_is_read_in_the_unit_of_its_key(text, unit, low, high):
    found = range_of("soft", text, unit)
    assert (found.low, found.high) == pytest.approx((low, high))
    assert found.low in found
    assert math.nextafter(found.high, math.inf) not in found or found.high == math.inf


@pytest.mark.parametrize(
    ("text", "unit", "nearest"),
    [
        ("", "mm", None),
        ("..", "mm", None),
        ("kPa", "kPa", None),
        ("a..b", "mm", None),
        ("1..2..3", "mm", None),
        ("nan..", "mm", None),
        ("10..8", "mm", "8..10"),
        ("10..60kPa", "mm", "10..60mm"),
        ("10..60kPa", "", "10..60"),
    ],
)
def test_another_text_is_no_range(text, unit, nearest):
    with pytest.raises(WrongArgument) as refused:
        range_of("diameter", text, unit)
    assert (refused.value.field, refused.value.value, refused.value.nearest) == ("diameter", text, nearest)
    if nearest:
        range_of("diameter", nearest, unit)


@pytest.mark.parametrize("kind", [catalogue.Material, catalogue.Motor, catalogue.Printer])
def test_every_number_can_be_filtered_by_and_its_own_value_is_kept(kind):
    entries = {"Material": catalogue.materials, "Motor": catalogue.motors, "Printer": catalogue.printers}[
        kind.__name__
    ]()
    for key, _ in kinds_of(kind):
        for name, entry in entries.items():
            value = getattr(entry, key)
            if value is not None:
                kept, lacking = keep(entries, {key: f"{value.value!r}{unit_of(key)}".strip("'")})
                assert name in kept
                assert set(kept) == {
                    n for n, e in entries.items() if getattr(e, key) and getattr(e, key).value == value.value
                }
                assert set(lacking.get(key, ())) == {n for n, e in entries.items() if getattr(e, key) is None}
                break


def test_list_keeps_what_is_asked_for():
    def listed(*args):
        done = unitcad("list", *args, "--json")
        assert done.returncode == 0
        return json.loads(done.stdout)

    found = listed("materials", "--soft", "10..60kPa", "--pot-life", "20..")
    expected = [
        name
        for name, each in catalogue.materials().items()
        if (modulus := each.quasistatic_modulus_kpa or each.youngs_modulus_kpa or each.modulus_100pct_kpa)
        and 10 <= float(modulus) <= 60
        and each.pot_life_min
        and float(each.pot_life_min) >= 20
    ]
    assert list(found["materials"]) == expected
    assert "solaris" in found["without_a_value"]["soft"]
    found = listed("motors", "--diameter", "8..10")
    assert list(found["motors"]) == [name for name, each in MOTORS.items() if 8 <= float(each.diameter_mm) <= 10]
    assert set(listed("motors", "--frequency", "165..170Hz")["motors"]) == {
        "VC0720B001F", "VC0820B006F", "VG1040003D", "VLV101040A"
    }  # fmt: skip
    assert set(listed("printers", "--bed", "25cm..")["printers"]) == {"bambu-a1", "bambu-p1"}
    assert set(listed("materials", "--where", "chemistry=tin", "--where", "cure_h=..2")["materials"]) == {"oomoo-25"}


@pytest.mark.parametrize(
    ("args", "words"),
    [
        (("motors", "--pot-life", "3.."), "--pot-life = '3..': filters the entries of another kind, materials"),
        (("materials", "--where", "density=1"), "--where = 'density': unknown name; closest: density_g_cm3"),
        (("motors", "--where", "kind=foo"), "--where = 'foo': unknown name; known: erm, lra, piezo, voice-coil"),
        (("motors", "--where", "kind"), "--where = 'kind': is KEY=RANGE"),
        (("templates", "--soft", "3.."), "KIND = 'templates': has no values to filter by"),
        (("--soft", "3.."), "KIND: is required with a filter"),
        (("motors", "--diameter", "8..10kPa"), "--diameter = '8..10kPa': is in um or mm or cm"),
    ],
)
def test_a_filter_that_can_not_be_is_refused(args, words):
    done = unitcad("list", *args)
    assert done.returncode == 2
    assert f"error: {words}" in done.stderr


def test_a_filter_that_nothing_meets_says_so():
    done = unitcad("list", "materials", "--soft", "1..2Pa")
    assert done.returncode == 0
    assert "none of the materials meets it" in done.stderr


def of(name, **more):
    needed = float(MOTORS[name].diameter_mm) * math.sqrt(2) + 8
    return from_data({**read("encapsulating"), "diameter_mm": math.ceil(needed), "motor": {"part": name}, **more})


@pytest.mark.parametrize("name", MOTORS)
def test_each_motor_is_built_or_refused_for_what_it_is(name):
    motor, more = MOTORS[name], {}
    if motor.square:
        with pytest.raises(Refusal, match=r"motor\.diameter_mm: must be at least 14\.1: .* is a square") as refused:
            of(name)
        with pytest.raises(Refusal, match=r"motor\.diameter_mm = 14: must be at least 14\.1: "):
            of(name, motor={"part": name, "diameter_mm": 14.0})
        assert refused.value.nearest == pytest.approx(math.sqrt(2) * float(motor.diameter_mm), abs=0.1)
        more["motor"] = {"part": name, "diameter_mm": refused.value.nearest}
    if motor.kind and motor.kind.value in ("piezo", "voice-coil"):
        with pytest.raises(Refusal, match=r"estimate\.\w+: is required: no source gives it"):
            of(name, **more)
        more["estimate"] = {"amplitude_um": 20, "frequency_hz": 250}
    if motor.kind and motor.kind.value == "piezo":  # a disc as thin as foil leaves no wall under a tail's window
        with pytest.raises(Refusal, match=r"motor\.thickness_mm = 0\.22: "):
            of(name, **more)
        return
    spec = of(name, **more)
    assert MouldSet(spec).plan.steps
    assert motor_of(spec) == motor
    drawn = estimate_input(spec)
    assert drawn.drive == (motor.drive.value if motor.drive else "flat")
    if "motor" in more:
        return
    if "estimate" not in more:
        expected = motor.frequency_hz or (float(motor.rpm) / 60 if motor.rpm else 125.0)
        assert spec.estimate.frequency_hz == pytest.approx(float(expected), abs=1e-3)
        told = [line for line in warnings(spec) if "stand in" in line]
        known = motor.frequency_hz or motor.rpm
        assert len(told) == (0 if motor.amplitude_um and known else 1)
        if told:
            assert ("frequency" in told[0]) == (not known)
    if motor.mass_g:
        assert drawn.geometry.motor_mass.middle == pytest.approx(1e-3 * float(motor.mass_g))


def test_the_motors_are_those_of_a_shop():
    kinds = [each.kind.value for each in MOTORS.values() if each.kind]
    assert len(MOTORS) >= 15
    assert {kinds.count(kind) > 0 for kind in ("erm", "lra", "voice-coil", "piezo")} == {True}
    assert {6.0, 7.0, 8.0, 10.0, 12.0} <= {float(each.diameter_mm) for each in MOTORS.values()}
    for each in MOTORS.values():
        assert each.kind
        assert (each.test_mass_g is None) or each.acceleration_g
        if each.rpm and each.frequency_hz:  # a motor's force turns once a revolution
            assert float(each.frequency_hz) == pytest.approx(float(each.rpm) / 60, rel=0.01)


def test_a_stock_first_layer_stays_when_the_others_are_finer():
    for name in ("prusa-mk3s", "prusa-mk4", "bambu-a1", "bambu-p1", "ender-3"):
        first = catalogue.printers()[name].first_layer_mm
        assert first
        assert first.value == 0.2
        assert first.source.endswith("initial_layer_print_height")
        lengths = load("encapsulating", [f"moulds.printer={name}", "moulds.layer_mm=0.1"]).moulds
        assert (lengths.layer_mm, lengths.first_layer_mm) == (0.1, 0.2)
    assert load("encapsulating", ["moulds.layer_mm=0.1"]).moulds.first_layer_mm == 0.1


def test_list_shows_what_a_cupboard_holds(tmp_path):
    file = tmp_path / "cupboard.toml"
    file.write_text(
        '[at_hand]\nmaterials = ["ecoflex-00-10", "our-blend"]\n[materials.our-blend]\nlike = "dragon-skin-30"\n'
        '[printers.mine]\nlike = "fdm-0.4"\n'
    )

    def names(*words):
        done = unitcad("list", *words, "--cupboard", file, "--json")
        assert done.returncode == 0, done.stderr
        return set(json.loads(done.stdout)[words[0]])

    assert names("materials") == {"ecoflex-00-10", "our-blend"}
    assert names("materials", "--soft", "..60kPa") == {"ecoflex-00-10"}
    assert names("printers") == {"mine"}
    assert len(names("motors")) == 24
    # An own entry with a source alone has the status of a spec's values.
    file.write_text('[materials.our-blend]\nlike = "ecoflex-00-10"\ndensity_g_cm3 = 1.06\nsource = "our scale"\n')
    shown = unitcad("list", "materials", "--cupboard", file)
    assert shown.returncode == 0, shown.stderr
    assert "our-blend\n  density_g_cm3 = 1.06  [spec] our scale\n" in shown.stdout
    assert "sla" in names("printers")
    assert unitcad("list", "rules", "--cupboard", file).returncode == 2
    refused = unitcad("list", "materials", "--cupboard", tmp_path / "none.toml")
    assert refused.returncode == 2
    assert "no such file" in refused.stderr
