"""The run on several nodes (benchmarks/bench_nodes.py), small: workers, scheduler and parent are killed on the way."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

BENCH = Path(__file__).parents[2] / "benchmarks" / "bench_nodes.py"


@pytest.mark.long
@pytest.mark.skipif(sys.platform != "linux" or os.geteuid() != 0 or not shutil.which("ip"), reason="needs namespaces")
def test_a_batch_on_four_nodes_outlives_worker_scheduler_and_parent(tmp_path: Path) -> None:
    for library in ("distributed", "s3fs", "moto"):
        pytest.importorskip(library)
    words = [sys.executable, str(BENCH), "--variants", "400", "--geometries", "4", "--only", "unit", "--no-check"]
    done = subprocess.run(
        [*words, "--json", str(tmp_path / "figures.json")], capture_output=True, text=True, check=False, timeout=1800
    )
    assert done.returncode == 0, done.stdout + done.stderr
    figures = json.loads((tmp_path / "figures.json").read_text())
    assert [killed["what"] for killed in figures["killed"]] == ["worker", "scheduler", "parent"]
    assert figures["variants"] == 400
