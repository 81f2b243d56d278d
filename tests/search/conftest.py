"""Running the command line as a person does."""

import subprocess
import sys

import pytest


@pytest.fixture
def run():
    """Return a function that runs unitcad with words, in a folder."""

    def called(*words, cwd=None):
        command = [sys.executable, "-m", "unitcad", *words]
        return subprocess.run(command, capture_output=True, text=True, check=False, cwd=cwd, timeout=300)

    return called
