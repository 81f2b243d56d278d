"""Builds and sweeps that the page asks for: the commands as child processes, one at a time, with progress."""

from __future__ import annotations

import asyncio
import os
import secrets
import shutil
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from unitcad.errors import UnitcadError
from unitcad.serve.keys import Keys
from unitcad.serve.messages import JobState
from unitcad.workers import STAGES, Call, Pool, run_here

MOST_KEPT = 20
"""Jobs that are remembered."""
STAGE = "stage: "
"""What a line of a job begins with that names its stage."""
GRACE_S = 10.0
"""Seconds that a cancelled job may take to write what it has."""
MOST_LINES = 200
"""Lines of a job that are kept."""


class Job:
    """A command under way or ended: `state` is what the page is told."""

    def __init__(self, title: str, stage: str, scratch: Path | None) -> None:
        self.state = JobState(job=secrets.token_hex(8), title=title, stage=stage, lines=[])
        self.scratch = scratch
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

    def __init__(self, out: Path, keys: Keys) -> None:
        self.out, self.keys = out, keys
        self.known: dict[str, Job] = {}
        self.pool: Pool | None = None

    async def start(
        self, title: str, arguments: Sequence[str], files: dict[str, str], folder: Path | None = None, stage: str = ""
    ) -> JobState:
        """Run `unitcad` with arguments in which {NAME} stands for the path of a file of `files`.

        The files stay in `folder`, or go with the job without one.
        `stage` is the first one's name. Raises UnitcadError while another job runs, OSError.
        """
        running = next((job for job in self.known.values() if not job.state.ended), None)
        if running:
            raise UnitcadError(f"{running.state.title} is under way; wait for it or cancel it")
        job = Job(title, stage, None if folder else Path(tempfile.mkdtemp(prefix="unitcad-serve-")))
        self.known[job.state.job] = job
        try:
            there = folder or job.scratch
            assert there
            there.mkdir(parents=True, exist_ok=True)
            for name, text in files.items():
                (there / name).write_text(text, encoding="utf-8")
            given = [word.format(**{Path(name).stem: str(there / name) for name in files}) for word in arguments]
            # PYTHONUNBUFFERED: progress comes as it is made.
            environment = {**os.environ, "PYTHONUNBUFFERED": "1", "COLUMNS": "120", STAGES: STAGE}
            command = [sys.executable, "-P", "-m", "unitcad", *given]
            self.pool = self.pool or Pool()
            job.call = self.pool.submit(run_here, command, b"", environment, lines=True, heard=job.hear)
        except BaseException:
            del self.known[job.state.job]
            raise
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
            if job.scratch:
                shutil.rmtree(job.scratch, ignore_errors=True)
