"""The procedure's pictures: one for each step that names one, each piece seen, the same bytes each time."""

import io
import json
import re
from collections import Counter

import numpy as np
import pytest
from PIL import Image

from tests.sample_bodies import LEADLESS
from unitcad.casting.drawings import ARROW, BAND, CARD, TAPE, tongue_prop
from unitcad.casting.plates import made_pieces, mould_plates
from unitcad.casting.procedure import procedure
from unitcad.casting.views import SIZE, BenchPictures, View, picture_path, views
from unitcad.export.raster import Surface, aim, finish, render
from unitcad.kernels.mesh import arrays, bounds, realise
from unitcad.moulds.mould_set import MouldSet
from unitcad.pipeline.write import build
from unitcad.shape import box, moved
from unitcad.validation import load, templates

SETS = [
    *((name,) for name in templates()),
    ("encapsulating", "moulds.pour=injected", "moulds.cavities=[2,2]"),
    ("three-layer", "moulds.printer=sla"),
]


def titles(casting):
    """The titles of each part of a procedure."""
    parts = (casting.preparation, *(pour.steps for pour in casting.pours), casting.release, casting.assembly)
    return [[step.title for step in part] for part in parts]


def planned(*source):
    moulds = MouldSet(load(source[0], list(source[1:])))
    return moulds, procedure(moulds, [100.0] * len(moulds.plan.steps), 1000.0)


@pytest.fixture(name="planned")
def _of_specs():
    return planned


@pytest.mark.parametrize("source", SETS, ids=" ".join)
def test_every_picture_is_asked_for_and_every_one_asked_for_is_drawn(source, planned):
    moulds, casting = planned(*source)
    steps = [*casting.preparation, *(step for pour in casting.pours for step in pour.steps)]
    steps += [*casting.release, *casting.assembly]
    assert {step.picture for step in steps if step.picture} == {picture_path(name) for name in views(moulds)}
    for part in titles(casting):
        assert len(set(part)) == len(part)


@pytest.mark.parametrize("source", SETS, ids=" ".join)
def test_views_name_pieces_that_there_are(source, planned):
    moulds, _ = planned(*source)
    plan = moulds.plan
    tools = {body.name for body in (*plan.tools, *made_pieces(moulds), *plan.steps[-1].inserts)} | {
        step.name for step in plan.steps
    }
    for name, view in views(moulds).items():
        known = {body.name for body in (*moulds.unit, *moulds.plan.laid_later)} if view.group == "unit" else tools
        assert {part.name for part in view.parts} <= known, name


@pytest.mark.parametrize("source", SETS, ids=" ".join)
def test_a_picture_shows_the_state_that_its_words_speak_of(source, planned):
    """Nothing moves while it cures, tape stays until it is taken off, filament comes after the dry fit."""
    moulds, casting = planned(*source)
    shown = {picture_path(name): view for name, view in views(moulds).items()}
    for pour in casting.pours:
        held = False
        for step in pour.steps:
            view = shown.get(step.picture)
            held = (held or step.title.startswith("Hold")) and "Remove its" not in step.text
            if view is None:
                continue
            colours = {extra.colour for extra in view.extras}
            assert bool(colours & {TAPE, BAND}) == held, f"{step.title}: tape or bands"
            if step.kind == "cure":
                assert ARROW not in colours
                assert not any(part.name == "blade" for part in view.parts)
    fit = next(step for step in casting.preparation if step.title == "Try every cup, dry")
    assert not any(part.name.startswith("filament") for part in shown[fit.picture].parts)


def seen(content):
    return np.asarray(Image.open(io.BytesIO(content)).convert("RGB")).astype(int)


def hues(content, colour):
    """How many pixels have the hue of a colour, light or dark."""
    pixels = seen(content).reshape(-1, 3)
    own = np.array(colour) / np.linalg.norm(colour)
    bright = np.linalg.norm(pixels, axis=1)
    return int((((pixels @ own) > 0.9995 * bright) & (bright > 60)).sum())


