"""What the tests of the checks share: judging bytes under a name, and cases with their options."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from malformed import options

from unitcad.meshcheck import FileReport, Finding, check_file

Judge = Callable[..., FileReport]


def finding(report: FileReport, code: str) -> Finding:
    """The finding of a code; a report has one at most."""
    return next(found for found in report.findings if found.code == code)


@pytest.fixture
def judge(tmp_path: Path) -> Judge:
    """judge(bytes or str, name, **options) writes a file and checks it."""

    def run(content: bytes | str, name: str = "part.stl", **given: Any) -> FileReport:
        path = tmp_path / name
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        return check_file(path, options(**given))

    return run
