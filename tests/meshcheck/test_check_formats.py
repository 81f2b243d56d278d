"""Output formats, the rule table and its page, select and ignore."""

import html
import json
import re
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from shapes import box, finding, stl, text_stl

from unitcad.errors import Refusal
from unitcad.meshcheck import FileReport, Options, check_file, check_mesh
from unitcad.meshcheck.findings import SEVERITIES, Finding, Location, merge
from unitcad.meshcheck.output import FORMATS, render
from unitcad.meshcheck.rules.registry import FAMILIES, check_prefixes, explain, rules

HERE = Path(__file__).parent
SCHEMA = jsonschema.Draft202012Validator(json.loads((HERE / "sarif-2.1.0-subset.schema.json").read_text("utf-8")))


def sarif_of(*reports):
    """The run in a valid SARIF file of reports."""
    data = json.loads(render(reports, "sarif"))
    SCHEMA.validate(data)
    return data["runs"][0]


@pytest.fixture
def reports(tmp_path):
    names = {"good.stl": stl(box()), "hole & <b>.stl": stl(box()[2:]), "text.stl": text_stl(box())[:-30].encode()}
    names["warn, 100%.stl"] = stl(box()) + bytes(16)
    found = []
    for name, content in names.items():
        (tmp_path / name).write_bytes(content)
        found.append(check_file(tmp_path / name))
    return [FileReport(Path(report.path).name, report.findings, report.facts) for report in found]


def test_json_has_the_promised_shape(reports):
    data = json.loads(render(reports, "json"))
    assert list(data) == ["files", "config", "baseline"]
    for entry, report in zip(data["files"], reports, strict=True):
        assert list(entry) == ["path", "verdict", "findings", "facts"]
        assert entry["verdict"] == report.verdict
        assert list(entry["facts"]) == [
            "triangles", "vertices", "shells", "volume_mm3", "area_mm2", "bbox_mm", "watertight"
        ]  # fmt: skip
        for found in entry["findings"]:
            assert list(found) == ["code", "severity", "message", "count", "locations", "known", "fix"]
            assert found["fix"] == rules()[found["code"]].fix
    assert [entry["verdict"] for entry in data["files"]] == ["pass", "error", "error", "warning"]


def test_sarif_is_valid_and_complete(reports):
    SCHEMA.check_schema(SCHEMA.schema)
    run = sarif_of(*reports)
    listed = run["tool"]["driver"]["rules"]
    assert [rule["id"] for rule in listed] == list(rules())
    assert len(run["results"]) == sum(len(report.findings) for report in reports)
    for result in run["results"]:
        assert listed[result["ruleIndex"]]["id"] == result["ruleId"]
        place = result["locations"][0]["physicalLocation"]
        assert " " not in place["artifactLocation"]["uri"]
        assert place["region"]["startLine"] >= 1
        assert set(result["partialFingerprints"]) == {"fileAndRule/v1", "primaryLocationLineHash"}
    prints = [result["partialFingerprints"]["fileAndRule/v1"] for result in run["results"]]
    assert len(set(prints)) == len(prints)


