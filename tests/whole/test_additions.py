"""A stranger adds a mould check, a design, a mesh rule and a material as the architecture page says, and changes no
other file: lint, types, every guard and the rooms' tests accept them. `.ci/run` runs it; it takes some minutes.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PLACES = {
    "build_height.py": "unitcad/checks",
    "bridged.py": "unitcad/designs",
    "bridged.toml": "templates",
    "d_slender.py": "unitcad/meshcheck/rules",
}
GUARDS = ("tests/moulds", "tests/meshcheck", "tests/whole/test_reference.py", "tests/whole/test_inventory.py")
GUARDS += ("tests/whole/test_docs.py", *(f"tests/{file.name}" for file in sorted((ROOT / "tests").glob("test_*.py"))))

pytestmark = pytest.mark.long


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """A clone of the checkout with the additions in their places, formatted as the commit hook does it."""
    folder = tmp_path_factory.mktemp("clone") / "unitcad"
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for name in filter(None, listed.split("\0")):
        if (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)
    for name, place in PLACES.items():
        shutil.copy(ROOT / "tests/additions" / name, folder / place)
    with open(folder / "unitcad/catalogue/materials.toml", "a", encoding="utf-8") as catalogue:
        catalogue.write((ROOT / "tests/additions/material.toml").read_text("utf-8"))
    subprocess.run(["git", "init", "-q"], cwd=folder, check=True)
    subprocess.run(["git", "add", "."], cwd=folder, check=True)
    subprocess.run([sys.executable, "-m", "ruff", "format", "-q", "."], cwd=folder, check=True)
    return folder


def _run(copy, *words):
    environment = {**os.environ, "PYTHONPATH": str(copy), "BIN": str(Path(sys.executable).parent)}
    done = subprocess.run(words, cwd=copy, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout[-6000:] + done.stderr[-3000:]
    return done.stdout + done.stderr


def test_the_additions_are_there(copy):
    said = _run(
        copy,
        sys.executable,
        "-m",
        "unitcad",
        "build",
        "bridged",
        "-o",
        "made",
        "--set",
        "layers.1.material=house-blend",
    )
    assert "house-blend" in said
    assert "C260" in _run(copy, sys.executable, "-c", "import unitcad.checks as c; print(*c.mould_checks())")
    assert "slender" in _run(copy, sys.executable, "-m", "unitcad", "check", "--explain", "D090")


def test_lint_and_types_accept_them(copy):
    _run(copy, "scripts/check")


def test_the_tests_and_guards_accept_them(copy):
    _run(copy, "scripts/test", "-q", "-p", "no:cacheprovider", *GUARDS)