def pictures(moulds):
    bench = BenchPictures(moulds)
    return {picture_path(name): bench.picture(name) for name in bench.names}


def test_pictures_show_what_their_views_hold_and_repeat_to_the_byte():
    moulds, _ = planned("encapsulating")
    drawn, shown = pictures(moulds), views(moulds)
    assert drawn == pictures(MouldSet(moulds.spec))
    for name, view in shown.items():
        content = drawn[picture_path(name)]
        width, height = Image.open(io.BytesIO(content)).size
        assert width == SIZE[0]
        assert height <= SIZE[1]
        arrows = any(extra.colour == ARROW for extra in view.extras)
        assert (hues(content, ARROW) > 30) == arrows, name
    tongue = next(tool.colour for tool in moulds.plan.tools if tool.kind == "tongue")
    there = {name for name in shown if hues(drawn[picture_path(name)], tongue) > 100}
    assert there == {name for name, view in shown.items() if any(part.name == "tongue" for part in view.parts)}


def test_a_nearer_body_hides_one_behind_it_whatever_the_order():
    eye, points = (0.0, -1.0, 0.0), np.array([[-2.0, -2.0, -2.0], [2.0, 2.0, 2.0]])
    camera = aim(eye, points, (40, 40))

    def drawn(y, colour):
        return render(Surface(*arrays(realise(moved(box(-1, 1, -0.5, 0.5, -1, 1), y=y), 32)), colour), camera)

    near, far = drawn(-1, (1, 0, 0)), drawn(1, (0, 1, 0))
    one, other = finish([near, far], camera), finish([far, near], camera)
    assert one == other
    red, green, blue = seen(one)[20, 20]
    assert red > 200
    assert green == blue == 0
    assert (seen(finish([far], camera))[20, 20] == [0, red, 0]).all()
    assert (seen(one)[1, 1] == 255).all()


@pytest.mark.parametrize("source", SETS, ids=" ".join)
def test_what_words_name_is_named_in_the_picture(source, planned):
    """What a step speaks of beside the pieces stands in its picture under the same name."""
    moulds, casting = planned(*source)
    shown = {picture_path(name): view for name, view in views(moulds).items()}
    steps = [*casting.preparation, *(step for pour in casting.pours for step in pour.steps)]
    wanted = {
        "Try every cup, dry": "cut corner",
        "Tongue home": "card",
        "Tongue out FIRST": "card",
        "Inject": "sprue, vent",
    }
    for step in steps:
        names = {name.text for name in shown[step.picture].names} if step.picture else set()
        assert set(wanted.get(step.title, "").split(", ")) - {""} <= names, step.title
        if step.title == "Tongue in, grease":
            length = step.text.partition("Stop ")[2].partition(" mm")[0]
            assert names == {f"grease {length} mm"}
        if step.title.endswith(" off") and step.title.startswith("Cup"):
            assert names == {"screwdriver"}
        if step.title.startswith("Hold cup"):
            assert names == {"tape"}


@pytest.mark.parametrize("cavities", ["[1,1]", "[2,2]", "[1,3]"])
@pytest.mark.parametrize("name", ["embedded", "encapsulating"])
def test_sprue_and_vent_point_at_the_silicone_in_them(name, cavities):
    moulds, _ = planned(name, "moulds.pour=injected", f"moulds.cavities={cavities}")
    for step in moulds.plan.steps:
        count = len(step.channels) // len(moulds.plan.layout.cells)
        for view, words in (("inject", ("sprue", "vent")), ("filled", ("touch here",))):
            named = {one.text: one.at for one in views(moulds)[f"pour{step.index}-{view}"].names}
            for word in words:
                x, y, z = named[word]
                probe = realise(moved(box(-0.1, 0.1, -0.1, 0.1, -0.2, 0), x, y, z), 32)
                held = [(realise(each, 32) ^ probe).volume() > 0.99 * probe.volume() for each in step.channels]
                assert held.count(True) == 1, f"{word} of pour {step.index}"
                assert (held.index(True) % count == 0) == (word == "sprue")


