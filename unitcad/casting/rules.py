"""What a casting procedure must never say: each rule reads the procedure's data and names what breaks it."""

from __future__ import annotations

from collections.abc import Iterator

from unitcad.casting.instructions import HOLD
from unitcad.casting.procedure import Procedure
from unitcad.text import spaced


def broken_rules(procedure: Procedure) -> list[str]:
    """Return what a procedure does wrong, one sentence each; empty where it keeps every rule."""
    return [fault for rule in (_agent, _degassing, _held, _cleared) for fault in rule(procedure)]


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


def _held(procedure: Procedure) -> Iterator[str]:
    """Hold an open cup down before it is struck off, and pull the tongue before a cup is lifted."""
    for pour in procedure.pours:
        strike, hold = _first(pour.steps, "Strike off"), _first(pour.steps, f"{HOLD} cup {pour.index} down")
        if strike is not None and (hold is None or hold > strike):
            yield f"pour {pour.index}: nothing holds the cup down while it is struck off"
        inserted, pull, lift = (_first(pour.steps, words) for words in ("on the ledge", "tongue out", "Lift cup"))
        if inserted is not None and (pull is None or lift is None or pull > lift):
            yield f"pour {pour.index}: the cup is lifted over a tongue"


def _cleared(procedure: Procedure) -> Iterator[str]:
    """Clear every window that resin may close, before the post-cure."""
    clear, cure = _first(procedure.preparation, "Clear the windows"), _first(procedure.preparation, "post-cure, bake")
    for cup in procedure.tunnels:
        if clear is None or cure is None or clear > cure or spaced(cup) not in procedure.preparation[clear]:
            yield f"the window of {cup} is not cleared of resin before the post-cure"


def _first(steps: tuple[str, ...], words: str) -> int | None:
    """Return the number of the first step (from 0) that says so."""
    return next((i for i, step in enumerate(steps) if words in step), None)
