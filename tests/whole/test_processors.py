"""The same bytes on every processor: OpenBLAS and NumPy take other code on each, and a process may choose it."""

import hashlib
import os
import subprocess
import sys
from pathlib import Path

import pytest

LAB = Path(__file__).parents[2] / "templates" / "lab"
CODE = """
import json, sys
from pathlib import Path

from typer.testing import CliRunner

from unitcad.cli import app
from unitcad.estimate_inputs import estimate_spec
from unitcad.validation import load

lab = Path(sys.argv[1])
for name in ("encapsulating", "single-embedded"):
    Path(f"{name}.json").write_text(json.dumps(estimate_spec(load(name)), indent=1))
pulls = [str(lab / f"pull-{i}.csv") for i in (1, 2, 3)]
for words in (
    ["measure", str(lab / "campaign.toml")],
    ["material", *pulls, "--name", "blend", "--like", "ecoflex-00-30"],
    ["fit", "synthetic-bench"],
    ["design", "published", "--no-check"],
):
    done = CliRunner().invoke(app, [*words, "-o", words[0]])
    assert done.exit_code == 0, done.output
"""


def written(folder, **environment):
    """Return the code that OpenBLAS took, and the hash of each file that a process with this environment wrote."""
    folder.mkdir()
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", CODE, str(LAB)],
        capture_output=True,
        text=True,
        check=False,
        cwd=folder,
        env={**os.environ, "OPENBLAS_VERBOSE": "2", **environment},
    )
    assert done.returncode == 0, done.stdout + done.stderr
    cores = {line.removeprefix("Core: ") for line in done.stderr.splitlines() if line.startswith("Core: ")}
    return cores, {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in folder.rglob("*")
        if path.is_file()
    }


@pytest.fixture(scope="module")
def usual(tmp_path_factory):
    """What a process writes that takes the code for this very processor."""
    return written(tmp_path_factory.mktemp("usual") / "out")


@pytest.mark.parametrize(
    "core", ["Haswell", *(pytest.param(core, marks=pytest.mark.long) for core in ("Zen", "SkylakeX", "Prescott"))]
)
def test_another_core_of_openblas_writes_the_same_bytes(core, usual, tmp_path):
    cores, files = written(tmp_path / "out", OPENBLAS_CORETYPE=core)
    if cores == usual[0]:
        pytest.skip(f"{core} is this processor's own code, or it lacks it")
    assert files == usual[1]
