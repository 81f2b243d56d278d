"""A server that is killed leaves nothing running."""

import json
import os
import signal
import subprocess
import sys

import pytest
from process_trees import below, left, until
from running import Server

from unitcad.validation import templates

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")


def test_a_server_that_is_killed_in_mid_sweep_leaves_no_process(tmp_path):
    words = [sys.executable, "-m", "unitcad", "serve", "--no-browser", "encapsulating"]
    process = subprocess.Popen(words, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        server = Server(process.stdout.readline().strip(), process, tmp_path)
        text = templates()["encapsulating"].read_text("utf-8")
        swept = {"text": text, "key": "diameter_mm", "low": 14.0, "high": 20.0, "count": 24}
        status, content, _ = server.send("/sweep", swept)
        assert status == 200, content
        job = json.loads(content)["job"]
        until(lambda: json.loads(server.send(f"/job/{job}")[1])["stage"].partition(" ")[0] not in ("", "0"))
        others = below(process, 4)  # workers of questions, the one of the job, its batch, the batch's own
        assert any("batch" in other.cmdline() for other in others)
        os.kill(process.pid, signal.SIGKILL)
        assert left(others) == []
    finally:
        process.kill()
        process.communicate()
