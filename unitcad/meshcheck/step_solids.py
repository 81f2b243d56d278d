"""The rules on a STEP file: its B-rep by OCCT's own checks; size, overlap and print by a mesh of its solids."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from unitcad.meshcheck.findings import Facts, Finding, counted, number
from unitcad.meshcheck.geometry.mesh import Mesh, weld_exact
from unitcad.meshcheck.geometry.topology import topology_of
from unitcad.meshcheck.one_mesh import check_on_bed
from unitcad.meshcheck.options import Options
from unitcad.meshcheck.overlaps import Solid, overlapping
from unitcad.meshcheck.readers.read_step import Measured, measured
from unitcad.meshcheck.rules.f_file import F012, Deadline, keeping
from unitcad.meshcheck.rules.g_crossing import G001
from unitcad.meshcheck.rules.g_shells import G007, T008, expected
from unitcad.meshcheck.rules.inspection import Inspection
from unitcad.meshcheck.rules.s_scale import likely_unit


def check_step(path: Path, data: memoryview, options: Options, deadline: Deadline) -> tuple[list[Finding], Facts]:
    """Return findings about a STEP file's text and, with OCP there, about its solids."""
    step = measured(path, data, options.limits.seconds)
    findings: list[Finding] = []
    if not step.valid:
        findings.append(G001.finding("the B-rep is not valid by BRepCheck"))
    facts = Facts(
        shells=step.solids,
        volume_mm3=step.volume,
        area_mm2=step.area,
        bbox_mm=step.box,
        watertight=step.solids > 0,
    )
    if not step.solids:
        findings.append(G007.finding("no solid in the file"))
    elif step.volume < 0:
        findings.append(T008.finding(f"volume {number(step.volume)} mm3"))
    findings += expected(step.solids, options.shells, "solid")
    findings += likely_unit(facts, None)
    with keeping(findings, facts):
        options.limits.check_faces(sum(len(faces) for _, faces in step.meshes))
        findings += _by_mesh(step, options, deadline)
    return findings, facts


def _by_mesh(step: Measured, options: Options, deadline: Deadline) -> Iterator[Finding]:
    """Apply G002 to the solids and the rules for a printer to them together, or say which of that was not done."""
    solids, opened = list[Solid](), 0
    for place, (vertices, faces) in enumerate(step.meshes, 1):
        topology = topology_of(_mesh([(vertices, faces)]), deadline.tick)
        if topology.watertight and topology.oriented:
            solids.append(Solid(topology.mesh, abs(float(topology.volumes.sum())), f"solid {place}"))
        else:
            opened += 1
    if opened:
        text = f"{counted(opened, 'solid')} without a closed mesh; overlap (G002) and printability (D) are not judged"
        yield F012.finding(f"OCCT makes {text}", opened, severity="warning")
    if options.cross:
        yield from overlapping(solids, "solids", deadline, thick=2 * step.tolerance)
    if options.printer is not None and step.meshes:
        whole = _mesh(step.meshes)
        part = Inspection(whole, topology_of(whole, deadline.tick), deadline.tick)
        for item in check_on_bed(part, options.printer):
            places = (replace(place, face=None, faces=()) for place in item.locations)  # STEP has no such faces
            yield replace(item, locations=tuple(places))


def _mesh(meshes: Sequence[tuple[np.ndarray, np.ndarray]]) -> Mesh:
    """Return solids as one mesh, its vertices as an STL would have them: those of neighbouring B-rep faces are one."""
    corners = np.concatenate([vertices[faces] for vertices, faces in meshes]).astype(np.float32)
    return Mesh(*weld_exact(corners.reshape(-1, 3, 3)), indexed=False)
