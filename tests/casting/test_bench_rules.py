"""Every rule of the procedure: the shipped sets keep it, and a planted fault breaks it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest

from unitcad.casting.instructions import TACK
from unitcad.casting.procedure import Pour, Procedure, procedure
from unitcad.casting.rules import broken_rules
from unitcad.moulds.mould_set import MouldSet
from unitcad.validation import load, templates

LIDS = ("encapsulating", "moulds.pour=injected", "moulds.cavities=[2,2]")
RESIN = ("three-layer", "moulds.printer=sla")


def casting(*source: str) -> Procedure:
    moulds = MouldSet(load(source[0], list(source[1:])))
    return procedure(moulds, [100.0] * len(moulds.plan.steps), 1000.0)


@pytest.mark.parametrize("source", [*((name,) for name in templates()), LIDS, RESIN], ids=" ".join)
def test_every_set_keeps_every_rule(source: tuple[str, ...]) -> None:
    assert broken_rules(casting(*source)) == []


def of_first_pour(made: Procedure, change: Callable[[Pour], Pour]) -> Procedure:
    return replace(made, pours=(change(made.pours[0]), *made.pours[1:]))


def without_pictures(made: Procedure) -> Procedure:
    return of_first_pour(made, lambda pour: replace(pour, steps=tuple(replace(s, picture="") for s in pour.steps)))


def unlevelled(made: Procedure) -> Procedure:
    return replace(made, preparation=tuple(step for step in made.preparation if "Level" not in step.title))


def opened_first(made: Procedure) -> Procedure:
    def change(pour: Pour) -> Pour:
        cure = [step for step in pour.steps if step.kind == "cure"]
        return replace(pour, steps=(*(step for step in pour.steps if step.kind != "cure"), *cure))

    return of_first_pour(made, change)


def short_cure(made: Procedure) -> Procedure:
    return of_first_pour(
        made,
        lambda pour: replace(
            pour, steps=tuple(replace(s, wait_min=s.wait_min / 2) if s.kind == "cure" else s for s in pour.steps)
        ),
    )


def untested_cure(made: Procedure) -> Procedure:
    return of_first_pour(
        made, lambda pour: replace(pour, steps=tuple(replace(s, text=s.text.replace(TACK, "")) for s in pour.steps))
    )


def smear_left_wet(made: Procedure) -> Procedure:
    return replace(made, assembly=made.assembly[:-1])


def too_little(made: Procedure) -> Procedure:
    return of_first_pour(made, lambda pour: replace(pour, part_a_g=0.05, part_b_g=0.05))


def syringe_forgotten(made: Procedure) -> Procedure:
    return of_first_pour(
        made, lambda pour: replace(pour, figures=tuple(f for f in pour.figures if "syringe" not in f.name))
    )


def no_grip(made: Procedure) -> Procedure:
    return replace(
        made, preparation=tuple(replace(s, text=s.text.replace("what you pull by", "")) for s in made.preparation)
    )


PLANTED = {
    "no picture": (("encapsulating",), without_pictures, "has no picture"),
    "not levelled": (("encapsulating",), unlevelled, "levelled"),
    "opened before the cure": (("encapsulating",), opened_first, "opened before the cure"),
    "cured too short": (("encapsulating",), short_cure, "less than the silicone takes"),
    "tacky is not told": (("embedded",), untested_cure, "tacky"),
    "smear not cured": (("encapsulating",), smear_left_wet, "smear"),
    "too little mixed": (("encapsulating",), too_little, "mixes less"),
    "syringe holds back": (LIDS, syringe_forgotten, "syringe holds back"),
    "no grip": (RESIN, no_grip, "nothing to pull it by"),
}


@pytest.mark.parametrize(("source", "plant", "said"), PLANTED.values(), ids=PLANTED)
def test_a_planted_fault_breaks_its_rule(
    source: tuple[str, ...], plant: Callable[[Procedure], Procedure], said: str
) -> None:
    faults = broken_rules(plant(casting(*source)))
    assert any(said in fault for fault in faults), faults
