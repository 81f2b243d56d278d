"""Custom designs: overlaps without moulds, moulds by complement of the cast layers, and what is refused."""

import math

import pytest
from faulty_sets import broken, mesh_findings, of_spec

from unitcad.casting.procedure import procedure
from unitcad.casting.procedure_text import to_markdown
from unitcad.checks import check_moulds, mould_checks
from unitcad.errors import Refusal, UnitcadError
from unitcad.export import printing
from unitcad.kernels.mesh import arrays, realise
from unitcad.moulds.complement import complement
from unitcad.moulds.cup import cup_blank
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.plan import cast_layers
from unitcad.pipeline.write import build
from unitcad.shape import Revolve, cut, polygon, union
from unitcad.validation import custom_templates, load, templates

SPEC = """
name = "custom"
design = "drawn.py:unit"
diameter_mm = 14.0
{circuit}
{layers}
[output]
formats = ["stl"]
tolerance_mm = 0.05
"""
LAYER = '[[layers]]\nmaterial = "ecoflex-00-30"\nwall_mm = 1.25\ncap_mm = 1.25\n'
HEAD = """
from unitcad.shape import Extrude, Profile, Revolve, box, cut, cylinder, moved, polygon, ring, rounded_rectangle, union
"""


def written(folder, code, layers=1, circuit=""):
    """Write a custom design and its spec."""
    (folder / "drawn.py").write_text(HEAD + code)
    (folder / "spec.toml").write_text(SPEC.format(layers=LAYER * layers, circuit=circuit))
    return folder / "spec.toml"


def built(folder, code, *only, **more):
    """Build a custom design."""
    return build(load(written(folder, code, **more)), folder / "out", only=only or ("unit",))


def test_overlaps_inside_the_unit_are_errors_without_moulds_too(tmp_path):
    """The circuit's tail, 3 x 0.11 mm, runs through 1.25 mm of a ring as high as motor and circuit."""
    code = "def unit(spec):\n    return ring(5.75, 7.0, 0, 2.11)\n"
    done = built(tmp_path, code, circuit="[fpcb]\nthickness_mm = 0.11\n")
    assert not done.ok
    (finding,) = [finding for finding in done.manifest["mould_checks"] if not finding["ok"]]
    assert (finding["code"], finding["where"]) == ("C200", "unit: layer1 and fpcb")
    assert abs(finding["value"] - 0.11 * 3 * 1.25) < 0.02
    whole = built(tmp_path, code.replace("2.11", "2.0"), circuit="[fpcb]\nthickness_mm = 0.11\n")
    assert whole.ok
    assert [finding["code"] for finding in whole.manifest["mould_checks"]] == ["C200"]


LUGS = """
def unit(spec):
    roof, top = spec.motor.thickness_mm, spec.motor.thickness_mm + 2.5
    inner = Extrude(rounded_rectangle(7, 6, 2), 0, roof + 1.25)
    slots = [moved(box(-1, 1, -3, 3, -1, top + 1), x) for x in (-12.5, 12.5)]
    lugs = Extrude(rounded_rectangle(15, HALF, 2), LOW, HIGH)
    body = union((Extrude(rounded_rectangle(8.25, 7.25, 2.5), 0, top), lugs))
    return {"layer1": cut(inner, [cylinder(4.2, -1, roof)]), "layer2": cut(body, [cut(inner, []), *slots])}
"""


def lugs(half=4.5, low=3.0, high=4.5):
    """A rounded rectangle with a lug and a strap slot on two sides."""
    return LUGS.replace("HALF", str(half)).replace("LOW", str(low)).replace("HIGH", str(high))


def moulds_of(folder, code, *overrides, layers=1):
    """Return the mould set of a custom design."""
    return of_spec(load(written(folder, code, layers=layers), overrides))


def by_complement(folder, code, *overrides, layers=1):
    """Return the tooling by complement, without the ways of a room."""
    spec = load(written(folder, code, layers=layers), overrides)
    return complement(spec, cast_layers(spec))


