"""Validation: what is refused, with field, value, limit and a nearest value that is accepted."""

import re
import tomllib

import pytest
import tomli_w
from msgspec import structs

from tests.sample_bodies import LEADLESS
from unitcad.documents import parse_toml
from unitcad.errors import Refusal, UnitcadError, unknown_name
from unitcad.spec import from_json, to_data, to_json, to_toml
from unitcad.spec.custom_code import ANY, allow, allow_nothing
from unitcad.validation import from_data, load, override, read, templates, warnings

NAMES = sorted(templates())


@pytest.mark.parametrize("name", NAMES)
def test_a_resolved_spec_reads_back_as_itself(name):
    spec = load(name)
    assert from_data(tomllib.loads(to_toml(spec))) == spec
    assert spec.name == name


@pytest.mark.parametrize("name", NAMES)
def test_a_spec_is_the_same_text_whatever_was_written_before(name):
    for settings in ([], ["diameter_mm=16.5", "casting.vacuum=true"], []):
        spec = load(name, settings)
        assert to_toml(spec) == tomli_w.dumps(to_data(spec))


def test_values_that_are_equal_and_read_otherwise_are_written_each_as_it_is():
    for waste in (1.0, 1, 1.0):
        spec = structs.replace(load("embedded"), casting=structs.replace(load("embedded").casting, waste=waste))
        assert to_toml(spec) == tomli_w.dumps(to_data(spec))


def test_a_path_and_a_name_find_the_same_template(tmp_path):
    copy = tmp_path / "mine.toml"
    copy.write_bytes(templates()["embedded"].read_bytes())
    assert load(str(copy)) == load("embedded")


def test_odd_names_survive_the_file():
    spec = load("embedded", [r'name="<script>\"é\"\\ \\n"'])
    assert from_data(tomllib.loads(to_toml(spec))).name == spec.name


