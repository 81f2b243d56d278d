"""Every rule of the procedure: the shipped sets keep it, and a planted fault breaks it."""

from dataclasses import replace

import pytest
from casting_rules import broken_rules

from tests.sample_bodies import LEADLESS
from unitcad.casting.procedure import procedure
from unitcad.casting.sentences import say
from unitcad.moulds.mould_set import MouldSet
from unitcad.validation import load, templates

STRAPS = ("templates/custom/strap-lugs.toml",)
LIDS = ("encapsulating", "moulds.pour=injected", "moulds.cavities=[2,2]")
FILM = ("templates/custom/film-closed.toml",)
RESIN = ("three-layer", "moulds.printer=sla")
LOOSE = (LEADLESS, "design=embedded", "layers=[{ material = 'ecoflex-00-10', wall_mm = 2.5 }]")


def casting(*source):
    moulds = MouldSet(load(source[0], list(source[1:])))
    return procedure(moulds, [100.0] * len(moulds.plan.steps), 1000.0)


WAYS = ((), ("moulds.printer=sla",), ("casting.vacuum=false",))


@pytest.mark.parametrize(
    "source", [*((name, *way) for name in templates() for way in WAYS), LIDS, FILM, STRAPS], ids=" ".join
)
def test_every_set_keeps_every_rule(source):
    assert broken_rules(casting(*source)) == []


def of_first_pour(made, change):
    return replace(made, pours=(change(made.pours[0]), *made.pours[1:]))


def without_pictures(made):
    return of_first_pour(made, lambda pour: replace(pour, steps=tuple(replace(s, picture="") for s in pour.steps)))


def opened_first(made):
    def change(pour):
        cure = [step for step in pour.steps if step.kind == "cure"]
        return replace(pour, steps=(*(step for step in pour.steps if step.kind != "cure"), *cure))

    return of_first_pour(made, change)


def short_cure(made):
    return of_first_pour(
        made,
        lambda pour: replace(
            pour, steps=tuple(replace(s, wait_min=s.wait_min / 2) if s.kind == "cure" else s for s in pour.steps)
        ),
    )


def adhesive_left_wet(made):
    return replace(made, assembly=made.assembly[:-1])


def too_little(made):
    return of_first_pour(made, lambda pour: replace(pour, part_a_g=0.05, part_b_g=0.05))


def syringe_forgotten(made):
    return of_first_pour(
        made, lambda pour: replace(pour, figures=tuple(f for f in pour.figures if "syringe" not in f.name))
    )


def no_grip(made):
    return replace(made, preparation=tuple(replace(s, text="") for s in made.preparation))


def reworded(old, new):
    def change(pour):
        return replace(pour, steps=tuple(replace(s, text=s.text.replace(old, new)) for s in pour.steps))

    return lambda made: replace(made, pours=tuple(map(change, made.pours)))


greased_with_nothing_named = reworded("petroleum jelly", "something")
NO_AGENT = say("cup_on.no_agent")
tilted_by_tape = reworded(say("hold.level_again"), "")


def unbought(word):
    return lambda made: replace(made, bill=tuple(item for item in made.bill if word not in item.item))


def no_time_to_prepare(made):
    return replace(made, preparation=tuple(replace(s, minutes=0.0, wait_min=0.0) for s in made.preparation))


def ring_not_bought(made):
    """The bill of the pours alone: 2 g of Layer 1's silicone, half of each part, are missing."""
    inner = made.pours[0].material
    bill = [replace(i, quantity=i.quantity - 1.0) if i.item.startswith(f"{inner} part") else i for i in made.bill]
    return replace(made, bill=tuple(bill))


def adhesive_in_a_hurry(made):
    *steps, cure = made.assembly
    return replace(made, assembly=(*steps, replace(cure, wait_min=60 * made.pours[-1].cure_h)))


def coated_before_mixed(made):
    def change(pour):
        mixing = [step for step in pour.steps if step.kind in ("weigh", "mix")]
        rest = [step for step in pour.steps if step.kind not in ("weigh", "mix")]
        return replace(pour, steps=(*rest, *mixing))

    return replace(made, pours=tuple(map(change, made.pours)))