def test_a_build_writes_the_pictures_and_names_them(tmp_path):
    done = build(load("embedded"), tmp_path, only=("casting",), check=False)
    text = (done.folder / "casting.md").read_text("utf-8")
    listed = {path for path in done.manifest["files"] if path.startswith("steps/")}
    assert listed
    assert all(f"]({path})" in text and (done.folder / path).is_file() for path in listed)
    # The tools are counted in the print's time and volume, though no file of them is asked for.
    assert json.loads((done.folder / "casting.json").read_bytes())["printing"]["cm3"] > 9


def test_a_view_is_data():
    """Under open pours nothing is meshed to name the pictures."""
    assert all(isinstance(view, View) for view in views(planned("encapsulating")[0]).values())


def test_what_strikes_off_passes_what_stands_on_the_base():
    """Strap slots' supports stand above rim 1: a strip takes the blade's place, and its way is free."""
    moulds, casting = planned("templates/custom/strap-lugs.toml")
    base = realise(moulds.plan.of_kind("base")[0].shape, 32)
    view, rim = views(moulds)["pour1-strike"], moulds.plan.steps[0].rim
    assert not any(part.name == "blade" for part in view.parts)
    strip = realise(next(moved(extra.shape, *extra.moved) for extra in view.extras if extra.colour == CARD), 32)
    x0, y0, _, _, y1, top = strip.bounding_box()
    way = realise(box(x0, -x0, y0, y1, rim, top), 32)
    assert (way ^ base).volume() < 1e-9
    assert (realise(box(x0, -x0, -20, 20, rim, top), 32) ^ base).volume() > 1
    assert "strip" in next(step.text for step in casting.pours[0].steps if step.title == "Strike off")
    assert any(part.name == "blade" for part in views(moulds)["pour2-strike"].parts)


@pytest.mark.parametrize(
    "source",
    [
        ("encapsulating",),
        ("motor-10mm",),
        ("pass-through", "moulds.cavities=[1,3]"),
        ("encapsulating", "moulds.cavities=[2,2]"),
        ("three-layer", "moulds.printer=sla"),
    ],
    ids=" ".join,
)
def test_tongues_lie_on_ledge_and_pad(source):
    """Each tongue's centre of mass lies over its pad, which touches it and stands on the plate without tipping."""
    moulds, _ = planned(*source)
    prop, base = tongue_prop(moulds), realise(moulds.plan.of_kind("base")[0].shape, 32)
    assert prop is not None
    pads = [realise(pad, 32) for pad in prop.pads]
    assert len(pads) == len({side for cell in moulds.plan.layout.cells for side in cell.sides})
    for pad in pads:
        x0, y0, z0, x1, y1, z1 = pad.bounding_box()
        assert z1 - z0 == pytest.approx(prop.thickness_mm, abs=0.01)
        below = realise(box((x0 + x1) / 2 - 0.1, (x0 + x1) / 2 + 0.1, y0, y1, z0 - 0.5, z0), 32) ^ base
        assert below.volume() > 0
        for step in moulds.plan.steps:
            assert (pad ^ realise(moulds.plan.tool(step.cup).shape, 32)).volume() < 1e-6
    for tool in moulds.plan.of_kind("tongue"):
        solid = realise(tool.shape, 32)
        _, _, z0, _, _, z1 = solid.bounding_box()
        loops = solid.slice((z0 + z1) / 2).to_polygons()
        centre = sum(_moment(loop) for loop in loops) / sum(_area(loop) for loop in loops)
        assert any(p[0] < centre < p[3] and abs(p[5] - z0) < 0.01 for p in (pad.bounding_box() for pad in pads))


def _area(loop):
    x, y = loop.T
    return float((x * np.roll(y, -1) - np.roll(x, -1) * y).sum() / 2)


def _moment(loop):
    x, y = loop.T
    u, v = np.roll(x, -1), np.roll(y, -1)
    return float(((x + u) * (x * v - u * y)).sum() / 6)


