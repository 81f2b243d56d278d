"""The files of docs/tutorials/lab-data-to-estimate.md, whose commands tests/whole/test_docs.py runs."""

import re
import tomllib

from tests.in_process import unitcad
from tests.whole.page_examples import ROOT
from unitcad.validation.load import shipped_files

PAGE = ROOT / "docs" / "tutorials" / "lab-data-to-estimate.md"
LAB = shipped_files("lab")["campaign"].parent


def test_the_pasted_table_is_the_one_that_was_made(tmp_path):
    text = PAGE.read_text("utf-8")
    (command,) = re.findall(r"^\$ unitcad (material .*)$", text, re.MULTILINE)
    unitcad(*command.replace("lab/", f"{LAB}/").split(), cwd=tmp_path)
    (pasted,) = re.findall(r"^```toml\n(.*?)^```", text, re.MULTILINE | re.DOTALL)[:1]
    files = (tmp_path / "blend" / "material.toml", LAB / "bench.toml", LAB / "next-unit.toml")
    made, *others = [
        tomllib.loads(one)["materials"]["our-blend"] for one in (*(file.read_text() for file in files), pasted)
    ]
    for entry in others:
        assert entry["like"] == made["like"]
        for key in ("value", "low", "high", "status"):
            assert entry["quasistatic_modulus_kpa"][key] == made["quasistatic_modulus_kpa"][key]


def test_the_example_says_that_it_is_synthetic():
    for file in LAB.iterdir():
        if file.suffix in (".toml", ".csv"):
            assert "ynthetic" in file.read_text(), file.name
