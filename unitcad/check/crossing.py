"""Self-crossing."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from unitcad.check.findings import Finding
from unitcad.check.limits import Deadline
from unitcad.check.mesh import Ints
from unitcad.check.topology import Topology


@dataclass(frozen=True)
class Crossings:
    findings: tuple[Finding, ...] = ()
    crossed: bool = False
    touching: Ints = field(default_factory=lambda: np.empty((0, 2), int))


def judge(topology: Topology, deadline: Deadline) -> Crossings:
    return Crossings()
