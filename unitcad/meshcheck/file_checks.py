"""A file or a mesh in, a report out; many files one after the other or by several processes, within hard limits.

`check_file` never raises for a file's content: every fault is a finding.
"""

from __future__ import annotations

import contextlib
import glob
import os
import signal
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from unitcad import files
from unitcad.errors import UnitcadError
from unitcad.files import no_such_file
from unitcad.geometry.arrays import Floats, Ints
from unitcad.meshcheck import readers
from unitcad.meshcheck.builds import check_3mf, check_on_bed, check_step, check_surface, placed_meshes
from unitcad.meshcheck.findings import MOST_COUNTED, SHOWN, Facts, FileReport, Finding, ending, keeping_places, merge
from unitcad.meshcheck.geometry.mesh import LARGEST, Mesh
from unitcad.meshcheck.readers import kind_of
from unitcad.meshcheck.readers.read_step import measured, missing
from unitcad.meshcheck.rules import g_shells, s_scale
from unitcad.meshcheck.rules.f_file import F001, F005, F011, F012, Deadline, Limits, OutOfTime, Unreadable, keeping
from unitcad.meshcheck.rules.inspection import Options
from unitcad.meshcheck.rules.p_package import P011
from unitcad.meshcheck.rules.s_scale import UNITS_MM
from unitcad.workers import Pool, WorkerEnded, limit_memory


def check_mesh(vertices: Floats, faces: Ints, options: Options | None = None) -> FileReport:
    """Check a mesh in memory.

    Parameters
    ----------
    vertices : array_like of float, shape (n, 3)
        Corners, mm.
    faces : array_like of int, shape (m, 3)
        Indices of the corners of each triangle, counter-clockwise from outside.
    options : Options, optional
        Rules and limits. Default: all rules that need no printer.

    Returns
    -------
    FileReport
        Findings and facts; `path` is empty.

    Examples
    --------
    >>> from unitcad.meshcheck import check_mesh
    >>> corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]

    >>> check_mesh(corners, [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]).verdict
    'pass'
    """
    options = options or Options()
    points = np.ascontiguousarray(vertices, dtype=np.float64).reshape(-1, 3)
    triangles = np.asarray(faces).reshape(-1, 3)

    def work(deadline: Deadline) -> tuple[Sequence[Finding], Facts]:
        if triangles.size and (triangles.min() < 0 or triangles.max() >= len(points)):
            raise P011.unreadable("a face names a vertex that is not there")
        return _check_surface(Mesh(points, np.ascontiguousarray(triangles, dtype=np.int32)), options, deadline)

    return _check_with("", options, work)


def check_file(path: str | Path, options: Options | None = None) -> FileReport:
    """Check one file.

    Parameters
    ----------
    path : str or Path
        Mesh file. A missing, unreadable or hostile file is a finding of the report.
    options : Options, optional
        Rules and limits. Default: all rules that need no printer.

    Returns
    -------
    FileReport
        Findings and facts; lengths in mm.

    Examples
    --------
    >>> from unitcad.meshcheck import check_file
    >>> [finding.code for finding in check_file("missing.stl").findings]
    ['F012']
    """
    options = options or Options()
    return _check_with(str(path), options, partial(_check, None, Path(path), options))


def check_bytes(data: bytes, name: str, options: Options | None = None) -> FileReport:
    """Check the content of a file as `check_file` does; the suffix of `name` gives the format. STEP needs a file.

    Examples
    --------
    >>> from unitcad.meshcheck import check_bytes
    >>> check_bytes(b"", "empty.stl").verdict
    'error'
    """
    options = options or Options()
    return _check_with(name, options, partial(_check, data, Path(name), options))


def _check_with(path: str, options: Options, work: Callable[[Deadline], tuple[Sequence[Finding], Facts]]) -> FileReport:
    meshes: list[Mesh] | None = [] if options.draw else None
    with keeping_places(MOST_COUNTED if options.draw or options.every_place else SHOWN, meshes):
        try:
            with keeping():
                findings, facts = work(Deadline(options.limits.seconds))
        except Unreadable as stop:
            findings, facts = stop.findings, stop.facts
        kept = merge(item for item in findings if item.ends or options.wants(item.code))
    return FileReport(path, kept, facts, meshes=tuple(meshes or ()))


