"""A file or a mesh in, a report out: the functions that the command line, `build` and other programs call.

`check_file` never raises for what a file holds: whatever is wrong with it is a finding.
"""

from __future__ import annotations

import stat
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from unitcad.geometry.arrays import Floats, Ints
from unitcad.meshcheck.findings import Facts, FileReport, Finding, detailed, ending, merge
from unitcad.meshcheck.geometry.mesh import Mesh
from unitcad.meshcheck.options import Options
from unitcad.meshcheck.readers import sniff
from unitcad.meshcheck.rules.f_file import F001, F005, F012, Deadline, Limits, Unreadable, keeping
from unitcad.meshcheck.rules.p_package import P011
from unitcad.meshcheck.rules.s_scale import UNITS_MM

_KINDS = {
    stat.S_IFDIR: "a folder",
    stat.S_IFIFO: "a FIFO",
    stat.S_IFSOCK: "a socket",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
}


def check_mesh(vertices: Floats, faces: Ints, options: Options | None = None) -> FileReport:
    """Check a mesh in memory: vertices (n, 3) mm, faces (m, 3) indices. The report's path is empty."""
    options = options or Options()
    points = np.ascontiguousarray(vertices, dtype=np.float64).reshape(-1, 3)
    triangles = np.asarray(faces).reshape(-1, 3)

    def work(deadline: Deadline) -> tuple[Sequence[Finding], Facts]:
        if triangles.size and (triangles.min() < 0 or triangles.max() >= len(points)):
            raise P011.unreadable("a face names a vertex that is not there")
        return _check_surface(Mesh(points, np.ascontiguousarray(triangles, dtype=np.int32)), options, deadline)

    return _guarded("", options, work)


def check_file(path: str | Path, options: Options | None = None) -> FileReport:
    """Check one file. Missing, unreadable and hostile files are findings of the report."""
    options = options or Options()
    place = Path(path)
    return _guarded(
        str(path), options, lambda deadline: _check(_bytes_of(place, options.limits), place, options, deadline)
    )


def check_bytes(data: bytes, name: str, options: Options | None = None) -> FileReport:
    """Check a file's content without the file; `name` says by its suffix what it is. Not for STEP."""
    options = options or Options()
    return _guarded(name, options, lambda deadline: _check(data, Path(name), options, deadline))


def _guarded(path: str, options: Options, work: Callable[[Deadline], tuple[Sequence[Finding], Facts]]) -> FileReport:
    meshes: list[Mesh] | None = [] if options.draw else None
    with detailed(options.locations, meshes):
        try:
            with keeping():
                findings, facts = work(Deadline(options.limits.seconds))
        except Unreadable as stop:
            findings, facts = stop.findings, stop.facts
        kept = merge(item for item in findings if item.ends or options.wants(item.code))
    return FileReport(path, kept, facts, meshes=tuple(meshes or ()))


def _check(data: bytes, path: Path, options: Options, deadline: Deadline) -> tuple[Sequence[Finding], Facts]:
    kind = sniff.kind_of(path.name)
    if not kind:
        known = ", ".join(sorted(sniff.SUFFIXES))
        raise F005.unreadable(f"suffix {path.suffix!r} is no mesh's; known: {known}")
    if not data:
        raise F001.unreadable("the file is empty")
    content, wanted = sniff.foreign(data[:2048]), {"3mf": "zip", "step": "STEP", "glb": "binary glTF"}.get(kind)
    if content != wanted:
        raise F005.unreadable(f"named {path.suffix}, but the content is {content or f'no {wanted}'}")
    view = memoryview(data)
    if kind == "3mf":
        from unitcad.meshcheck.threemf_build import check_3mf

        return check_3mf(view, options, deadline)
    if kind == "step":
        from unitcad.meshcheck.step_solids import check_step

        return check_step(path, view, options, deadline)
    if kind == "glb" and options.unit is None:
        options = replace(options, unit="meter")  # as the format says
    findings: list[Finding] = []
    with keeping(findings, change=ending):
        mesh = sniff.reader_of(kind, options.unit)(view, options.limits, deadline, findings)
    del view, data
    if mesh is None:
        return ending(findings), Facts()
    factor = UNITS_MM[options.unit] if options.unit and kind != "glb" else 1.0
    if factor != 1.0:
        mesh = replace(mesh, vertices=mesh.vertices * factor)
    with keeping(findings):
        more, facts = _check_surface(mesh, options, deadline)
    return findings + more, facts


def _bytes_of(path: Path, limits: Limits) -> bytes:
    """Read the content of a regular file, once its size is known. A FIFO is never opened, since that would wait."""
    try:
        status = path.stat()
        if not stat.S_ISREG(status.st_mode):
            raise F012.unreadable(f"{_KINDS.get(stat.S_IFMT(status.st_mode), 'a special file')}, not a regular file")
        limits.check_bytes(status.st_size)
        with path.open("rb") as file:
            return file.read(status.st_size)
    except FileNotFoundError as error:
        raise F012.unreadable("no such file") from error
    except (OSError, ValueError) as error:
        raise F012.unreadable(f"cannot be read: {getattr(error, 'strerror', None) or error}") from error


def _check_surface(mesh: Mesh, options: Options, deadline: Deadline) -> tuple[list[Finding], Facts]:
    """Check the mesh of a file that has no instances."""
    from unitcad.meshcheck.one_mesh import check_on_bed, check_surface
    from unitcad.meshcheck.rules import g_shells, s_scale

    checked = check_surface(mesh, deadline, cross=options.cross, strict=options.strict)
    findings, facts = [*checked.findings, *s_scale.likely_unit(checked.facts, options.unit)], checked.facts
    if options.printer is not None and checked.inspection is not None:
        with keeping(findings, facts):
            findings += check_on_bed(checked.inspection, options.printer)
    findings += g_shells.expected(facts.shells, options.shells)
    return findings, facts
