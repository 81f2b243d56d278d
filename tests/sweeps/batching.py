"""What the batch tests share: small sweeps, and a design whose function crashes, hangs or fails on request."""

import hashlib
import json
import os
import subprocess
import sys
from pathlib import Path

from tests import in_process
from unitcad.sweeps import BatchOptions, load_sweep, run
from unitcad.sweeps.executors import SerialExecutor

SPEC = """
name = "ring"
design = "ring.py:{function}"
diameter_mm = 14.0
[[layers]]
material = "ecoflex-00-10"
wall_mm = 1.25
[parameters]
height_mm = 2.0
[output]
formats = ["stl"]
tolerance_mm = 0.1
"""

DESIGN = """
import os, time, ctypes
from unitcad.shape import ring

HERE = {here!r}

def unit(spec):
    height = float(spec.parameters["height_mm"])
    with open(os.path.join(HERE, "calls"), "a") as file:
        file.write(f"{{height}} {{os.getpid()}}\\n")
    return ring(4.5, 7.0, 0, height)

def crashes(spec):
    if spec.parameters["height_mm"] == 3.0:
        os.abort()
    return unit(spec)

def hangs(spec):
    if spec.parameters["height_mm"] == 3.0:
        ctypes.pythonapi.sleep(600)  # with the GIL held, as a kernel would
    return unit(spec)

def fails_once(spec):
    mark = os.path.join(HERE, "failed")
    if spec.parameters["height_mm"] == 3.0 and not os.path.exists(mark):
        open(mark, "w").close()
        raise ValueError("not the first time")
    return unit(spec)

def fails(spec):
    if spec.parameters["height_mm"] == 3.0:
        raise ValueError("never")
    return unit(spec)

def slow(spec):
    time.sleep(0.4)
    return unit(spec)
"""


def ring_sweep(folder, function="unit", heights=None, materials=1, more=""):
    """A sweep file over rings of several heights and materials, each height a geometry; none takes the kernel long."""
    silicones = ["ecoflex-00-10", "ecoflex-00-30", "ecoflex-00-50", "dragon-skin-10-medium", "dragon-skin-30"]
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "ring.py").write_text(DESIGN.format(here=str(folder)))
    (folder / "ring.toml").write_text(SPEC.format(function=function))
    file = folder / f"sweep-{function}.toml"
    file.write_text(
        f'base = "./ring.toml"\nname = "rings"\n{more}\n[sweep]\n'
        f'"parameters.height_mm" = {heights or [2.0, 3.0, 4.0, 5.0]}\n'
        f'"layers.0.material" = {silicones[:materials]}\n'
    )
    return file


def made(sweep, out, executor=None, **options):
    """Make the units of a sweep in this process; return the summary."""
    return run(load_sweep(sweep), out, BatchOptions(("unit",), **options), executor or SerialExecutor(), workers=1)


def calls(folder):
    """The heights that the design was drawn for, a line each time."""
    file = folder / "calls"
    return [line.split()[0] for line in file.read_text().splitlines()] if file.exists() else []


def unitcad(*words, cwd=None, env=None):
    """Run the command line in this process; in one of its own with an environment, or with a scheduler's client."""
    line = command(*words)
    if not env and "--scheduler" not in words:
        return in_process.unitcad(*line[3:], cwd=cwd)
    return subprocess.run(line, capture_output=True, text=True, timeout=300, env=env or environment(), cwd=cwd)


def summary_of(*words, env=None):
    """Run a batch as a command, which succeeds; return its summary."""
    done = unitcad("batch", *words, "--json", env=env)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def started(*words, **more):
    """Start a command in a process of its own."""
    pipe = subprocess.PIPE
    return subprocess.Popen(command(*words), stdout=pipe, stderr=pipe, text=True, env=environment(), **more)


def command(*words):
    """Return a command line; a batch of rings makes their units alone, which takes the kernel no time."""
    rings = (
        words[0] == "batch"
        and "--only" not in words
        and any(Path(str(word)).name.startswith("sweep-") for word in words)
    )
    return [sys.executable, "-m", "unitcad", *map(str, words), *(["--only", "unit"] if rings else [])]


def environment():
    return {**os.environ, "PYTHONUNBUFFERED": "1", "UNITCAD_TRACEBACK": ""}


def bytes_of(out):
    """Everything in a batch's folder that is promised to be the same from run to run."""
    apart = ("timings.json", "journal.jsonl", "batch.lock")
    return {
        str(file.relative_to(out)): hashlib.sha256(file.read_bytes()).hexdigest()
        for file in sorted(out.rglob("*"))
        if file.is_file() and file.name not in apart
    }


def rows(out):
    return json.loads((out / "batch.json").read_text())["variants"]


def leftovers(out):
    """Return scratch folders. An empty one does not count: a kill just before its lock or just before its rmdir leaves
    it, and nobody can tell it from one that a living process has just made.
    """
    return [path for path in out.iterdir() if path.name.startswith(".tmp-") and any(path.iterdir())]
