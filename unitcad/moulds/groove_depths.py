"""Overflow grooves that a set draws less deep than its spec asks for: under a low rim only half of it is left."""

from __future__ import annotations

from unitcad.catalogue import printers
from unitcad.moulds.layout import groove_depth_of
from unitcad.moulds.mould_set import MouldSet
from unitcad.text import listed, number


def shallow_grooves(moulds: MouldSet) -> list[str]:
    """Return a sentence if the spec's depth, larger than the printer's own, is cut down to half a rim; otherwise []."""
    spec = moulds.spec
    asked = spec.moulds.groove_depth_mm
    if asked <= float(printers(spec.printers)[spec.moulds.printer].groove_depth_mm):
        return []
    plan = moulds.plan
    walls = [(plan.walled(step), step.rim) for step in plan.steps if step.groove and plan.walled(step) != step.lid]
    cut_down = {plan.called(name): groove_depth_of(spec, rim) for name, rim in walls if rim / 2 < asked}
    if not cut_down:
        return []
    drawn = listed([f"{number(depth, 3)} mm on {name}" for name, depth in cut_down.items()])
    return [f"moulds.groove_depth_mm = {asked:g} mm is more than half the rim's height: the groove is drawn {drawn}"]