def test_cup_base_layers_and_seals_fill_the_block(tmp_path):
    moulds = moulds_of(tmp_path, lugs(), layers=2)
    spec, drawn = moulds.spec, complement(moulds.spec, cast_layers(moulds.spec))
    depths = {1: 0.0, 2: spec.moulds.groove_depth_mm}  # the supports' holes leave cup 1 no room for a groove
    inner = drawn.dimensions.radii[1] + spec.moulds.land_mm
    ring_area = math.pi * ((inner + spec.moulds.groove_width_mm) ** 2 - inner**2)
    for step in moulds.plan.steps:

        def volume(shape, top=step.rim):
            solid = realise(shape, moulds.segments).trim_by_plane((0, 0, 1), 0.0)
            return solid.trim_by_plane((0, 0, -1), -top).volume()

        tools = [tool.shape for tool in drawn.tools if tool.name in ("base", step.cup)]
        filled = union((*tools, *drawn.seals[step.index - 1]))  # a seal reaches into the plinth
        parts = [filled, *step.layer, *step.earlier]
        block = volume(cup_blank(moulds.frame, step.rim)) - depths[step.index] * ring_area
        assert sum(map(volume, parts)) == pytest.approx(block, rel=1e-4)
        assert volume(drawn.seals[step.index - 1][0]) > 1
    assert len(moulds.solids["base"].trim_by_plane((0, 0, 1), 0.01).decompose()) == 3  # a core and two supports


@pytest.mark.parametrize("overrides", [[], ["moulds.cavities=[2,1]"], ["moulds.printer=fdm-0.25"]])
def test_strap_lugs_keep_every_check(tmp_path, overrides):
    found = check_moulds(moulds_of(tmp_path, lugs(), *overrides, layers=2))
    assert [finding for finding in found if not finding.ok] == []
    assert {finding.code for finding in found} == set(mould_checks())


def test_lugs_at_the_skin_hold_air(tmp_path):
    assert broken(moulds_of(tmp_path, lugs(low=0.0, high=1.5), layers=2)) == {"C400"}


def test_a_support_with_a_knife_edge_has_no_clearance(tmp_path):
    """Lugs as wide as the body meet its round corner in an edge without thickness."""
    assert broken(moulds_of(tmp_path, lugs(half=7.25), layers=2)) == {"C210"}


DOME = (
    "def unit(spec):\n    return Revolve(Profile(((3.5, 0, 0), (7, 0, 0.15), FLAT(0, 4, 0), (0, 2, 0), (3.5, 2, 0))))\n"
)


def test_a_dome_has_no_opening_to_pour_into(tmp_path):
    with pytest.raises(
        Refusal, match="pour 1 can't be cast: the layer's top, at x = 0, y = 0, z = 4 mm, leaves an"
    ) as bad:
        by_complement(tmp_path, DOME.replace("FLAT", ""))
    sentence = str(bad.value)
    assert (
        "to pour silicone takes 2 mm2 and a circle of 0.4 mm: give it a flat top, such as a disc of 1.6 mm" in sentence
    )
    assert sentence.endswith("--only unit makes only the unit")
    for flat, fits in ((0.79, False), (0.8, True), (1.0, True)):
        code = DOME.replace("FLAT", f"({flat}, 4, 0), ")
        if not fits:
            with pytest.raises(Refusal, match=f"an opening of {math.pi * flat**2:.2g} mm2"):
                by_complement(tmp_path, code)
            continue
        area = next(f for f in check_moulds(moulds_of(tmp_path, code)) if f.code == "C410")
        assert area.ok
        assert area.value == pytest.approx(math.pi * flat**2, rel=2e-3)


def test_a_layer_below_its_rim_has_no_opening(tmp_path):
    code = "def unit(spec):\n    return {'layer1': ring(4, 5, 0, 3), 'layer2': ring(5, 7, 0, 2)}\n"
    with pytest.raises(
        Refusal, match=r"pour 2 can.t be cast: the layer.s top, at .*, z = 2 mm, leaves an opening of 0 mm2"
    ):
        by_complement(tmp_path, code, layers=2)