def _check(data: bytes | None, path: Path, options: Options, deadline: Deadline) -> tuple[Sequence[Finding], Facts]:
    """Check a file by its content; without `data` it is read."""
    kind, view = _of_kind(data, path, options)
    del data
    if kind == "3mf":
        return check_3mf(view, options, deadline)
    if kind == "step":
        return check_step(path, view, options, deadline)
    findings: list[Finding] = []
    with keeping(findings, change=ending):
        mesh = readers.reader_of(kind)(view, options.limits, deadline, findings)
    del view
    if mesh is None:
        return ending(findings), Facts()
    factor = UNITS_MM[options.unit] if options.unit else 1.0
    if factor != 1.0:
        mesh = replace(mesh, vertices=mesh.vertices * factor)
    with keeping(findings):
        more, facts = _check_surface(mesh, options, deadline)
    return findings + more, facts


def _of_kind(data: bytes | None, path: Path, options: Options) -> tuple[str, memoryview]:
    """Return the format and the content of a file. Raises `Unreadable` if they contradict."""
    if data is None:
        data = _bytes_of(path, options.limits)
    kind = readers.kind_of(path.name)
    if not kind:
        raise F005.unreadable(readers.unknown(path.suffix))
    if not data:
        raise F001.unreadable("the file is empty")
    content, wanted = readers.foreign(data[:2048]), {"3mf": "zip", "step": "STEP"}.get(kind)
    if content != wanted:
        raise F005.unreadable(f"named {path.suffix}, but the content is {content or f'no {wanted}'}")
    return kind, memoryview(data)


def surface_of(path: Path, options: Options, deadline: Deadline) -> Floats:
    """Return the triangles (n, 3, 3) of a file as it is placed, mm, without those that are not finite.

    Raises `Unreadable`.
    """
    kind, view = _of_kind(None, path, options)
    if kind == "3mf":
        meshes = placed_meshes(view, options, deadline)
    elif kind == "step":
        meshes = list(measured(path, view, options.limits.seconds).meshes)
    else:
        mesh = readers.reader_of(kind)(view, options.limits, deadline, [])
        factor = UNITS_MM[options.unit] if options.unit else 1.0
        meshes = [] if mesh is None else [(mesh.vertices * factor, mesh.faces)]
    corners = np.concatenate([np.empty((0, 3, 3)), *(vertices[faces] for vertices, faces in meshes)])
    return corners[(np.abs(corners) <= LARGEST).all(axis=(1, 2))]


def _bytes_of(path: Path, limits: Limits) -> bytes:
    """Read the content of a regular file, once its size is known. A FIFO is never opened, since that would wait."""
    try:
        size = path.stat().st_size
        if size > limits.max_bytes:
            raise F011.unreadable(f"{size} bytes, more than the limit of {limits.max_bytes}")
        return files.read(path, largest=size)
    except FileNotFoundError as error:
        raise F012.unreadable(no_such_file(path)) from error
    except (OSError, ValueError, UnitcadError) as error:
        why = getattr(error, "strerror", None) or str(error)
        raise F012.unreadable(f"cannot be read: {why.removeprefix(f'{path}: ')}") from error


def _check_surface(mesh: Mesh, options: Options, deadline: Deadline) -> tuple[list[Finding], Facts]:
    """Check the mesh of a file that has no instances."""
    checked = check_surface(mesh, deadline, strict=options.strict)
    findings, facts = [*checked.findings, *s_scale.likely_unit(checked.facts, options.unit)], checked.facts
    if options.printer is not None and checked.inspection is not None:
        with keeping(findings, facts):
            findings += check_on_bed(checked.inspection, options.printer)
    findings += g_shells.expected(facts.shells, options.shells)
    return findings, facts


_GRACE = 5.0  # s, beyond half of the limit more, until code that never looks at the clock is interrupted


Then = Callable[[FileReport], FileReport]


def expand(
    names: Sequence[str], left_out: Callable[[str], bool] = lambda _: False
) -> tuple[list[str], list[FileReport]]:
    """Return files for names that may be folders or globs, without repeats; a report for each name that gives none.

    `left_out`: the files of folders and globs to skip. A folder's STEP files that cannot be
    read here give a warning each, since they were not named.
    """
    found: list[str] = []
    empty: list[FileReport] = []
    for name in names:
        path = Path(name)
        if path.is_dir():
            inside = _inside(file for file in _walk(path) if not left_out(file))
            if not inside:
                empty.append(FileReport(name, (F012.finding("no mesh file in this folder"),)))
            for file in inside:
                if kind_of(file) == "step" and (needs := missing()):
                    warning = F012.finding(f"{needs}; not checked", severity="warning")
                    empty.append(FileReport(file, (warning,)))
                else:
                    found.append(file)
        elif not path.exists() and glob.has_magic(name):
            inside = _inside(p for p in glob.glob(name, recursive=True) if os.path.isfile(p) and not left_out(p))
            if not inside:
                empty.append(FileReport(name, (F012.finding("no file matches"),)))
            found += inside
        else:
            found.append(name)
    return _once(found), empty


