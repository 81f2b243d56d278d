"""Lines of a job, of any length: they end nothing, and the page keeps their beginning."""

import asyncio
import os
import sys
from types import SimpleNamespace

import pytest
from running import apart

from unitcad.serve.jobs import Jobs, build_folder
from unitcad.serve.request_guard import AccessKeys


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
                await asyncio.wait_for(watching, 60)
                states.append(state)
            return states
        finally:
            await jobs.close()

    for state in apart(run()):
        assert (state.ended, state.code, state.lines) == (True, 0, ["x" * 4000, "y"])
    assert not (tmp_path / "out").exists()
