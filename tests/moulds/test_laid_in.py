"""Motor and circuit that are laid into the mould before a pour, and stay: the film-closed unit."""

import math
from dataclasses import replace

import pytest
from faulty_sets import broken, of_spec, with_fault

from unitcad.casting.procedure import procedure
from unitcad.casting.procedure_text import to_markdown
from unitcad.checks import check_moulds
from unitcad.errors import Refusal, UnitcadError
from unitcad.kernels.mesh import bounds
from unitcad.pipeline.scenes import exploded_moves, moments, unit_apart
from unitcad.pipeline.write import build
from unitcad.shape import box, cut, moved
from unitcad.validation import load, templates

FILM = templates()["embedded"].parent / "custom" / "film-closed.toml"
CODE = FILM.with_suffix(".py").read_text("utf-8")


def altered(folder, old, new, *changes):
    """Return the mould set of the film-closed unit with something of its code put otherwise."""
    assert old in CODE
    (folder / "film-closed.py").write_text(CODE.replace(old, new))
    (folder / "film.toml").write_text(FILM.read_text("utf-8"))
    return of_spec(load(folder / "film.toml", changes))


def test_silicone_motor_and_circuit_fill_the_disc():
    """Film, body, motor and circuit within the outer radius are the whole cylinder, computed on its polygon."""
    moulds = of_spec(load(FILM))
    radius, top = moulds.dimensions.outer_radius, moulds.dimensions.heights[-1]
    tail = moulds.solids["fpcb"] - moulds.solids["fpcb"].trim_by_plane((-1, 0, 0), -radius)
    inside = moulds.solids["fpcb"].volume() - tail.volume()
    whole = sum(moulds.solids[name].volume() for name in ("layer1", "layer2", "motor")) + inside
    assert whole == pytest.approx(math.pi * radius**2 * top, rel=2e-4)
    assert bounds(moulds.solids["motor"])[2] == pytest.approx(1.11, abs=1e-3)  # film and circuit lie under it


@pytest.mark.parametrize(
    "changes", [[], ["moulds.cavities=[1,2]"], ['fpcb.tail="both"'], ["moulds.printer=sla"], ["layers.0.cap_mm=0.8"]]
)
def test_a_film_closed_unit_keeps_every_check(changes):
    assert [finding for finding in check_moulds(of_spec(load(FILM, changes))) if not finding.ok] == []


def test_the_cup_has_a_slot_over_the_tail_and_the_base_carries_it():
    """Without the slot the cup stands in the tail; without the base's rib silicone leaves under the tail."""
    moulds = of_spec(load(FILM))
    tail = moulds.plan.steps[1].inserts[1].shape
    # The tail itself as the only slot: nothing lets the cup pass it upwards.
    filled = with_fault(moulds, "cup2", lambda cup: cut(_whole(moulds), [tail]))
    assert "C300" in broken(filled)
    flat = with_fault(moulds, "base", lambda base: cut(base, [moved(tail, z=-0.5)]))
    assert "C100" in broken(flat)


def _whole(moulds):
    from unitcad.moulds.cup import cup

    return cup(replace(moulds.frame, dims=replace(moulds.plan.dimensions, exit=None)), 1)


def test_it_is_laid_in_between_the_pours(tmp_path):
    done = build(load(FILM, {"output.formats": ["stl"]}), tmp_path, only=("unit", "moulds", "casting"))
    assert done.ok
    text = (done.folder / "casting.md").read_text("utf-8")
    order = [text.index(words) for words in ("## Pour 2", "Wipe Layer 1", "Lay the circuit on it", "**Cup 2 on.**")]
    assert order == sorted(order)
    assert "## Motor in" not in text
    assert "core" not in text
    section = (done.folder / "step2-section.svg").read_text("utf-8")
    assert "<title>motor</title>" in section
    assert "nan" not in (done.folder / "section.svg").read_text("utf-8")
    kinds = {part["name"]: part["made"] for part in done.manifest["parts"]}
    assert (kinds["motor"], kinds["fpcb"], kinds["layer1"]) == ("bought", "bought", "cast")


def test_its_words_are_those_of_its_tools():
    """A groove only where the cup has one, no walls of rings, and what is laid in is not on the scale."""
    moulds = of_spec(load(FILM))
    casting = procedure(moulds, [moulds.solids[step.name].volume() for step in moulds.plan.steps], 0.0)
    spec, lay = moulds.spec, moulds.plan.layout
    for step, pour in zip(moulds.plan.steps, casting.pours, strict=True):
        # Measured: a groove takes the cup's material beside the land, half its width further out, under the rim.
        radius = moulds.plan.dimensions.radii[step.index - 1] + spec.moulds.land_mm + spec.moulds.groove_width_mm / 2
        probe = moved(box(-0.1, 0.1, -0.1, 0.1, step.rim - 0.1, step.rim), lay.cells[0].x, lay.cells[0].y + radius)
        (there,) = moulds.meshes([probe])
        open_there = (moulds.solids[step.cup] ^ there).is_empty()
        assert step.groove == open_there == any("into the groove" in each.text for each in pour.steps)
    assert [step.groove for step in moulds.plan.steps] == [False, True]
    text = to_markdown(casting)
    for words in ("Walls at the skin", "cups' play on the plinth", "Its outside", "without motor and circuit"):
        assert words not in text
    assert "0.630 g. What was laid in comes on top" in casting.measure[-1]
    coat = next(i for i, words in enumerate(casting.pours[1].steps) if "Coat the tail thinly" in words.text)
    assert [step.title for step in casting.pours[1].steps[coat + 1 : coat + 3]] == ["Grease the flanks", "Cup 2 on"]
    assert "petroleum jelly" in {item.item for item in casting.bill}


def test_pictures_show_it_laid_in():
    moulds = of_spec(load(FILM))
    parts = [(moment.title, set(moment.parts)) for moment in moments(moulds)]
    first = next(i for i, (_, there) in enumerate(parts) if "motor" in there)
    assert parts[first] == ("Pour 2: motor and circuit laid in", {"base", "layer1", "motor", "fpcb"})
    assert all("motor" in there for _, there in parts[first:])
    lifts = {name: offset[2] for name, offset in exploded_moves(moulds).items()}
    assert lifts["layer1"] < lifts["motor"] == lifts["fpcb"] < lifts["cup2"]
    assert list(unit_apart(moulds)) == ["layer1", "motor", "fpcb", "layer2"]


def test_what_can_not_be_laid_in_is_refused(tmp_path):
    with pytest.raises(Refusal, match=r"pour 2 can't be cast: an insert reaches above the rim at z = 2\.485 mm") as bad:
        altered(tmp_path, "film + inside + cap", "film + inside - 0.5 * cap")
    assert "--only unit" in str(bad.value)
    with pytest.raises(UnitcadError, match="laid_in is 3, and there are 2 pours"):
        altered(tmp_path, "laid_in=2", "laid_in=3")
    with pytest.raises(UnitcadError, match="laid_in is 'last', not the number of a pour"):
        altered(tmp_path, "laid_in=2", "laid_in='last'")
    with pytest.raises(UnitcadError, match="laid_in is None, not the number of a pour"):
        altered(tmp_path, "laid_in=2", "laid_in=None")
    with pytest.raises(Refusal, match="closed in by silicone below and above"):
        altered(tmp_path, "laid_in=2", "laid_in=0")