def test_a_fingerprint_stays_when_a_part_is_exported_again_or_named_otherwise(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    prints = []
    for triangles, path in ((box()[2:], "a.stl"), (box()[3:], "./a.stl"), (box()[:-2], str(tmp_path / "a.stl"))):
        (tmp_path / "a.stl").write_bytes(stl(triangles))
        (result,) = sarif_of(check_file(path))["results"]
        prints.append(result["partialFingerprints"])
    assert prints[0] == prints[1] == prints[2]


def test_github_annotations_are_escaped(reports):
    *lines, last = render(reports, "github").splitlines()
    assert last == "4 files: 2 failed, 1 warned, 1 passed"
    assert len(lines) == sum(len(report.findings) for report in reports)
    assert lines[0].startswith("::error file=hole & <b>.stl,title=T001 boundary edge::4 boundary edges")
    assert any("::warning file=warn%2C 100%25.stl,title=F006 " in line for line in lines)
    assert any("::error file=text.stl,line=" in line for line in lines)


def test_junit_parses_and_counts(reports):
    suite = ET.fromstring(render(reports, "junit"))[0]
    assert (suite.get("tests"), suite.get("failures")) == ("4", "2")
    strict = ET.fromstring(render(reports, "junit", "warning"))[0]
    assert strict.get("failures") == "3"
    assert [case.get("name") for case in suite] == [report.path for report in reports]
    timed = [replace(report, seconds=k / 8) for k, report in enumerate(reports)]
    suite = ET.fromstring(render(timed, "junit"))[0]
    assert [case.get("time") for case in suite] == ["0.000", "0.125", "0.250", "0.375"]
    assert suite.get("time") == "0.750"


def test_junit_has_one_failure_a_case_with_all_findings():
    found = tuple(Finding(code, severity, f"fault {code}") for code, severity in
                  (("T001", "error"), ("T007", "error"), ("T003", "warning")))  # fmt: skip
    (case,) = ET.fromstring(
        render([FileReport("a.stl", (*found, replace(found[1], code="T002", known=True)))], "junit")
    )[0]
    (failure,) = case.findall("failure")
    assert (failure.get("type"), failure.get("message")) == ("T001,T007", "fault T001; and 1 more finding")
    assert "fault T007" in failure.text
    assert case.findtext("system-out").splitlines() == ["T003 warning: fault T003", "T002 known: fault T007"]


def test_text_is_one_line_a_finding_and_holds_no_control_characters():
    odd = FileReport("a\x1b[31m\n.stl", (Finding("F003", "error", "bad \x07 text", 1, (Location(line=3),)),))
    lines = render([odd], "text").splitlines()
    assert lines == [
        "a\\x1b[31m\\n.stl: F003 error: bad \\x07 text (at line 3)",
        "How to fix:",
        "  F003 truncated text, XML or zip: Copy or export the file again.",
        "`unitcad check --explain CODE` says what a code means and why it matters.",
        "1 file: 1 failed, 0 passed",
    ]
    assert render([FileReport("a.stl")], "text") == "1 file: 1 passed\n"


def test_markdown_is_a_table_that_no_name_leaves(reports):
    lines = render(reports, "markdown").splitlines()
    assert lines[:3] == ["## unitcad check", "", "4 files: 2 failed, 1 warned, 1 passed."]
    rows = [line for line in lines if line.startswith("| ")][2:]
    assert len(rows) == sum(len(report.findings) for report in reports)
    severities = [row.split(" ")[1] for row in rows]
    assert severities == sorted(severities, key=("error", "warning", "info").index)
    assert "hole &amp; &lt;b&gt;.stl" in rows[0]
    evil = "a|b<img src=x>\r\n# [c](javascript:d) @me `e`.stl"
    row = render([FileReport(evil, (Finding("T001", "error", "m" * 9000),))], "markdown").splitlines()[6]
    assert row.count(" | ") == 3
    assert "a\\|b&lt;img src=x&gt;" in row
    assert "\\[c\\](javascript:d) \\@me \\`e\\`.stl" in row
    assert len(row) < 800


def test_markdown_of_many_findings_fits_a_summary():
    many = [FileReport(f"{'x' * 400}{i}.stl", (Finding("T001", "error", "y" * 4000),)) for i in range(2000)]
    said = render(many, "markdown")
    assert len(said.encode()) < 1024 * 1024
    assert "1,500 more findings are in the log." in said


def test_junit_failures_have_a_body(reports):
    failure = ET.fromstring(render(reports, "junit"))[0][1].find("failure")
    lines = failure.text.splitlines()
    assert lines[0] == "T001 boundary edge: 4 boundary edges"
    assert lines[1].startswith("at ")
    assert lines[-1] == f"Fix: {rules()['T001'].fix}"


def test_every_format_says_how_to_fix_what_was_found(reports):
    for code in {found.code for report in reports for found in report.findings}:
        for format_ in FORMATS:
            strict = render(reports, format_, "warning")
            if format_ == "markdown":
                strict = html.unescape(re.sub(r"\\(.)", r"\1", strict))
            assert (
                json.dumps(rules()[code].fix)[1:-1] if format_ in ("json", "sarif") else rules()[code].fix
            ) in strict
    rule = sarif_of(*reports)["tool"]["driver"]["rules"][0]
    assert rule["help"]["text"].endswith(f" Fix: {rules()[rule['id']].fix}")
    assert "**Fix:**" in rule["help"]["markdown"]


def test_text_says_what_a_file_that_passed_holds(reports):
    first = render(reports, "text").splitlines()[0]
    assert first == "good.stl: passed: 10 x 10 x 10 mm, 1000 mm3, 1 shell, 12 triangles"


def test_sarif_names_objects_as_logical_locations():
    found = Finding("G001", "error", "x", 2, (Location(face=1, object="bolt"), Location(face=2, object="nut")))
    (place,) = sarif_of(FileReport("a.obj", (found,)))["results"][0]["locations"]
    assert [item["name"] for item in place["logicalLocations"]] == ["bolt", "nut"]


def test_sarif_says_the_first_place_in_words_and_the_line_as_a_region():
    places = (Location(line=7, part="3D/a.model"), Location(line=9))
    said = FileReport("a.3mf", (Finding("P017", "error", "bad", 2, places),))
    (result,) = sarif_of(said)["results"]
    assert result["message"]["text"] == f"bad (at 3D/a.model line 7). Fix: {rules()['P017'].fix}"
    assert result["locations"][0]["physicalLocation"]["region"] == {"startLine": 9}, "7 is a line of a part's XML"
    annotation, _ = render([said], "github").splitlines()
    assert annotation.startswith("::error file=a.3mf,line=9,title=P017")


def test_a_location_names_every_face_the_object_and_the_line():
    assert Location(face=3) == Location(faces=(3,))
    both = Location(faces=(3, 17), xyz=(1.0, -0.0, 2.5), line=12, object="bolt")
    assert both.as_dict() == {"object": "bolt", "face": 3, "faces": [3, 17], "xyz": [1.0, 0.0, 2.5], "line": 12}
    assert str(both) == "object 'bolt' line 12 faces 3 and 17 (1, 0, 2.5)"
    assert str(Location(face=3, part="object 2", object="object 2")) == "object 2 face 3"


def test_both_faces_of_a_crossing_are_named_in_every_format():
    first = box()
    report = check_mesh(np.concatenate([first, box((4, 4, 4), (8, 3, 3))]).reshape(-1, 3), np.arange(72).reshape(-1, 3))
    crossing = finding(report, "G001")
    for place in crossing.locations:
        one, other = sorted(place.faces)
        assert one < 12 <= other  # one of each box
    named = "faces {} and {} (".format(*crossing.locations[0].faces)
    for format_ in ("text", "github", "junit"):
        assert named in render([report], format_)
    for result in sarif_of(report)["results"]:
        if result["ruleId"] == "G001":
            assert named in result["message"]["text"]
            assert [tuple(place["faces"]) for place in result["properties"]["places"]] == [
                place.faces for place in crossing.locations
            ]


def test_explain_takes_commas_and_prefixes():
    said = explain("t001, G001")
    assert [line[:4] for line in said.splitlines() if line[:4] in rules()] == ["T001", "G001"]
    family = explain("V")
    assert all(f"{code} {rule.title} (" in family for code, rule in rules().items() if code.startswith("V"))
    assert "T001 " not in family
    for wrong in ("", ",", "T001,Q"):
        with pytest.raises(Refusal):
            explain(wrong)


def test_an_unknown_code_names_one_nearest_at_most():
    with pytest.raises(
        Refusal,
        match=r"^--explain = 'T0001': unknown code; unitcad list rules lists all; nearest accepted: 'T00\d'$",
    ):
        explain("T0001")
    with pytest.raises(Refusal, match=r"^--select = 'boundary': unknown code; unitcad list rules lists all$"):
        check_prefixes("--select", ["boundary"])


def test_merge_adds_counts_and_keeps_the_worst():
    one = Finding("P017", "warning", "a", 2, tuple(Location(face=i) for i in range(4)))
    two = Finding("P017", "error", "b", 3, tuple(Location(face=i) for i in range(4, 9)))
    (merged,) = merge([one, two])
    assert (merged.severity, merged.count, len(merged.locations)) == ("error", 5, 5)
    assert merged.message == "a; and b (5 in all)"
    assert merge([one])[0].message == "a"


def test_rules_are_whole():
    for code, rule in rules().items():
        assert rule.severity in SEVERITIES
        assert code[0] in FAMILIES
        assert rule.title
        assert rule.fix
        assert all(text.endswith(".") for text in (rule.cause, rule.example))
        assert all(text in explain(code.lower()) for text in (rule.cause, rule.example, rule.fix))


def test_select_and_ignore_by_longest_prefix(tmp_path):
    path = tmp_path / "a.stl"
    path.write_bytes(stl(box()[2:], normals=np.tile([0.0, 0.0, 1.0], (10, 1))) + bytes(16))

    def codes(**given):
        return [found.code for found in check_file(path, Options(**given)).findings]

    assert codes() == ["T001", "F006", "T013"]
    assert codes(select=("T",)) == ["T001", "T013"]
    assert codes(select=("T001", "F")) == ["T001", "F006"]
    assert codes(ignore=("T",)) == ["F006"]
    assert codes(select=("T001",), ignore=("T",)) == ["T001"]
    assert codes(select=("T",), ignore=("T013",)) == ["T001"]
    with pytest.raises(Refusal):
        check_prefixes("--select", ["X9"])
