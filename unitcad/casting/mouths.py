"""Where sprues and vents open on a lid: what pictures point at."""

from __future__ import annotations

import numpy as np

from unitcad.casting.bench_view import ABOVE, Offset
from unitcad.kernels.mesh import arrays
from unitcad.moulds.mould_set import MouldSet
from unitcad.moulds.plan import Step
from unitcad.shape import Shape


def sprue_and_vent(moulds: MouldSet, step: Step) -> tuple[Offset, Offset]:
    """Return the mouths of a cavity's sprue and of its vent nearest the eye.

    Of the second cavity, where there are several: clear of the syringe.
    """
    count = len(step.channels) // len(step.layer)
    first = count if len(step.channels) > count else 0
    sprue, *vents = (_mouth(moulds, shape) for shape in step.channels[first : first + count])
    return sprue, max(vents, key=lambda at: ABOVE[0] * at[0] + ABOVE[1] * at[1])


def _mouth(moulds: MouldSet, channel: Shape) -> Offset:
    """Return the middle of a channel's upper end."""
    vertices = np.asarray(arrays(moulds.mesh_of(channel))[0], float)
    top = vertices[:, 2].max()
    upper = vertices[vertices[:, 2] > top - 1e-3]
    x, y, _ = ((upper.min(axis=0) + upper.max(axis=0)) / 2).tolist()
    return x, y, float(top)
