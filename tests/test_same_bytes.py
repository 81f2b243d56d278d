"""The same input gives the same bytes, whatever order Python's sets have in a process."""

import hashlib
import os
import subprocess
import sys

import pytest

from unitcad.rooms import file_kinds
from unitcad.validation import templates
from unitcad.validation.load import shipped_of

BUILT = [sorted(templates()), *(sorted(shipped_of(kind)) for kind in file_kinds() if kind.subject)]
QUICK = ["encapsulating", *(names[0] for names in BUILT[1:])]
ALL = [name for names in BUILT for name in names]
SMALLER = {"forearm-patch": ("layout.columns=2", "layout.rows=1", "sheet.strap_slot_mm=[3,8]")}


def built(name, seed, folder):
    """Build everything of a template in a process; return the hash of each file."""
    command = [sys.executable, "-m", "unitcad", "build", name, "-o", str(folder), "--formats", "step,stl,3mf,svg,glb"]
    command += [word for change in SMALLER.get(name, ()) for word in ("--set", change)]
    environment = {**os.environ, "PYTHONHASHSEED": str(seed), "SOURCE_DATE_EPOCH": "1700000000"}
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    assert done.returncode == 0, done.stderr
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in folder.rglob("*")
        if path.is_file() and path.name != "timings.json"
    }


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[] if name in QUICK else [pytest.mark.long]) for name in ALL]
)
def test_two_processes_write_the_same_bytes(name, tmp_path):
    first, second = (built(name, seed, tmp_path / str(seed)) for seed in (1, 4))
    assert first == second
