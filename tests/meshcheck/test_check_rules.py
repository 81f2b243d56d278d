"""A rule is one file: its text and its code, which nothing else lists."""

import json
from pathlib import Path

import numpy as np
import pytest
from shapes import box, stl

from unitcad.meshcheck import check_bytes, rules
from unitcad.meshcheck.output import render
from unitcad.meshcheck.rules import registry

LONG = """
from unitcad.meshcheck.findings import counted
from unitcad.meshcheck.rules.registry import Rule

G999 = Rule('''
    G999 warning: long shell
    Two times as long as wide.
    Example: A rod.
    Fix: Cut it in two.
''')


def check_mesh(part):
    sides = part.topology.high - part.topology.low
    long = int((sides.max(axis=1) > 2 * sides.min(axis=1)).sum())
    if long:
        yield G999.finding(counted(long, "long shell"), long)
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A second folder of rules."""
    monkeypatch.setattr(rules, "__path__", [*rules.__path__, str(tmp_path)])
    yield tmp_path
    registry.modules.cache_clear()
    registry.rules.cache_clear()


def test_a_file_in_the_folder_is_a_rule_everywhere(folder):
    (folder / "g_long.py").write_text(LONG)
    registry.modules.cache_clear()
    registry.rules.cache_clear()
    report = check_bytes(stl(np.concatenate([box((10, 20, 30)), box((9, 9, 9), (50, 0, 0))])), "a.stl")
    assert [(found.code, found.message) for found in report.findings] == [("G999", "1 long shell")]
    assert report.verdict == "warning"
    assert "Cut it in two." in render([report], "text")
    assert "G999" in [
        rule["id"] for rule in json.loads(render([report], "sarif"))["runs"][0]["tool"]["driver"]["rules"]
    ]
    assert "A rod." in registry.explain("g999")


def test_two_rules_of_one_code_are_refused(folder):
    (folder / "t_again.py").write_text(LONG.replace("G999", "T001"))
    registry.modules.cache_clear()
    registry.rules.cache_clear()
    with pytest.raises(ValueError, match="T001"):
        registry.rules()


def test_every_rule_stands_in_a_file_of_its_family_or_of_the_code_that_finds_it():
    homes = {code: Path(module.__file__ or "").name for module in registry.modules() for code in vars(module)}
    assert {code: homes[code] for code in registry.rules() if homes[code][0].upper() != code[0]} == {
        "T008": "g_shells.py"  # which shells face inwards follows from which lies in which
    }
