"""Nothing that a person can name vanishes without its line under "Removed" in CHANGELOG.md."""

import re

from docs.inventory import inventory, page, ranges
from docs.released import PAGE, listed, listed_ranges, released
from tests.whole.page_examples import ROOT


def _lost(was, now, changelog):
    """The lines of the inventory that vanished and that no section "Removed" quotes."""
    removed = "\n".join(re.findall(r"(?ms)^### Removed\n(.*?)(?=^##|\Z)", changelog))
    return [line for line in was if line not in now and f"`{line}`" not in removed]


def test_nothing_vanishes_in_silence():
    now = {line for lines in inventory().values() for line in lines}
    lost = _lost(sorted(released()), now, (ROOT / "CHANGELOG.md").read_text("utf-8"))
    assert lost == [], 'bring them back, or quote each in "Removed" of CHANGELOG.md and run python -m docs.inventory'


def test_a_line_that_vanished_is_found_and_one_that_was_told_is_not():
    was = ["unitcad check --diff", "unitcad check --quiet", "G001"]
    told = "## 0.2.0\n\n### Removed\n\n- `unitcad check --diff`: use a baseline.\n\n### Added\n\n- `G001`\n"
    assert _lost(was, {"unitcad check --quiet"}, told) == ["G001"]
    assert _lost(was, {"unitcad check --quiet"}, "") == ["unitcad check --diff", "G001"]


def test_a_range_that_changes_is_told():
    """A key's limits are those of the page, so that no limit moves without a line in a diff."""
    before, now = listed_ranges(PAGE.read_text("utf-8")), ranges()
    assert len(before) > 150
    moved = {key: (before[key], now[key]) for key in before if key in now and now[key] != before[key]}
    assert moved == {}, 'say it in "Changed" of CHANGELOG.md and run python -m docs.inventory'


def test_the_page_lists_a_name_of_each_kind():
    lines = listed(page())
    assert len(lines) == len(set(lines)) > 1000
    for line in (
        "unitcad check",
        "unitcad check --printer",
        "spec: [[layers]] wall_mm",
        "sweep: base",
        'array: [layout] kind = "grid": columns',
        "target: quiet-edge",
        "materials: ecoflex-00-10",
        "C100",
        "T001",
        "bom.csv",
        "step*-section.svg",
        "unitcad.build(formats=)",
        "unitcad.BuildResult.volumes",
    ):
        assert line in lines, line