@pytest.mark.parametrize(
    ("template", "setting", "field", "nearest"),
    [
        ("encapsulating", "diameter_mm=12.0", "diameter_mm", 12.2),
        ("encapsulating", "layers.0.wall_mm=0.3", "layers.0.wall_mm", 0.5),
        ("encapsulating", "layers.0.wall_mm=-1.0", "layers.0.wall_mm", 0.5),
        ("encapsulating", "diameter_mm=1e300", "diameter_mm", 1000),
        ("encapsulating", "layers.0.cap_mm=0.9", "layers.0.cap_mm", 0.99),
        (LEADLESS, "layers.0.cap_mm=0.4", "layers.0.cap_mm", 0.5),
        ("encapsulating", "fpcb.tail_width_mm=7.0", "fpcb.tail_width_mm", 6.3),
        ("encapsulating", "fpcb.pad_diameter_mm=9.5", "fpcb.pad_diameter_mm", 9.0),
        ("encapsulating", "fpcb.pad_diameter_mm=2.0", "fpcb.pad_diameter_mm", 3.0),
        ("embedded", "fpcb.pad_diameter_mm=11.0", "fpcb.pad_diameter_mm", 11.7),
        ("embedded", "fpcb.pad_diameter_mm=15.0", "fpcb.pad_diameter_mm", 14.0),
        ("encapsulating", "moulds.slot_height_mm=0.2", "moulds.slot_height_mm", 0.4),
        ("encapsulating", "moulds.least_wall_mm=0.4", "moulds.least_wall_mm", 0.8),
        ("encapsulating", "moulds.skirt_wall_mm=0.5", "moulds.skirt_wall_mm", 0.8),
        ("encapsulating", "moulds.seat_relief_mm=1.8", "moulds.seat_relief_mm", 1.5),
        ("encapsulating", "moulds.plate_mm=2.5", "moulds.plate_mm", 3.2),
        ("encapsulating", "moulds.filament_hole_mm=1.5", "moulds.filament_hole_mm", 1.75),
        ("encapsulating", "motor.thickness_mm=0.8", "motor.thickness_mm", 1.045),
        ("encapsulating", "motor.part='LCM0720'", "motor.part", "LCM0720A3463F"),
        ("encapsulating", "layers.1.material='dragonskin-30'", "layers.1.material", "dragon-skin-30"),
        ("encapsulating", "layers.1.cap_mm=0", "layers.1.cap_mm", 0.5),
        ("encapsulating", "fpcb.tail_width_mm=0.0", "fpcb.tail_width_mm", 0.4),
        ("encapsulating", "moulds.vents=0", "moulds.vents", 1),
        ("encapsulating", "design='encapsulated'", "design", "encapsulating"),
        ("encapsulating", "output.tolerance_mm=0.5", "output.tolerance_mm", 0.2),
        ("encapsulating", "moulds.printer='fdm-04'", "moulds.printer", "fdm-0.4"),
        ("encapsulating", "layers.0.wal_mm=1.0", "layers.0.wal_mm", "layers.0.wall_mm"),
        ("encapsulating", "estimate.tissue='forarm'", "estimate.tissue", "forearm"),
    ],
)
def test_refused_with_a_nearest_value_that_is_accepted(template, setting, field, nearest):
    with pytest.raises(Refusal) as refused:
        load(template, [setting])
    assert refused.value.field == field
    assert refused.value.nearest == nearest
    if isinstance(nearest, int | float):
        try:
            load(template, [f"{field}={nearest}"])
        except Refusal as other:  # another field may have to follow
            assert other.field != field


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("diameter_mm=nan", "finite"),
        ("diameter_mm=inf", "finite"),
        ("diameter_mm='14'", "number"),
        ("diameter_mm=true", "number"),
        ("layers=[]", r"^layers = .*must not be empty"),
        ("diameter_mm=-14", r"must be at least 1, and the motor .* need 12\.2 mm; nearest accepted: 12\.2$"),
        ("layers=3", r"^layers = 3: takes a list: one \[\[layers\]\] table or more"),
        ("output.formats=stl", r"takes a list such as \[\"stl\"\]; nearest accepted: \[\"stl\"\]$"),
        ("output.formats=3", r"takes a list such as \[\"stl\"\]$"),
        ("moulds.cavities=3", r"takes \"fill\" or a list such as \[1, 1\]; nearest accepted: \[3, 3\]$"),
        ("layers.0=3", r"^layers\.0 = 3: takes a table"),
        (
            "layers.7.wall_mm=1.0",
            r"^layers\.7\.wall_mm = 1: no entry 7: the list has the entries 0 to 1; Layer 1 is layers\.0$",
        ),
        ("name=''", "must not be empty"),
        (f"name='{'x' * 121}'", "at most 120 characters"),
        ("name=2026-01-01", "date or time"),
        ("fpcb.tail=3", r"^fpcb\.tail = 3: takes \"one\" or \"both\"$"),
        ("moulds.cavities=[1]", r"^moulds\.cavities = .*2 entries"),
        ("moulds.cavities=[1, 1.5]", r"^moulds\.cavities\.1 = 1\.5: takes a whole number"),
        ("materials.mine=3", r"^materials\.mine = 3: takes a table"),
        ("parameters.count=[1]", r"^parameters\.count = .*a text"),
        ("tissue.arm.skin=1", r"^tissue\.arm\.skin = 1: takes a table"),
        ("diameter_mm=1e400", "finite"),
        ("materials.mine.density_g_cm3=inf", r"^materials\.mine\.density_g_cm3 = inf: must be a finite"),
        ("wires={ count = 2 }", r"^wires\.diameter_mm: is required"),
        ("tissue.arm={}", r"^tissue\.arm = \{\}: must not be empty: needs one layer or more by name, .*density_kg_m3"),
        ("layers=[]", r"^layers = \[\]: must not be empty: needs one \[\[layers\]\] table or more"),
        ("estimate.models=[]", r"^estimate\.models = \[\]: .* one or more of rule, published, .*fem$"),
        ("materials.mine.mix_ratio=[]", r"mix_ratio = \[\]: takes a number, or a table with value and optionally "),
        ("motor=['a', 2.5]", r'^motor = \["a", 2.5\]: takes true or false, or a table, with keys such as part,'),
        ("motor.fill={ b = true }", r"^motor\.fill = \{ b = true \}: takes true or false$"),
        ("nonsense", "path=value"),
        ("name.x=1", "table"),
        ("motor.part='foo'", r"^motor\.part = 'foo': unknown name; known: .*LCM1027A2445F \(10 x 2\.7 mm\)"),
        ("design='d.py'", r"^design = 'd\.py': name the function or Design in that file: d\.py:NAME$"),
    ],
)
def test_refused_in_plain_words(setting, words):
    with pytest.raises(Refusal, match=words):
        load("encapsulating", [setting])


