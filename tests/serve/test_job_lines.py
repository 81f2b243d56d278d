"""Lines of a job, of any length: they end nothing, and the page keeps their beginning."""

import asyncio
import os
import sys
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import pytest

from unitcad.serve.access_keys import AccessKeys
from unitcad.serve.jobs import Jobs, build_folder


@pytest.mark.skipif(os.name == "nt", reason="the command is a script of the shell")
def test_a_line_of_70_000_characters_ends_neither_its_job_nor_the_next_one(tmp_path, monkeypatch):
    """The command prints long lines on both streams, the last one without an end."""
    script = tmp_path / "command"
    script.write_text(
        f"#!{sys.executable}\nimport sys\nfor s in sys.stdout, sys.stderr: s.write('x' * 70_000 + '\\ny')\n"
    )
    script.chmod(0o755)
    monkeypatch.setattr("unitcad.serve.jobs.sys", SimpleNamespace(executable=str(script)))

    async def run():
        jobs = Jobs(tmp_path / "out", AccessKeys("token"))
        try:
            states = []
            for _ in range(2):
                state = jobs.start("the build", [], {}, build_folder(tmp_path / "out"))
                watching = jobs.known[state.job].watching
                assert watching
                await asyncio.wait_for(watching, 60)
                states.append(state)
            return states
        finally:
            await jobs.close()

    # In a thread of its own: a browser's test before this one leaves a loop in the main one.
    with ThreadPoolExecutor(1) as apart:
        states = apart.submit(asyncio.run, run()).result()
    for state in states:
        assert (state.ended, state.code, state.lines) == (True, 0, ["x" * 4000, "y"])
    assert not (tmp_path / "out").exists()
