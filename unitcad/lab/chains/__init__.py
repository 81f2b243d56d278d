"""The signal chains by name, as `chain.use` of a campaign gives them."""

from __future__ import annotations

from collections.abc import Callable

from unitcad.errors import Refusal, unknown_name
from unitcad.lab.chains import bandpass, line
from unitcad.lab.chains.chain import Chain, ChainTable

CHAINS: dict[str, Callable[[ChainTable], Chain]] = {"line": line.chain, "bandpass": bandpass.chain}


def chains_of(table: ChainTable) -> tuple[Chain, ...]:
    """Return the chains that a campaign uses, in its order. Raises Refusal for a name that is none, or comes twice."""
    for i, name in enumerate(table.use):
        if name not in CHAINS:
            raise unknown_name(f"chain.use.{i}", name, CHAINS)
    if len(set(table.use)) < len(table.use):
        raise Refusal("chain.use", list(table.use), "has a chain twice", list(dict.fromkeys(table.use)))
    return tuple(CHAINS[name](table) for name in table.use)