@pytest.mark.parametrize("key", ["a - at `$.motor", "a - at `$[0]", "a - at `$.materials[...]", "`", "", "x.y"])
def test_a_key_is_named_whatever_it_looks_like(key):
    data = read("encapsulating")
    for table, place in ((data, ""), (data["motor"], "motor.")):
        table[key] = 1
        with pytest.raises(Refusal, match="unknown key") as refused:
            from_data(data)
        assert refused.value.field == place + key
        del table[key]


def test_an_unknown_key_names_the_nearest_ones_first_and_where_all_are():
    with pytest.raises(Refusal, match=r"known here: (\w+, ){4}\w+ and 14 more \(`unitcad schema` lists all\)"):
        load("encapsulating", ["xyz=1"])
    with pytest.raises(Refusal, match=r"unknown key; closest: wall_mm; nearest"):
        load("encapsulating", ["layers.0.walls_mm=1"])
    with pytest.raises(Refusal, match=r"unknown key; known: layers\.0\.wall_mm or layers\.1\.wall_mm$"):
        load("encapsulating", ["wall_mm=1"])
    with pytest.raises(Refusal, match=r"unknown key; skin_mm belongs above the first \[table\]$"):
        load("encapsulating", {"layers.1.skin_mm": 0.4})


@pytest.mark.parametrize(
    ("part", "first"),
    [("LCM1020", "VC1020B327F"), ("LCM0820", "VC0820B006F"), ("8mm", "VC0820B006F"), ("lcm0720a3463", "LCM0720A3463F")],
)
def test_an_unknown_motor_is_answered_by_size(part, first):
    with pytest.raises(Refusal) as refused:
        load("encapsulating", {"motor.part": part})
    known = re.findall(r"([\w-]+) \([\d.]+ x [\d.]+ mm\)", str(refused.value))
    assert known[0] == first == refused.value.nearest
    assert len(known) >= 6
    assert "give diameter_mm and thickness_mm" in str(refused.value)


def test_a_custom_design_without_its_text_is_refused():
    allow({ANY})
    with pytest.raises(Refusal, match=r"^design_source: is required with design = 'd\.py:unit'$"):
        from_data({**read("encapsulating"), "design": "d.py:unit"})
    allow_nothing()


def test_a_missing_value_is_null_in_json():
    with pytest.raises(Refusal) as refused:
        load("encapsulating", ["wires={ count = 2 }"])
    assert refused.value.as_dict()["value"] is None


def test_json_is_the_same_spec_and_plain_data_too():
    for name in templates():
        spec = load(name)
        assert from_json(to_json(spec)) == spec
        assert from_data(to_data(spec)) == spec


def test_embedded_layers_have_no_cap_and_encapsulating_ones_do():
    with pytest.raises(Refusal, match="open ring"):
        load("embedded", ["layers.0.cap_mm=1.0"])
    data = read("encapsulating")
    del data["layers"][1]["cap_mm"]
    with pytest.raises(Refusal, match="every encapsulating layer"):
        from_data(data)