@pytest.mark.parametrize(
    ("drawn", "layers", "why"),
    [
        (
            "cut(cylinder(7, 0, 4), [cylinder(5, 1, 5)])",
            1,
            "pour 1 .* on all sides but above, for a lid; nearest accepted: 'injected'",
        ),
        ("cut(cylinder(7, 0, 4), [cylinder(5, 1, 3)])", 1, "pour 1 .* closed in by silicone below and above"),
        ("cut(cylinder(7, 0, 4), [ring(6, 8, 1, 3)])", 1, "closed in by silicone below and above"),
        ("cylinder(7, -1, 4)", 1, "pour 1 .* 1 mm below the skin"),
        ("{'layer1': cylinder(7, 2, 4), 'layer2': cylinder(5, 0, 2)}", 2, "layer 2 is under layer 1"),
        ("{'layer1': ring(4, 7, 0, 2), 'layer2': cylinder(4, 0, 2)}", 2, "a later layer takes its place"),
        ("{'frame': cylinder(7, 0, 4)}", 1, r"needs? each of the spec's 1 \[\[layers\]\] drawn"),
    ],
)
def test_what_has_no_mould_is_refused_with_pour_and_place(tmp_path, drawn, layers, why):
    with pytest.raises(Refusal, match=why):
        by_complement(tmp_path, f"def unit(spec):\n    return {drawn}\n", layers=layers)


def test_the_core_of_a_gel_hangs_from_the_lid(tmp_path):
    """A fingertip gel: a ball's cap with a flange, hollow from above. The core's volume is the hollow's."""
    arc = [(math.sin(math.radians(a)), 1 - math.cos(math.radians(a))) for a in range(0, 61, 5)]

    def cap(radius, tip, *above):
        return Revolve(polygon(*((radius * x, tip + radius * z) for x, z in arc), *above))

    hollow = cap(9.5, 2.5, (9.5 * arc[-1][0], 10), (0, 10))
    gel = cut(cap(12, 0, (13, 6), (13, 9), (0, 9)), [hollow])
    (tmp_path / "gel.stl").write_bytes(printing.stl(*arrays(realise(gel, 32)), "gel"))
    spec = tmp_path / "spec.toml"
    keys = 'name = "gel"\ndesign = "gel.stl"\ndiameter_mm = 26.0\nmotor = false\n'
    spec.write_text(f'{keys}{LAYER}[moulds]\npour = "injected"\n')
    moulds = MouldSet(load(spec))
    assert [finding for finding in check_moulds(moulds) if not finding.ok] == []
    assert mesh_findings(moulds) == []
    (step,) = moulds.plan.steps
    assert moulds.hung(step) == pytest.approx(6.5, abs=1e-3)
    below = moulds.solids["lid1"].trim_by_plane((0, 0, -1), -9 + 1e-6)
    room = realise(hollow, 32).trim_by_plane((0, 0, -1), -9)
    assert max(piece.volume() for piece in below.decompose() if piece.genus() == 0) == pytest.approx(
        room.volume(), rel=1e-3
    )
    text = to_markdown(procedure(moulds, (1900.0,), 30000.0))
    assert "Hang the core: lower it with lid 1 straight into the cavity" in text
    assert "Peel off silicone that came up on the core." in text


@pytest.mark.parametrize("drawn", ["ring(4, 7, 0, 2)", "cut(cylinder(7, 0, 4), [cylinder(5, 1, 5)])"])
def test_a_lid_keeps_every_check(tmp_path, drawn):
    """Also a gang's, whose lid carries two cores."""
    for cavities in ("[1,1]", "[2,1]"):
        moulds = moulds_of(
            tmp_path,
            f"def unit(spec):\n    return {drawn}\n",
            "moulds.pour=injected",
            f"moulds.cavities={cavities}",
            "motor=false",
        )
        assert [finding for finding in check_moulds(moulds) if not finding.ok] == []
        assert moulds.hung(moulds.plan.steps[0]) == (3.0 if "cut" in drawn else 0.0)


