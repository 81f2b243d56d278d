"""Small files that were judged wrongly, each with its right verdict."""

from pathlib import Path

import pytest
from malformed import options

from unitcad.meshcheck import check_file

CASES = Path(__file__).parent / "cases"
STRICT, FDM = {"strict_3mf": True}, {"printer": "fdm-0.4"}
RIGHT = [
    ("ind_nan.obj", {}, {"V001": "error"}),
    ("inf_x.obj", {}, {"V001": "error"}),
    ("utf16.obj", {}, {"F009": "warning"}),
    ("unref.obj", {}, {"T012": "info"}),
    ("unref_far.3mf", {}, {"T012": "info"}),
    ("degenerate_pair_loose.stl", {}, {"T010": "info"}),
    ("fold_1e-5.stl", {}, {"G008": "info", "G009": "info"}),
    ("fold_1e-5.stl", {"strict": True}, {"G008": "error", "G009": "error"}),
    ("fold_1.stl", {}, {"G008": "error", "G009": "error"}),
    ("cross_1e-15.stl", {}, {}),
    ("cross_1e-15.stl", {"strict": True}, {"G001": "error"}),
    ("cross_0.5.stl", {}, {"G001": "error"}),
    ("bambu_modifier.3mf", {}, {"P012": "warning", "P017": "info"}),
    ("bambu_modifier.3mf", STRICT, {"P012": "error", "P017": "error"}),
    ("touch_edge_welded.3mf", {}, {"T003": "warning", "G003": "warning"}),
    ("touch_edge_welded.3mf", STRICT, {"T003": "error", "G003": "warning"}),
    ("surface-type.3mf", {}, {"P014": "warning"}),
    ("off_inf_count.off", {}, {"F003": "error"}),
    ("off_nan_count.off", {}, {"F003": "error"}),
    ("3mf_noname.3mf", {}, {"P005": "error"}),
    ("3mf_multi_no_pindices.3mf", {}, {"P017": "error"}),
    ("3mf_multi_word.3mf", {}, {"P017": "error"}),
    ("3mf_obj_pid.3mf", {}, {"P017": "error"}),
    ("3mf_obj_pindex.3mf", {}, {"P017": "error", "P019": "error"}),
    ("3mf_tri_p1.3mf", {}, {"P017": "error"}),
    ("3mf_tri_p1_huge.3mf", {}, {"P017": "error"}),
    ("3mf_tri_empty.3mf", {}, {"P017": "error", "T001": "error"}),
    ("3mf_tri_huge.3mf", {}, {"P017": "error", "T001": "error"}),
    ("3mf_tri_word.3mf", {}, {"P017": "error", "T001": "error"}),
]


@pytest.mark.parametrize(("name", "given", "right"), RIGHT, ids=lambda value: str(value))
def test_the_verdict_is_right(name, given, right):
    report = check_file(CASES / name, options(**given))
    assert {found.code: found.severity for found in report.findings} == right


@pytest.mark.parametrize(
    ("name", "box"),
    [("bambu_modifier.3mf", ((100, 100, 0), (120, 120, 20))), ("unref_far.3mf", ((0, 0, 0), (10, 10, 10)))],
)
def test_only_what_is_built_has_a_size(name, box):
    assert check_file(CASES / name).facts.bbox_mm == box


def test_a_bar_of_five_metres_fits_no_printer():
    pytest.importorskip("OCP")
    report = check_file(CASES / "long_5m.step", options(**FDM))
    found = {finding.code: finding.severity for finding in report.findings}
    assert found == {"S001": "warning", "S002": "error", "D005": "warning"}
