"""Where release agent goes: before the last pour, onto the last cup's bore; whatever bonds later gets none."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.plan import Step


@dataclass(frozen=True)
class Face:
    """A face of a tool that silicone takes its shape from, such as the bore of "cup1"."""

    tool: str
    face: str


@dataclass(frozen=True)
class BondFace:
    """A face of a tool whose cast bonds later: `to` says what to. Silicone does not bond where agent was."""

    face: Face
    to: str


def bond_faces(moulds: MouldSet) -> tuple[BondFace, ...]:
    """Return every face of the tools that forms what bonds later, or that lies beside it in a later pour."""
    return tuple(_bond_faces(moulds))


def _bond_faces(moulds: MouldSet) -> Iterator[BondFace]:
    plan, last = moulds.plan, moulds.plan.steps[-1]
    for step in plan.steps:
        if step is not last:
            yield BondFace(Face(step.cup, "bore"), f"layer {step.index + 1}")
        if step.lid:
            yield BondFace(Face(step.lid, "underside"), "circuit" if step is last else f"layer {step.index + 1}")
    if not plan.concentric and not plan.pins and len(plan.steps) > 1:
        # Its bore may meet a layer that is cured already, where the last one has to bond; a back sheet's, whose cups
        # stand on pins, meets none.
        yield BondFace(Face(last.cup, "bore"), f"layer {last.index - 1}")
    yield BondFace(Face("base", "core"), "motor")
    if len(plan.steps) > 1:
        yield BondFace(Face("base", "seat"), "the next layer")


def agent_faces(moulds: MouldSet, step: Step) -> tuple[Face, ...]:
    """Return the faces that may get release agent before a pour."""
    bore = Face(step.cup, "bore")
    bonds = {bond.face for bond in bond_faces(moulds)}
    return (bore,) if step is moulds.plan.steps[-1] and bore not in bonds else ()
