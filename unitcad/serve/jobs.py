"""Builds and sweeps that the page asks for: the commands as child processes, one at a time, with progress."""

from __future__ import annotations

import asyncio
import os
import secrets
import shutil
import sys
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from itertools import count
from pathlib import Path

from unitcad.cli.output import STAGES
from unitcad.errors import UnitcadError
from unitcad.files import scratch
from unitcad.serve.messages import JobState
from unitcad.serve.request_guard import AccessKeys
from unitcad.workers import Call, Pool, run_here

MOST_KEPT = 20
STAGE = "stage: "
"""Prefix of a job's line that names its stage."""
GRACE_S = 10.0
"""Seconds that a cancelled job may take to write its results."""
MOST_LINES = 200
RESULTS = "sweep"
"""Folder of a sweep's results in its folder."""


class Job:
    """A command under way or ended: `state` is for the page."""

    def __init__(self, title: str, stage: str) -> None:
        self.state = JobState(job=secrets.token_hex(8), title=title, stage=stage, lines=[])
        self.ends = ExitStack()
        self.printed = ""
        self.call: Call | None = None
        self.watching: asyncio.Task[None] | None = None

    def hear(self, line: tuple[str, str]) -> None:
        """Take a line that the command prints."""
        stream, text = line
        if stream == "out":
            self.printed = text
        elif text.startswith(STAGE):
            self.state.stage = text.removeprefix(STAGE)
        else:
            self.state.lines = [*self.state.lines[1 - MOST_LINES :], text]


class Jobs:
    """The jobs of a server; results go below `out`, whose files have addresses of `keys`."""

    def __init__(self, out: Path, keys: AccessKeys) -> None:
        self.out, self.keys = out, keys
        self.known: dict[str, Job] = {}
        self.pool: Pool | None = None

    def start(
        self,
        title: str,
        arguments: Sequence[str],
        files: dict[str, str],
        place: AbstractContextManager[Path],
        stage: str = "",
    ) -> JobState:
        """Run `unitcad` with arguments in which {folder} is `place`, and {NAME} the path of a file of `files` in it.

        `place` ends with the job. `stage` is the first one's name. There is no `await` between the look for another job
        and the start. Raises UnitcadError while another job runs, OSError.
        """
        running = next((job for job in self.known.values() if not job.state.ended), None)
        if running:
            raise UnitcadError(f"{running.state.title} is under way; wait for it or cancel it")
        job = Job(title, stage)
        with ExitStack() as ends:
            folder = ends.enter_context(place)
            for name, text in files.items():
                (folder / name).write_text(text, encoding="utf-8")
            paths = {Path(name).stem: folder / name for name in files}
            given = [word.format(folder=folder, **paths) for word in arguments]
            # PYTHONUNBUFFERED: progress comes as it is made.
            environment = {**os.environ, "PYTHONUNBUFFERED": "1", "COLUMNS": "120", STAGES: STAGE}
            command = [sys.executable, "-P", "-m", "unitcad", *given]
            self.pool = self.pool or Pool()
            job.call = self.pool.submit(run_here, command, b"", environment, lines=True, heard=job.hear)
            job.ends = ends.pop_all()
        self.known[job.state.job] = job
        for old in list(self.known)[:-MOST_KEPT]:
            del self.known[old]
        job.watching = asyncio.create_task(self._watch(job, job.call))
        return job.state

    def state(self, job: str) -> JobState:
        """Return how far a job is. Raises UnitcadError for an unknown one."""
        if job not in self.known:
            raise UnitcadError("no such job")
        return self.known[job].state

    async def cancel(self, job: str) -> JobState:
        """End a job. Raises UnitcadError for an unknown one."""
        state = self.state(job)
        if call := self.known[job].call:
            call.stop(GRACE_S)
        if watching := self.known[job].watching:
            await asyncio.wait([watching], timeout=GRACE_S + 5)
        return state

    async def close(self) -> None:
        """End every job."""
        if self.pool:
            await asyncio.to_thread(self.pool.shutdown)
        await asyncio.gather(*(job.watching for job in self.known.values() if job.watching))

    async def _watch(self, job: Job, call: Call) -> None:
        """Wait for a job's end, whatever it is."""
        try:
            job.state.code = (await asyncio.wrap_future(call)).returncode
            folder = Path(job.printed) if job.printed and job.state.code in (0, 1) else None
            if folder and folder.is_dir():
                job.state.folder = str(folder.resolve())
                page = folder / "report.html"
                if page.is_file() and page.resolve().is_relative_to(self.out.resolve()):
                    file = page.resolve().relative_to(self.out.resolve()).as_posix()
                    job.state.page = self.keys.address(file)
        except (Exception, asyncio.CancelledError) as error:
            job.hear(("err", str(error)))
        finally:
            job.state.ended = True
            job.ends.close()


@contextmanager
def build_folder(out: Path) -> Iterator[Path]:
    """Make a folder for a build's files, which goes with the block; of a killed server the next start removes it."""
    with temporary_folder(out), scratch(out) as folder:
        yield folder


@contextmanager
def sweep_folder(out: Path) -> Iterator[Path]:
    """Make the first of sweep-1, sweep-2, ... that is not there; it goes with the block unless `results` are in it."""
    with temporary_folder(out):
        number = count(1)
        while True:
            folder = out / f"sweep-{next(number)}"
            with suppress(FileExistsError):
                folder.mkdir()
                break
        try:
            yield folder
        finally:
            if not (folder / RESULTS).is_dir():
                shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def temporary_folder(out: Path) -> Iterator[None]:
    """Make a folder, and remove it with the block if it was not there and has nothing in it."""
    before = out.is_dir()
    out.mkdir(parents=True, exist_ok=True)
    try:
        yield
    finally:
        if not before:
            with suppress(OSError):  # it is not empty
                out.rmdir()
