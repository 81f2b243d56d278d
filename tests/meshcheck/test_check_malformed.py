"""Every malformed file gives its code; every rule has a file that breaks it and one that keeps it."""

import re

import numpy as np
import pytest
from malformed import cases, options
from malformed_files import good_text_meshes
from shapes import box, finding, model_xml, package, stl, text_stl

from docs.released import released
from unitcad.meshcheck import check_bytes
from unitcad.meshcheck.output import FORMATS, render
from unitcad.meshcheck.rules.registry import rules

CASES = cases()
# Rules whose files need more than bytes under a name: test_check_manifest.py and test_check_command.py have them.
ELSEWHERE = {"F012", "M001", "M002", "M003", "M004", "M005"}
ONE_OF_MANY = re.compile(r"(?<!object )(?<![\d.])1 (?:\w+ )?(?:\w+[^s\W]s|vertices)\b")  # "1 pairs", "1 open edges"


@pytest.mark.parametrize("case", CASES, ids=[case.name for case in CASES])
def test_malformed_file_gives_its_code(case, judge):
    report = judge(case.data(), case.name, strict_3mf=True, **case.options)
    assert report.has(case.code), [found.code for found in report.findings]
    severity = finding(report, case.code).severity
    expected = rules()[case.code].severity
    encoding_of_a_part = case.code == "F009" and case.name.endswith(".3mf")
    filled = case.code in ("G001", "G002") and case.name.endswith(".3mf")
    by_index = case.code == "T006" and case.name.endswith(".3mf")
    assert severity == ("error" if encoding_of_a_part or by_index else "warning" if filled else expected)
    for format_ in FORMATS:
        assert render([report], format_)
    for found in report.findings:
        assert not ONE_OF_MANY.search(found.message), found.message


def test_every_released_rule_has_a_failing_file():
    """The inventory lists the rules of the last release; a new one gets its file before the next."""
    known = released() & set(rules())
    assert len(known) > 40
    assert known <= {case.code for case in CASES} | ELSEWHERE <= set(rules())


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("box.stl", stl(box())),
        ("box-text.stl", text_stl(box())),
        ("UPPER.STL", text_stl(box()).upper()),
        ("crlf.stl", text_stl(box()).replace("\n", "\r\n")),
        ("tabs.stl", text_stl(box()).replace("  ", "\t")),
        ("utf8.stl", text_stl(box(), "K\u00e4se")),
        ("two.stl", stl(np.concatenate([box(), box(at=(20, 0, 0))]))),
        ("box.3mf", package()),
        ("stored.3mf", package(compression=0)),
        *good_text_meshes(),
    ],
)
def test_good_file_passes_every_rule(name, content, judge):
    report = judge(content, name, printer="fdm-0.4")
    assert report.findings == ()
    assert report.verdict == "pass"
    assert report.facts.watertight is True


def test_facts_are_those_of_the_box(judge):
    facts = judge(stl(box((10, 20, 30), (1, 2, 3)))).facts
    assert (facts.triangles, facts.vertices, facts.shells) == (12, 8, 1)
    assert facts.volume_mm3 == pytest.approx(6000, rel=1e-12)
    assert facts.area_mm2 == pytest.approx(2200, rel=1e-12)
    assert facts.bbox_mm == ((1, 2, 3), (11, 22, 33))


@pytest.mark.parametrize("cut", range(0, 684, 7))
def test_a_binary_file_cut_anywhere_is_an_error(cut, judge):
    assert judge(stl(box())[:cut]).verdict == "error"


@pytest.mark.parametrize("share", np.linspace(0, 0.985, 40))
def test_a_package_cut_anywhere_is_an_error(share, judge):
    whole = package()
    assert judge(whole[: int(share * len(whole))], "part.3mf").verdict == "error"


