"""Running the command line as a person does."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

Done = subprocess.CompletedProcess[str]


@pytest.fixture
def run() -> Callable[..., Done]:
    """Return a function that runs unitcad with words, in a folder."""

    def called(*words: str, cwd: Path | None = None) -> Done:
        command = [sys.executable, "-m", "unitcad", *words]
        return subprocess.run(command, capture_output=True, text=True, check=False, cwd=cwd, timeout=300)

    return called