STATES = [
    *SETS,
    ("embedded", "skin_mm=0.5"),
    ("encapsulating", "motor.lip_mm=0.5"),
    ("no-fpcb", "design=embedded", "layers=[{ material = 'ecoflex-00-10', wall_mm = 2.5 }]"),
    (LEADLESS,),
    (LEADLESS, "design=embedded", "layers=[{ material = 'ecoflex-00-10', wall_mm = 2.5 }]"),
    ("templates/custom/film-closed.toml",),
    ("templates/custom/strap-lugs.toml",),
    ("docs/gallery/gel-pad.toml",),
]


@pytest.mark.parametrize("source", STATES, ids=" ".join)
def test_each_picture_has_in_it_what_its_step_says(source, planned):
    """A second account of the bench, from the steps' words only: the pieces on it, the moving one, the side up."""
    moulds, casting = planned(*source)
    shown = {picture_path(name): view for name, view in views(moulds).items()}
    for pour in casting.pours:
        _follow_pour(moulds, pour, shown)
    for step in casting.assembly:
        if step.picture:
            _motor_as_said(moulds, step, shown[step.picture])
    pushed = [step for step in casting.assembly if re.search(r"\b(Push|Set|Lay the circuit)\b", step.text)]
    assert all(step.picture for step in pushed)


def _follow_pour(moulds, pour, shown):
    """Compare each picture of a pour with the pieces that its words have put on, moved and taken off."""
    n, tongues = pour.index, {tool.name for tool in moulds.plan.of_kind("tongue")}
    cup, lid, layer = f"cup{n}", f"lid{n}", f"layer{n}"
    there = set[str]()  # the pieces of this pour that are in their places
    for step in pour.steps:
        title, moving = step.title, set[str]()
        if title == f"Cup {n} on":
            moving = {cup}
        elif title.startswith("Tongue in"):
            moving = tongues
        elif title == "Tongue home":
            there |= tongues
        elif title == f"Lid {n} on":
            moving = {lid}
        elif title in ("Pour", "Inject"):
            there |= {layer}
        elif title == "Tongue out FIRST":
            moving, there = tongues, there - tongues
        elif title in ("Lid off", f"Lid {n} off"):
            moving, there = {lid}, there - {lid}
        elif title == f"Cup {n} off":
            moving, there = {cup}, there - {cup}
        if step.picture in shown:
            of_pour = {cup, lid, layer} | tongues
            parts = [part for part in shown[step.picture].parts if part.name in of_pour]
            assert {part.name for part in parts if not any(part.moved)} == there, title
            assert {part.name for part in parts if any(part.moved)} == moving, title
        there |= moving & ({cup} if title.endswith(" on") else set())
        there |= {lid} if title == f"Lid {n} on" else set()


def _motor_as_said(moulds, step, view):
    """Check that motor and leads are where a step's words have them, and the side up that these name."""
    text, below = step.text, moulds.design.opens == "below"
    arrows = any(extra.colour == ARROW for extra in view.extras)
    if "skin" in step.title.lower():
        _skin_as_said(moulds, step, view)
        return
    if "mouth up" in text or "cavities' mouths up" in text or "from the skin's side" in text:
        assert below
        assert view.turned
    if "skin side down" in text or "from above" in text:
        assert not view.turned
    bodies = {body.name: body for body in (*moulds.unit, *moulds.plan.laid_later) if body.kind == "motor"}
    motors = [bounds(moulds.mesh(body)) for body in bodies.values()]
    assert motors
    placed = [part for part in view.parts if part.name in bodies]
    low, high = min(box[2] for box in motors), max(box[5] for box in motors)
    moved = {part.moved for part in placed} or {extra.moved for extra in view.extras if any(extra.moved)}
    by = next(iter(moved), (0.0, 0.0, 0.0))
    body = bounds(moulds.mesh(next(body for body in moulds.unit if body.kind == "layer")))
    if step.title.startswith("Let the"):
        assert not any(any(each) for each in moved)
        assert not arrows
    elif "next to it" in text:
        assert by[0] > body[3] - motors[0][0]
    elif "before the cavity's mouth" in text:
        assert high + by[2] < body[2]
        assert below
        leads = [bounds(realise(extra.shape, 32)) for extra in view.extras if extra.colour != ARROW]
        exit = moulds.dimensions.exit
        assert leads
        for lead in leads:  # from the motor's height through the slot to the outside
            assert lead[2] < low + by[2] + high
            assert exit.low - 0.02 <= lead[5] <= exit.high + 0.02
            assert max(-lead[0], lead[3]) > moulds.dimensions.outer_radius
    elif re.search(r"\b(Push|Set|Lay the circuit in)\b", text):
        assert arrows
        assert high + by[2] < body[2] if below else low + by[2] > body[5] - 1e-9
    else:
        assert not any(by)


