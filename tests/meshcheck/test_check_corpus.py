"""Meshes that someone else made: the 3MF consortium's samples and numpy-stl's files.

The samples that must fail are judged strictly: what real programs write all the same is a warning otherwise.
"""

from pathlib import Path

import pytest

from unitcad.meshcheck import Options, check_file

CORPUS = Path(__file__).parent.parent / "corpus"
SAMPLES = CORPUS / "3mf-samples"


@pytest.mark.parametrize("path", sorted((SAMPLES / "MUSTFAIL").glob("*.3mf")), ids=lambda path: path.stem[9:])
def test_must_fail(path):
    assert check_file(path, Options(strict_3mf=True)).verdict == "error"


@pytest.mark.parametrize("strict", [False, True])
@pytest.mark.parametrize("path", sorted((SAMPLES / "MUSTPASS").glob("*.3mf")), ids=lambda path: path.stem[9:])
def test_must_pass(path, strict):
    assert check_file(path, Options(strict_3mf=strict)).verdict != "error"