def test_toml_that_does_not_parse_names_line_and_column(tmp_path):
    bad = tmp_path / "bad.toml"
    bad.write_text('name = "x"\ndesign = \n')
    with pytest.raises(UnitcadError, match=r"bad.toml:2:10: not TOML"):
        load(str(bad))
    bad.write_bytes(b"\xff\xfe")
    with pytest.raises(UnitcadError, match="UTF-8"):
        load(str(bad))
    with pytest.raises(UnitcadError, match="no such file"):
        load(str(tmp_path / "none.toml"))
    with pytest.raises(UnitcadError, match="is a folder"):
        load(f"{tmp_path}/")


def test_a_spec_brings_its_own_material_motor_and_printer():
    spec = override(read("encapsulating"), [])
    spec["materials"] = {"house": {"like": "ecoflex-00-30", "youngs_modulus_kpa": 40.0}}
    spec["motors"] = {"mine": {"diameter_mm": 6.0, "thickness_mm": 2.2}}
    spec["printers"] = {"old": {"like": "fdm-0.4", "plinth_clearance_mm": 0.25}}
    spec["layers"][0]["material"] = "house"
    spec["motor"] = {"part": "mine"}
    spec["moulds"] = {"printer": "old"}
    built = from_data(spec)
    assert built.motor.diameter_mm == 6.0
    assert built.moulds.plinth_clearance_mm == 0.25
    assert from_data(tomllib.loads(to_toml(built))) == built
    spec["materials"]["house"]["poison_ratio"] = 0.4
    with pytest.raises(Refusal, match="poisson_ratio"):
        from_data(spec)


def test_a_long_list_of_known_names_is_cut():
    refused = unknown_name("body", "q", [f"cup{i:02}" for i in range(15)])
    assert refused.limit.endswith("cup08, cup09 and 5 more")
    assert refused.nearest is None


def test_the_default_motor_is_that_of_a_spec_without_part_and_size():
    data = read("encapsulating")
    given = from_data({**data, "motor": {"part": "LCM0720A3463F", "fill": True}})
    assert from_data({**data, "motor": {"fill": True}}) == given
    assert from_data(tomllib.loads(to_toml(given))) == given
    assert from_data({**data, "motor": {"diameter_mm": 7.0, "thickness_mm": 2.0}}).motor.part is None
    with pytest.raises(Refusal, match=r"^motor\.thickness_mm: is required where no part is named$"):
        from_data({**data, "motor": {"diameter_mm": 7.0}})


def test_a_layer_below_its_casting_floor_is_a_warning():
    assert warnings(load("embedded")) == []
    thin = warnings(load("embedded", ["layers.0.wall_mm=0.8"]))
    assert len(thin) == 1
    assert "layers.0.wall_mm" in thin[0]


def test_overrides_do_not_touch_the_source():
    data = read("embedded")
    override(data, ["layers.0.wall_mm=2.0"])
    assert data["layers"][0]["wall_mm"] == 1.25


def test_a_name_has_at_most_120_characters():
    data = tomllib.loads(templates()["single-embedded"].read_text("utf-8"))
    longest = "x" * 120
    assert longest in from_data({**data, "materials": {longest: {"like": "ecoflex-00-30"}}}).materials
    with pytest.raises(Refusal, match=r"^materials\.x{20}\.\.\. = 121: a name has at most 120 characters$"):
        from_data({**data, "materials": {longest + "x": {"like": "ecoflex-00-30"}}})


@pytest.mark.parametrize(
    ("line", "advice"),
    [
        ("design = encapsulating", '; put quotes round a text: "encapsulating"'),
        ("layers = [{ material = ecoflex-00-30 }]", '; put quotes round a text: "ecoflex-00-30"'),
        ("motor.fill = True", "; write true in small letters"),
        ("name = ", ""),
    ],
)
def test_a_word_without_quotes_is_told_of_them(line, advice):
    with pytest.raises(UnitcadError) as refused:
        parse_toml(f"diameter_mm = 14.0\n{line}\n", "mine.toml")
    assert str(refused.value).partition("Invalid value")[2] == advice