def test_a_ring_gets_the_tools_of_an_embedded_control(tmp_path):
    """The same tools, solid by solid, as those that are drawn from lengths; only the engraved label differs."""
    known = of_spec(load("single-embedded"))
    (radius,), inner, (height,) = known.dimensions.radii, known.dimensions.cavity_radius, known.dimensions.heights
    code = f"def unit(spec):\n    return ring({inner}, {radius}, 0, {height})\n"
    moulds = moulds_of(tmp_path, code, f"diameter_mm={2 * radius}", "output.tolerance_mm=0.01")
    depth = moulds.spec.moulds.engraving_depth_mm
    for name, top in (("base", -moulds.spec.moulds.plinth_height_mm), ("cup1", height)):
        solid, other = moulds.solids[name], known.solids[name]
        differ = (solid - other) + (other - solid)
        assert differ.is_empty() or differ.trim_by_plane((0, 0, -1), -(top - depth - 0.01)).volume() < 1e-6
    assert broken(moulds) == set()


CUSTOM = templates()["embedded"].parent / "custom"
FLAT_TOP = {"parameters.flat_mm": 1.6}


OWN = """
from unitcad.designs import Design
from unitcad.designs.dimensions import concentric
unit = Design(
    "own",
    "a ring",
    layers=lambda spec, dims: {"layer1": ring(5.5, 7, 0, 3)},
    dimensions=lambda spec: concentric(spec, spec.motor.thickness_mm, None),
    MORE
)
"""


def assembly_of(moulds):
    casting = procedure(moulds, [moulds.solids[step.name].volume() for step in moulds.plan.steps], 0.0)
    return tuple(step.text for step in casting.assembly if not step.title.startswith("Let the"))


def test_motor_and_circuit_of_a_function_are_put_in():
    solder, push = assembly_of(of_spec(load(CUSTOM / "strap-lugs.toml")))
    assert solder.startswith("Solder the motor to the circuit's pad")
    way = "Push the motor, the pad ahead, into the cavity from the skin's side, and lay the tail in the notch."
    assert 0 < push.index("Coat the pad") + 1 < push.index(way)
    assert "The design's file says no more of the assembly" in push


@pytest.mark.parametrize(
    ("more", "first"),
    [
        ("", "Push the motor into the cavity from the skin's side."),
        ("opens='above'", "Push the motor into the cavity from above."),
        ("assembly=lambda spec, dims: ['Glue it in.']", "Glue it in."),
    ],
)
def test_the_motor_goes_in_where_the_design_opens_or_as_it_says(more, first, tmp_path):
    steps = assembly_of(of_spec(load(written(tmp_path, OWN.replace("MORE", more)))))
    assert first in steps[0]
    assert len(steps) == 1


@pytest.mark.parametrize(("name", "change"), [("strap-lugs", {}), ("film-closed", {}), ("dome", FLAT_TOP)])
def test_the_worked_examples_are_built_whole(name, change, tmp_path):
    spec = load(CUSTOM / f"{name}.toml", change | {"output.formats": ["stl", "svg"]})
    done = build(spec, tmp_path)
    assert done.ok
    assert [finding for finding in done.manifest["mould_checks"] if not finding["ok"]] == []
    assert done.manifest["check"]["errors"] == 0
    pours = [f"moulds/step{i + 1}-cup.stl" for i in range(len(spec.layers))]
    assert {"casting.md", "bom.csv", "moulds/base.stl", "step1-section.svg", *pours} <= set(done.manifest["files"])


def test_a_body_without_a_mould_is_refused_and_nothing_is_written(tmp_path):
    code = "def unit(spec):\n    return cut(cylinder(7, 0, 4), [cylinder(5, 1, 3)])\n"
    with pytest.raises(Refusal, match=r"is closed (in|all round)"):
        built(tmp_path, code, "moulds")
    assert not list((tmp_path / "out").rglob("*.*"))
    assert built(tmp_path, code).folder.is_dir()


def test_every_worked_example_has_its_test():
    names = {file.stem for file in CUSTOM.glob("*.toml")}
    assert names == {"strap-lugs", "film-closed", "dome"}
    assert not names & set(templates())
    assert set(custom_templates()) == {f"custom/{name}" for name in names}
    assert load("custom/dome") == load(CUSTOM / "dome.toml")
    with pytest.raises(UnitcadError, match="closest: custom/strap-lugs"):
        load("strap-lugs")
