"""What a casting procedure must never say: each rule reads the procedure's data and names what breaks it."""

from __future__ import annotations

from collections.abc import Iterator

from unitcad.casting.procedure import Procedure


def broken_rules(procedure: Procedure) -> list[str]:
    """Return what a procedure does wrong, one sentence each; empty where it keeps every rule."""
    return [fault for rule in (_agent, _degassing) for fault in rule(procedure)]


def _agent(procedure: Procedure) -> Iterator[str]:
    """Keep release agent off what bonds later, and off every pour but the last."""
    bonds = {bond.face: bond.to for bond in procedure.bonds}
    last = procedure.pours[-1].index
    for pour in procedure.pours:
        for face in pour.agent:
            if face in bonds:
                bond = f"whose cast bonds to {bonds[face]}"
                yield f"pour {pour.index}: release agent on the {face.face} of {face.tool}, {bond}"
            if pour.index != last:
                yield f"pour {pour.index}: release agent before the last pour"
            if face.tool != f"cup{last}" or face.face != "bore":
                yield f"pour {pour.index}: release agent on the {face.face} of {face.tool}, not on the last cup's bore"


def _degassing(procedure: Procedure) -> Iterator[str]:
    """Degas every pour where there is a vacuum; ask for nothing that needs one where there is none."""
    for pour in procedure.pours:
        says = any(step.startswith("Degas for") for step in pour.steps)
        if procedure.vacuum and not (says and pour.degassing_min > 0):
            yield f"pour {pour.index}: not degassed, though there is a vacuum"
        needs = [figure.name for figure in pour.figures if "vacuum" in figure.name or "degassing" in figure.name]
        if not procedure.vacuum and (says or pour.degassing_min or needs):
            yield f"pour {pour.index}: asks for a vacuum that is not there: {', '.join(needs) or 'degassing'}"
    needs = [item.item for item in procedure.bill if "degassing" in item.item or "vacuum" in item.note]
    if needs and not procedure.vacuum:
        yield f"the bill asks for a vacuum that is not there: {', '.join(needs)}"
