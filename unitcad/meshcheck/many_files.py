"""Many files: folders and globs expanded, checked one after the other or by several processes, within hard limits."""

from __future__ import annotations

import contextlib
import glob
import os
import signal
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from unitcad.meshcheck.findings import FileReport
from unitcad.meshcheck.one_file import check_file
from unitcad.meshcheck.options import Options
from unitcad.meshcheck.readers.sniff import kind_of
from unitcad.meshcheck.rules.f_file import F011, F012, OutOfTime, Unreadable
from unitcad.workers import Pool, WorkerEnded, limit_memory

_GRACE = 5.0  # s, beyond half of the limit more, until code that never looks at the clock is interrupted


Then = Callable[[FileReport], FileReport]


def expand(
    names: Sequence[str], left_out: Callable[[str], bool] = lambda _: False
) -> tuple[list[str], list[FileReport]]:
    """Return files for names that may be folders or globs, without repeats; a report for each name that gives none.

    Of what folders and globs hold, `left_out` says which files to leave out. A folder's STEP files that cannot be
    read here give a warning each, since they were not named.
    """
    files: list[str] = []
    empty: list[FileReport] = []
    for name in names:
        path = Path(name)
        if path.is_dir():
            inside = _inside(file for file in _walked(path) if not left_out(file))
            if not inside:
                empty.append(FileReport(name, (F012.finding("no mesh file in this folder"),)))
            for file in inside:
                if kind_of(file) == "step" and (needs := _step_needs()):
                    warning = F012.finding(f"{needs}; not checked", severity="warning")
                    empty.append(FileReport(file, (warning,)))
                else:
                    files.append(file)
        elif not path.exists() and glob.has_magic(name):
            inside = _inside(p for p in glob.glob(name, recursive=True) if os.path.isfile(p) and not left_out(p))
            if not inside:
                empty.append(FileReport(name, (F012.finding("no file matches"),)))
            files += inside
        else:
            files.append(name)
    return _once(files), empty


def _step_needs() -> str:
    """Return what STEP files need and is not there, or nothing."""
    from unitcad.meshcheck.readers import read_step

    return "" if read_step.installed() else read_step.NEEDS


def _walked(folder: Path) -> Iterator[str]:
    """Return what is named as a mesh file below a folder, without hidden folders and those behind links.

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

    `then` takes each report where it was made, with its meshes, and gives the one that is passed on.
    """
    if jobs <= 1 or len(work) <= 1:
        with _bounded(memory_mb):
            for path, options in work:
                yield guarded(path, options, then)
        return
    yield from _in_processes(work, min(jobs, len(work)), memory_mb, then)


def guarded(path: str, options: Options, then: Then | None = None) -> FileReport:
    """Call `check_file` with an alarm behind its clock; an inner fault becomes a finding, not a crash."""
    begin = time.perf_counter()
    report = _guarded(path, options)
    report = replace(report, seconds=time.perf_counter() - begin)
    return then(report) if then else report


def _guarded(path: str, options: Options) -> FileReport:
    try:
        with _alarm(options.limits.seconds):
            return check_file(path, options)
    except Unreadable as stop:
        return FileReport(path, stop.findings)
    except MemoryError:
        return _stopped(path, "out of memory (--memory)")
    except Exception as error:
        if os.environ.get("UNITCAD_TRACEBACK"):
            raise
        return _stopped(path, f"the check itself failed ({type(error).__name__}: {error}); please report the file")


def _stopped(path: str, why: str) -> FileReport:
    return FileReport(path, (F011.finding(why),))


def _in_processes(
    work: Sequence[tuple[str, Options]], jobs: int, memory_mb: int | None, then: Then | None
) -> Iterator[FileReport]:
    with Pool(jobs, memory=memory_mb and memory_mb * 1_000_000) as pool:
        calls = [pool.submit(guarded, path, options, then) for path, options in work]
        for (path, _), call in zip(work, calls, strict=True):
            try:
                yield call.result()
            except WorkerEnded as end:
                yield _stopped(path, f"{end} (memory, or a fault in native code)")


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
    import threading

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
