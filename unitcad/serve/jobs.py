"""Builds and sweeps that the page asks for: the commands as child processes, one at a time, with progress."""

from __future__ import annotations

import asyncio
import contextlib
import os
import secrets
import shutil
import signal
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

from unitcad.children import STAGES
from unitcad.errors import UnitcadError
from unitcad.serve.keys import Keys
from unitcad.serve.messages import JobState

MOST_KEPT = 20
"""Jobs that are remembered."""
STAGE = "stage: "
"""What a line of a job begins with that names its stage."""
MOST_LINES = 200
"""Lines of a job that are kept."""


class Job:
    """A command under way or ended: `state` is what the page is told."""

    def __init__(self, title: str, scratch: Path | None) -> None:
        self.state = JobState(job=secrets.token_hex(8), title=title, lines=[])
        self.scratch = scratch
        self.child: asyncio.subprocess.Process | None = None
        self.watching: asyncio.Task[None] | None = None


class Jobs:
    """The jobs of a server; results go below `out`, whose files have addresses of `keys`."""

    def __init__(self, out: Path, keys: Keys) -> None:
        self.out, self.keys = out, keys
        self.known: dict[str, Job] = {}

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
        job = Job(title, None if folder else Path(tempfile.mkdtemp(prefix="unitcad-serve-")))
        job.state.stage = stage
        there = folder or job.scratch
        assert there
        there.mkdir(parents=True, exist_ok=True)
        for name, text in files.items():
            (there / name).write_text(text, encoding="utf-8")
        given = [argument.format(**{Path(name).stem: str(there / name) for name in files}) for argument in arguments]
        # PYTHONUNBUFFERED: progress comes as it is made.
        job.child = await asyncio.create_subprocess_exec(
            sys.executable, "-P", "-m", "unitcad", *given,
            stdin=asyncio.subprocess.DEVNULL, stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.PIPE,
            env={**os.environ, "PYTHONUNBUFFERED": "1", "COLUMNS": "120", STAGES: STAGE}, start_new_session=True,
        )  # fmt: skip
        self.known[job.state.job] = job
        for old in list(self.known)[:-MOST_KEPT]:
            del self.known[old]
        job.watching = asyncio.create_task(self._watch(job))
        return job.state

    def state(self, job: str) -> JobState:
        """Return how far a job is. Raises UnitcadError for an unknown one."""
        if job not in self.known:
            raise UnitcadError("no such job")
        return self.known[job].state

    async def cancel(self, job: str) -> JobState:
        """End a job. Raises UnitcadError for an unknown one."""
        state = self.state(job)
        child = self.known[job].child
        if child and child.returncode is None:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(child.pid, signal.SIGINT)
        watching = self.known[job].watching
        if watching:
            await asyncio.wait([watching], timeout=10)
        return state

    async def close(self) -> None:
        """End every job."""
        for job in self.known.values():
            if job.child and job.child.returncode is None:
                with contextlib.suppress(ProcessLookupError):
                    os.killpg(job.child.pid, signal.SIGKILL)
            if job.watching:
                await job.watching

    async def _watch(self, job: Job) -> None:
        child = job.child
        assert child
        assert child.stdout
        assert child.stderr
        printed: list[str] = []

        async def read(stream: asyncio.StreamReader, into: list[str]) -> None:
            while content := await stream.readline():
                line = content.decode("utf-8", "replace").rstrip()
                if stream is child.stderr and line.startswith(STAGE):
                    job.state.stage = line.removeprefix(STAGE)
                else:
                    into.append(line)
                    del into[:-MOST_LINES]

        await asyncio.gather(read(child.stdout, printed), read(child.stderr, job.state.lines))
        job.state.code = await child.wait()
        folder = Path(printed[-1]) if printed and job.state.code in (0, 1) else None
        if folder and folder.is_dir():
            job.state.folder = str(folder.resolve())
            page = folder / "report.html"
            if page.is_file() and page.resolve().is_relative_to(self.out.resolve()):
                file = page.resolve().relative_to(self.out.resolve()).as_posix()
                job.state.page = self.keys.address(file)
        job.state.ended = True
        if job.scratch:
            shutil.rmtree(job.scratch, ignore_errors=True)