def greased_too_late(made):
    """The order that a cup already on its base makes impossible."""

    def change(pour):
        grease = [step for step in pour.steps if step.title == "Grease the flanks"]
        rest = [step for step in pour.steps if step.title != "Grease the flanks"]
        on = next(i for i, step in enumerate(rest) if step.title == f"Cup {pour.index} on")
        return replace(pour, steps=(*rest[: on + 1], *grease, *rest[on + 1 :]))

    return replace(made, pours=tuple(map(change, made.pours)))


def pulled_on_the_bench(made):
    out = "Lift the mould off the bench"
    return replace(made, release=tuple(replace(s, text=s.text.removeprefix(out)) for s in made.release))


def without_step(words):
    """Leave out what a step does, in the preparation and in the first pour."""

    def left(steps):
        return tuple(step for step in steps if words not in f"{step.title}: {step.text}")

    def plant(made):
        made = replace(made, preparation=left(made.preparation))
        return of_first_pour(made, lambda pour: replace(pour, steps=left(pour.steps)))

    return plant


PLANTED = {
    "agent on a bond face": (("encapsulating",), reworded("bore of cup", "core of cup"), "not on the last cup's bore"),
    "agent too early": (
        ("encapsulating",),
        reworded(NO_AGENT, "Release agent, if any, only on the bore of cup 1, away from the core."),
        "agent before the last pour",
    ),
    "agent not told": (("encapsulating",), reworded(NO_AGENT, ""), "says nothing of release agent"),
    "no degassing": (("encapsulating",), without_step("Degas for"), "pour 1: not degassed"),
    "no vacuum": (("encapsulating",), lambda made: replace(made, vacuum=False), "the bill asks for a vacuum"),
    "cup not held": (("encapsulating",), without_step("Hold cup 1 down"), "nothing holds the cup down"),
    "tongue left in": (("encapsulating",), without_step("Tongue out FIRST"), "the cup is lifted over a tongue"),
    "windows of resin": (RESIN, without_step("Clear the windows"), "cup 1 is not cleared of resin"),
    "filament under a unit's mould": (("encapsulating",), pulled_on_the_bench, "while the mould lies on them"),
    "tape under the plate": (("encapsulating",), tilted_by_tape, "look at the level again"),
    "lids' bands": (LIDS, tilted_by_tape, "look at the level again"),
    "a coat before the mix": (FILM, coated_before_mixed, "uses the mix before"),
    "grip hangs": (("encapsulating",), reworded("stacked card", "nothing"), "nothing bears"),
    "ledge under Layer 1": (
        ("three-layer",),
        reworded("under Layer 1,", "no gap at the core, none under it,"),
        "pour 2: asks to look",
    ),
    "no spatula": (("embedded",), unbought("spatula"), "blunt spatula"),
    "no varnish": (RESIN, unbought("varnish"), "acrylic varnish"),
    "no preparation": (RESIN, no_time_to_prepare, "Wash: takes no time"),
    "ring not bought": (LOOSE, ring_not_bought, "the bill lacks silicone"),
    "adhesive not cured for a day": (("encapsulating",), adhesive_in_a_hurry, "another's time"),
    "no picture": (("encapsulating",), without_pictures, "has no picture"),
    "not levelled": (("encapsulating",), without_step("Level the"), "levelled"),
    "opened before the cure": (("encapsulating",), opened_first, "opened before the cure"),
    "cured too short": (("encapsulating",), short_cure, "less than the silicone takes"),
    "tacky is not told": (("embedded",), reworded(say("cure.done"), ""), "tacky"),
    "adhesive not cured": (("encapsulating",), adhesive_left_wet, "what holds the motor is not cured"),
    "too little mixed": (("encapsulating",), too_little, "mixes less"),
    "syringe holds back": (LIDS, syringe_forgotten, "syringe holds back"),
    "no grip": (RESIN, no_grip, "nothing to pull it by"),
}


@pytest.mark.parametrize(("source", "plant", "said"), PLANTED.values(), ids=PLANTED)
def test_a_planted_fault_breaks_its_rule(source, plant, said):
    faults = broken_rules(plant(casting(*source)))
    assert any(said in fault for fault in faults), faults