def _walk(folder: Path) -> Iterator[str]:
    """Return the files below a folder that are named as mesh files, without hidden folders and those behind links.

    Links to nothing and FIFOs are among them, and are findings.
    """
    for here, below, names in os.walk(folder):
        below[:] = [name for name in below if not name.startswith(".")]
        for name in names:
            if kind_of(name):
                yield str(Path(here, name))


def _inside(paths: Iterable[str]) -> list[str]:
    """Return each real file once, by the name with the fewest folders; sorted."""
    return sorted(_once(sorted(paths, key=lambda path: (path.count(os.sep), path))))


def _once(paths: Iterable[str]) -> list[str]:
    """Return each real file by the first of its names."""
    real: dict[str, str] = {}
    for path in paths:
        real.setdefault(os.path.realpath(path), path)
    return list(real.values())


def check_files(
    work: Sequence[tuple[str, Options]],
    jobs: int = 1,
    memory_mb: int | None = None,
    then: Then | None = None,
) -> Iterator[FileReport]:
    """Return a report for each (path, options), in order. `memory_mb` bounds each process's address space (POSIX only).

    `then` takes each report in the process that made it, with its meshes, and returns the one that is passed on.
    """
    if jobs <= 1 or len(work) <= 1:
        with _bounded(memory_mb):
            for path, options in work:
                yield check_guarded(path, options, then)
        return
    yield from _in_processes(work, min(jobs, len(work)), memory_mb, then)


def check_guarded(path: str, options: Options, then: Then | None = None) -> FileReport:
    """Call `check_file` with an alarm behind its clock; an inner fault becomes a finding, not a crash."""
    start = time.monotonic()
    try:
        with _alarm(options.limits.seconds):
            report = check_file(path, options)
    except Unreadable as stop:
        report = FileReport(path, stop.findings)
    except MemoryError:
        report = _report_stop(path, "out of memory (--memory)")
    except Exception as error:
        if os.environ.get("UNITCAD_TRACEBACK"):
            raise
        report = _report_stop(
            path, f"the check itself failed ({type(error).__name__}: {error}); please report the file"
        )
    report = replace(report, seconds=time.monotonic() - start)
    return then(report) if then else report


def _report_stop(path: str, why: str) -> FileReport:
    return FileReport(path, (F011.finding(why),))


def _in_processes(
    work: Sequence[tuple[str, Options]], jobs: int, memory_mb: int | None, then: Then | None
) -> Iterator[FileReport]:
    with Pool(jobs, memory=memory_mb and memory_mb * 1_000_000) as pool:
        calls = [pool.submit(check_guarded, path, options, then) for path, options in work]
        for (path, _), call in zip(work, calls, strict=True):
            try:
                yield call.result()
            except WorkerEnded as end:
                yield _report_stop(path, f"{end} (memory, or a fault in native code)")


@contextlib.contextmanager
def _bounded(memory_mb: int | None) -> Iterator[None]:
    before = limit_memory(memory_mb and memory_mb * 1_000_000)
    try:
        yield
    finally:
        limit_memory(before)


@contextlib.contextmanager
def _alarm(seconds: float) -> Iterator[None]:
    """Raise `OutOfTime` in Python code that no deadline's tick reaches, when half the time more has passed.

    Does nothing outside the main thread or on Windows.
    """
    if not hasattr(signal, "setitimer") or threading.current_thread() is not threading.main_thread():
        yield
        return

    def ring(signum: int, frame: object) -> None:
        raise OutOfTime(seconds)

    before = signal.signal(signal.SIGALRM, ring)
    signal.setitimer(signal.ITIMER_REAL, seconds * 1.5 + _GRACE)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def worst(reports: Iterable[FileReport], fail_on: str) -> int:
    """Return the exit code: 1 if any report has a finding at or above `fail_on` (error or warning), else 0."""
    failing = {"error"} if fail_on == "error" else {"error", "warning"}
    return int(any(report.verdict in failing for report in reports))
