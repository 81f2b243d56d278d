"""What the tests of the checks share: judging bytes under a name, and cases with their options."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from malformed import options

from unitcad.meshcheck import check_file


@pytest.fixture
def judge(tmp_path):
    """judge(bytes or str, name, **options) writes a file and checks it."""

    def run(content, name="part.stl", **given):
        path = tmp_path / name
        path.write_bytes(content.encode() if isinstance(content, str) else content)
        return check_file(path, options(**given))

    return run