@pytest.mark.parametrize(
    "transform", ["1 0 0 0 1 0 0 0 1 10 0 0", "1 0 0 0 1 0 0 0 1 10 10 0", "0 1 0 -1 0 0 0 0 1 30 9 9"]
)
def test_instances_that_touch_or_stand_apart_share_nothing(transform, judge):
    build = f'<build><item objectid="1"/><item objectid="1" transform="{transform}"/></build>'
    assert judge(package(model_xml(build=build)), "two.3mf").findings == ()


def test_many_instances_that_share_are_counted(judge):
    places = "".join(f'<item objectid="1" transform="1 0 0 0 1 0 0 0 1 {9 * i} 0 0"/>' for i in range(40))
    (found,) = judge(package(model_xml(build=f"<build>{places}</build>")), "row.3mf").findings
    assert (found.code, found.severity, found.count) == ("G002", "warning", 39)


@pytest.mark.parametrize("content", [stl(box()[2:], count=12), stl(box())[:-70], stl(box(), count=4_000_000_000)])
def test_no_geometry_is_judged_where_facets_are_missing(content, judge):
    assert [found.code for found in judge(content).findings] == ["F002"]


@pytest.mark.parametrize("case", CASES[::9], ids=[case.name for case in CASES[::9]])
def test_bytes_are_judged_as_the_file_is(case, judge):
    of_file = judge(case.data(), case.name, **case.options)
    of_bytes = check_bytes(case.data(), case.name, options(**case.options))
    assert (of_bytes.findings, of_bytes.facts) == (of_file.findings, of_file.facts)


CUBE = text_stl(box())  # facet k (from 0) begins at line 2 + 7 k


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (CUBE.replace("endloop", "endlop", 1), [("F003", "'endlop' where endloop belongs", 7)]),
        (CUBE.replace("outer loop", "outer", 1), [("F003", "'vertex' where loop belongs", 4)]),
        (CUBE.replace("endfacet", "endfact", 1), [("F003", "'endfact' where endfacet belongs", 8)]),
        (CUBE.replace("endsolid", "endsold"), [("F003", "'endsold' where facet or endsolid belongs", 86)]),
        (CUBE.replace("vertex 0 0 0", "vertex 0 0", 1), [("F003", "'vertex' where a number belongs", 5)]),
        (CUBE.replace("vertex 0 0 0", "vertex 0 0 0 0", 1), [("F003", "'0' where vertex belongs", 4)]),
        (CUBE.replace("vertex 0 0 0", "vertx 0 0 0", 1), [("F003", "'vertx' where vertex belongs", 4)]),
        ("\n".join(line for i, line in enumerate(CUBE.split("\n"), 1) if i != 75),
         [("F008", "a facet with 2 vertices", 72)]),
        (CUBE.replace("endloop", "vertex 1 2 3\nendloop", 1), [("F008", "a facet with 4 vertices", 2)]),
        (CUBE[: CUBE.index("endloop") + 3], [("F003", "the text ends inside a facet", 7)]),
        (CUBE[: CUBE.index("endloop")], [("F003", "the text ends inside a facet", 6)]),
        (CUBE[: CUBE.index("vertex 0 0 0") + 3], [("F003", "the text ends inside a facet", 4)]),
        (CUBE[: CUBE.index("endsolid") + 5], [("F003", "the text ends before endsolid", 86)]),
        (CUBE[: CUBE.rindex("endloop")] + "endsolid box\n", [("F003", "the solid ends inside a facet", 84)]),
        (CUBE.replace("vertex 0 0 0", "vertex 0,0 0 0", 1).replace("endfacet", "", 1),
         [("F003", "'facet' where endfacet belongs", 9)]),
    ],
)  # fmt: skip
@pytest.mark.parametrize("block", [8_000_000, 500])
def test_text_stl_is_blamed_where_it_breaks(text, expected, block, judge, monkeypatch):
    """The first word that breaks the grammar, and nothing of the mesh that came before it."""
    monkeypatch.setattr("unitcad.meshcheck.readers.read_stl._BLOCK", block)
    found = judge(text).findings
    assert [(item.code, item.message, item.locations[0].line) for item in found] == expected
