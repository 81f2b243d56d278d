"""The steps that hold a cup or a lid down on its base while silicone is in it."""

from __future__ import annotations

from unitcad.casting import figures as fig
from unitcad.casting.bench_step import BenchStep
from unitcad.casting.joining import inner
from unitcad.casting.tape import side_places, tape_places
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.plan import Step
from unitcad.text import listed, number

HOLD = "Hold"
"""How the step begins that keeps an open cup on its base under the blade."""
LEVEL_AGAIN = (
    "What runs under the plate may tilt it: look at the level once more, and put paper under until it is right."
)
"""How the step that holds a cup or a lid ends: nothing is moved between it and the cure."""


def cup_held(moulds: MouldSet, step: Step, picture: str) -> BenchStep:
    """Say how an open cup is held down while it is struck off."""
    strips, where = _strips(moulds)
    sides = "where the filaments come out" if moulds.plan.splits else "without a pry slot"
    return BenchStep(
        f"Hold cup {step.index} down",
        f"{HOLD} cup {step.index} down while it is struck off: on each of the two sides {sides} run "
        f"{strips} from the cup's wall, below the rim, round the plate's edge to its underside, beside the "
        f"filament where there is one{where}.{_pieces(moulds)} Clamps or weights do as well where they leave the rim "
        f"free for the blade. {LEVEL_AGAIN}",
        picture,
        minutes=fig.HOLD_MIN,
    )


def lid_held(step: Step, picture: str) -> BenchStep:
    """Say how a lid is held down while silicone is injected."""
    return BenchStep(
        f"{HOLD} lid {step.index} down",
        f"{HOLD} it down with rubber bands round lid and base, or with a clamp, clear of sprue and vents. "
        f"{LEVEL_AGAIN}",
        picture,
        minutes=fig.HOLD_MIN,
    )


def _strips(moulds: MouldSet) -> tuple[str, str]:
    """Say how many strips of tape hold a cup on each of two sides, and where they stick."""
    first, *others = tape_places(moulds)
    if not others:
        return "a strip of tape", ""
    *inner, _ = (number(at - first, 2) for at in others)
    between = f", {'one' if len(inner) == 1 else 'the others'} {listed(inner)} mm from the left one" if inner else ""
    return f"{len(others) + 1} strips of tape", f": one at either end{between}"


def _pieces(moulds: MouldSet) -> str:
    """Say what holds each piece of split tools."""
    if not moulds.plan.splits:
        return ""
    said = " Each piece of cup and base that reaches these sides has one; one over a seam holds both pieces."
    if sides := side_places(moulds):
        count = "a strip" if len(sides) == 1 else f"{len(sides)} strips"
        said += f" On each of the two other sides {count} for the pieces between, as the picture shows."
    if any(inner(split) for split in moulds.plan.splits):
        said += (
            " A piece without an outer edge has none: nothing lifts it while the silicone cures, and its dovetails "
            "keep it in place sideways."
        )
    return said
