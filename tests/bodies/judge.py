"""A judge of parted moulds with code of its own: it moves the pieces, fills the cavity and weighs what is in it."""

import numpy as np
import trimesh
from manifold3d import Manifold, OpType

TOUCH = 1e-3
"""Volume that two pieces may share on the way, mm3: facets that slide along each other."""
STEP, FAR = 0.25, 30.0
"""Steps of a piece on its way, and its whole way, mm."""


def of_tools(moulds, step):
    """Return the tools of a pour as assembled, by name."""
    return {name: moulds.pressed[name] for name in step.tools}


def collisions(moulds):
    """Yield (piece, other, mm, mm3) for every touch on the pieces' ways out, the silicone among the others."""
    (step,) = moulds.plan.steps
    left = of_tools(moulds, step)
    silicone = Manifold.batch_boolean(moulds.meshes(step.layer), OpType.Add)
    for removal in step.removals:
        piece = left.pop(removal.piece)
        way = np.array(removal.direction, float) / np.linalg.norm(removal.direction)
        for far in (*np.arange(STEP, 4, STEP), *np.arange(4, FAR, 2.0)):
            gone = piece.translate((way * far).tolist())
            for name, other in {**left, "silicone": silicone}.items():
                if (shared := (gone ^ other).volume()) > TOUCH:
                    yield removal.piece, name, float(far), shared


def cavity(moulds, step):
    """Return the free spaces of a pour's mould up to its rim that its layer is in. Grease fills the seals."""
    there = [*of_tools(moulds, step).values(), *moulds.meshes((*step.seals, *step.earlier))]
    tools = Manifold.batch_boolean(there, OpType.Add)
    x0, y0, z0, x1, y1, _ = tools.bounding_box()
    block = Manifold.cube((x1 - x0, y1 - y0, step.top - z0)).translate((x0, y0, z0))
    bodies = moulds.meshes(step.layer)
    return [
        space
        for space in (block - tools).decompose()
        if any((space ^ body).volume() > 0.01 * body.volume() for body in bodies)
    ]


def moments(solid):
    """Return volume and principal moments of inertia, which no turn and no move changes."""
    mesh = solid.to_mesh64()
    held = trimesh.Trimesh(np.asarray(mesh.vert_properties[:, :3]), np.asarray(mesh.tri_verts), process=False)
    return np.array([held.volume, *np.sort(held.principal_inertia_components)])
