"""A batch whose workers cannot start ends with one line, and does not hang."""

import resource
import subprocess
import sys
from pathlib import Path

import pytest
from batching import command, environment, ring_sweep, summary_of, unitcad

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="limits of Linux")


def _limited(which, limit):
    resource.setrlimit(which, (limit, limit))


@pytest.mark.parametrize(
    ("which", "limit"),
    [
        (resource.RLIMIT_NOFILE, 8),
        pytest.param(resource.RLIMIT_NOFILE, 10, marks=pytest.mark.long),
        (resource.RLIMIT_NOFILE, 24),
        (resource.RLIMIT_AS, 300 << 20),
        pytest.param(resource.RLIMIT_AS, 600 << 20, marks=pytest.mark.long),
    ],
    ids=["8 descriptors", "10 descriptors", "24 descriptors", "300 MB", "600 MB"],
)
def test_a_batch_with_too_little_to_start_workers_ends_in_one_line(which, limit, tmp_path):
    sweep, out = ring_sweep(tmp_path / "s"), tmp_path / "rings"
    words = command("batch", sweep, "-o", out.parent, "-j", 2, "--cache", tmp_path / "cache")
    done = subprocess.run(
        words, capture_output=True, text=True, timeout=120, env=environment(),
        preexec_fn=lambda: _limited(which, limit),
    )  # fmt: skip
    assert "a bug" not in done.stderr
    assert "Traceback" not in done.stderr
    errors = sum(line.startswith("error: ") for line in done.stderr.splitlines())
    # CPython itself aborts if it finds no memory for the MemoryError.
    if done.returncode and errors != 1 and "Cannot recover from MemoryErrors" not in done.stderr:
        assert " failed" in done.stdout, (done.returncode, done.stdout, done.stderr)  # one worker started, one did not
    assert summary_of(sweep, "-o", out.parent, "-j", 0, "--cache", tmp_path / "cache")["ok"] == 4


def test_a_batch_whose_workers_cannot_start_says_so_once(tmp_path):
    sweep = ring_sweep(tmp_path / "s")
    words = command("batch", sweep, "-o", tmp_path / "out", "-j", 2, "--cache", tmp_path / "cache")
    code = "import sys\nsys.executable = '/no/python'\nfrom unitcad.cli import main\nmain()"
    done = subprocess.run([sys.executable, "-c", code, *words[3:]], capture_output=True, text=True, timeout=60)
    assert done.returncode == 1
    (line,) = done.stderr.splitlines()
    assert line == "error: a worker process cannot start: [Errno 2] No such file or directory: '/no/python'"


@pytest.mark.parametrize("words", [("build", "embedded"), ("batch", "s/sweep-unit.toml")], ids=lambda words: words[0])
@pytest.mark.parametrize("below", ["", "results"])
def test_results_under_a_link_to_nothing_are_refused(words, below, tmp_path):
    ring_sweep(tmp_path / "s")
    (tmp_path / "disk").symlink_to(tmp_path / "unmounted")
    done = unitcad(*words, "-o", Path("disk") / below, "--only", "unit", cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr == "error: disk: is a link to a folder that is missing; choose another with -o\n"


def test_python_without_docstrings_works(tmp_path):
    words = [sys.executable, "-OO", "-m", "unitcad", "estimate", "encapsulating"]
    done = subprocess.run(words, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