def _skin_as_said(moulds, step, view):
    """The film alone while its tray is filled; then the unit with its motor over it; at last on it, still."""
    rim, arrows = moulds.dimensions.heights[-1], any(extra.colour == ARROW for extra in view.extras)
    film, *inside = [extra for extra in view.extras if extra.colour != ARROW]
    cast = [part for part in view.parts if part.name.startswith("layer")]
    bought = [body for body in moulds.unit if body.made == "bought"]
    if step.title == "Fill the skin tray":
        assert not cast
        assert not inside
        return
    assert len(cast) == len(moulds.plan.steps)
    assert [extra.colour for extra in inside] == [body.colour for body in bought for _ in moulds.plan.layout.cells]
    lifts = {item.moved[2] for item in (*cast, *inside)}
    assert arrows == (step.title == "Skin on")
    assert lifts == {rim} if step.title == "Let the skin cure" else min(lifts) > rim
    assert bounds(realise(film.shape, 32))[5] == pytest.approx(rim)


@pytest.mark.parametrize("source", STATES, ids=" ".join)
def test_bill_plate_sheet_and_picture_count_the_same_pieces(source, planned):
    moulds, casting = planned(*source)
    counts = {
        "plate": Counter(body.kind for plate in mould_plates(moulds).values() for body in plate),
        "picture": Counter(
            next(piece.kind for piece in made_pieces(moulds) if piece.name == part.name)
            for part in views(moulds)["pieces"].parts
            if next(piece.made for piece in made_pieces(moulds) if piece.name == part.name) == "printed"
        ),
        "bill": Counter(),
    }
    for item in casting.bill:
        if item.made.startswith("printed"):
            kind = next(p.kind for p in made_pieces(moulds) if item.item in (moulds.plan.called(p.name), p.kind))
            counts["bill"][kind] += int(item.quantity)
    assert counts["plate"] == counts["picture"] == counts["bill"]
    sheet = casting.printing.how[0]
    assert ("spare tongue" in sheet) == (counts["plate"]["tongue"] > len(moulds.plan.of_kind("tongue")))


def test_times_name_their_temperature_and_what_other_rooms_do():
    """Twice as fast 10 K warmer: a root of two for 5 K."""
    _, casting = planned("encapsulating", "casting.room_c=23")
    mix = next(step for step in casting.pours[0].steps if step.kind == "mix").text
    assert "30 min at 23 degC" in mix
    assert f"At 18 degC pot life and cure take {2**0.5:.1f} times as long, at 28 degC {0.5**0.5:.2f} times" in mix
    assert "rule of thumb" in mix
    cure = next(step for step in casting.pours[1].steps if step.kind == "cure").text
    assert "16 h at 23 degC" in cure
    assert "24 h at 23 degC" in casting.assembly[-1].text
    cold = next(s for s in planned("encapsulating", "casting.room_c=13")[1].pours[0].steps if s.kind == "mix").text
    assert "60 min at 13 degC" in cold


OF_EVERY_SET = (
    test_each_picture_has_in_it_what_its_step_says,
    test_every_picture_is_asked_for_and_every_one_asked_for_is_drawn,
    test_views_name_pieces_that_there_are,
    test_a_picture_shows_the_state_that_its_words_speak_of,
    test_what_words_name_is_named_in_the_picture,
)
"""The tests of any set's pictures; `planned` makes the set and its procedure from the words of a build."""
