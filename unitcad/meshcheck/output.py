"""Reports as text for a person, JSON, annotations of GitHub Actions, Markdown, JUnit XML or SARIF, in UTF-8.

SARIF 2.1.0 is as OASIS defines it and GitHub code scanning reads it.
"""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any
from urllib.parse import quote

from unitcad import __version__
from unitcad.meshcheck.findings import SEVERITIES, Facts, FileReport, Finding, counted, first_line, number, with_places
from unitcad.meshcheck.rules.registry import Rule, rules
from unitcad.text import markdown, printable, xml_attribute, xml_text


def write_text(reports: Sequence[FileReport], fail_on: str) -> str:
    """Return a line a finding, one with the size of each file that passed, how to fix the findings, then a count."""
    lines = []
    codes: set[str] = set()
    for report in reports:
        for finding in report.findings:
            codes.add(finding.code)
            lines.append(finding_line(report, finding))
        if report.verdict == "pass" and (size := _size(report.facts)):
            lines.append(f"{printable(report.path)}: passed: {size}")
    if codes:  # else the rules that no file needed are not loaded
        fixes = [f"  {code} {rule.title}: {rule.fix}" for code, rule in rules().items() if code in codes]
        lines += ["How to fix:", *fixes, _EXPLAIN]
    return "\n".join([*lines, summary(reports, fail_on)]) + "\n"


def finding_line(report: FileReport, finding: Finding) -> str:
    """Return a finding in one line: file, code, severity, message and its first places."""
    return f"{printable(report.path)}: {finding.code} {finding.severity}: {printable(with_places(finding, 3))}"


_EXPLAIN = "`unitcad check --explain CODE` says what a code means and why it matters."


def _size(facts: Facts) -> str:
    """Return sides of the box, volume, shells and triangles, as far as they are known."""
    parts = []
    if facts.bbox_mm is not None:
        sides = [high - low for low, high in zip(*facts.bbox_mm, strict=True)]
        parts.append(" x ".join(number(side) for side in sides) + " mm")
    if facts.volume_mm3 is not None:
        parts.append(f"{number(facts.volume_mm3)} mm3")
    if facts.shells is not None:
        parts.append(counted(facts.shells, "shell"))
    if facts.triangles is not None:
        parts.append(counted(facts.triangles, "triangle"))
    return ", ".join(parts)


def summary(reports: Sequence[FileReport], fail_on: str) -> str:
    """Return how many files failed, gave warnings and passed; with `fail_on` warning those with one failed too."""
    verdicts = Counter(report.verdict for report in reports)
    warned = "failed by a warning (--fail-on warning)" if fail_on == "warning" else "warned"
    parts = [f"{verdicts[name]} {word}" for name, word in (("error", "failed"), ("warning", warned)) if verdicts[name]]
    parts.append(f"{verdicts['pass']} passed")
    return f"{counted(len(reports), 'file')}: {', '.join(parts)}"


_GITHUB = {"error": "error", "warning": "warning", "info": "notice"}


def write_github(reports: Sequence[FileReport], fail_on: str) -> str:
    """Write workflow commands: an annotation a finding, then a line for the log that counts."""
    lines = []
    for report in reports:
        for finding in report.findings:
            title = f"{finding.code} {rules()[finding.code].title}"
            first = first_line(finding)
            where = f"file={_property(report.path)}" + (f",line={first}" if first is not None else "")
            text = f"{with_places(finding, 3)}. Fix: {rules()[finding.code].fix}"
            lines.append(f"::{_GITHUB[finding.severity]} {where},title={_property(title)}::{_data(text)}")
    return "\n".join([*lines, summary(reports, fail_on)]) + "\n"


def _data(text: str) -> str:
    """Return text of a workflow command: line breaks as the runner decodes them, other control characters shown."""
    lines = text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")
    return printable(lines)


def _property(text: str) -> str:
    return _data(text).replace(":", "%3A").replace(",", "%2C")


MOST_ROWS = 500
"""Rows of the table; GitHub takes a summary of 1 MiB."""
_MOST_CHARACTERS = 300
_MARKS = str.maketrans({mark: f"\\{mark}" for mark in "\\`*_[]|~#$@!"} | {"<": "&lt;", ">": "&gt;", "&": "&amp;"})


def write_markdown(reports: Sequence[FileReport], fail_on: str) -> str:
    """Write how many files failed, a table of all findings, the worst first, and how to fix them."""
    found = [(report, finding) for report in reports for finding in report.findings]
    found.sort(key=lambda pair: -SEVERITIES.index(pair[1].severity))
    lines = ["## unitcad check", "", f"{summary(reports, fail_on)}."]
    if found:
        lines += ["", "| | file | rule | finding |", "| --- | --- | --- | --- |"]
        lines += [_row(report, finding) for report, finding in found[:MOST_ROWS]]
    if len(found) > MOST_ROWS:
        lines += ["", f"{len(found) - MOST_ROWS:,} more findings are in the log."]
    codes = {finding.code for _, finding in found}
    if codes:
        lines += ["", "How to fix:", ""]
        lines += [
            f"- {code} {_plain(rule.title)}: {_plain(rule.fix)}" for code, rule in rules().items() if code in codes
        ]
    return "\n".join(lines) + "\n"


def _row(report: FileReport, finding: Finding) -> str:
    rule = f"{finding.code} {rules()[finding.code].title}"
    return f"| {finding.severity} | {_plain(report.path)} | {_plain(rule)} | {_plain(with_places(finding, 3))} |"


def _plain(text: str) -> str:
    """Return text of a file in one line that Markdown shows as it is: a name makes no link, tag, mention or column."""
    line = printable(text.replace("\r", " ").replace("\n", " "))
    shown = line if len(line) <= _MOST_CHARACTERS else line[: _MOST_CHARACTERS - 1] + "…"
    return shown.translate(_MARKS)


def json_report(reports: Sequence[FileReport], config: str | None = None) -> dict[str, Any]:
    """Return the JSON object: {files: [{path, verdict, findings, facts}], config}; a finding also has its fix."""
    return {"files": [_entry(report) for report in reports], "config": config}


def _entry(report: FileReport) -> dict[str, Any]:
    entry = report.as_dict()
    for shown, finding in zip(entry["findings"], report.findings, strict=True):
        shown["fix"] = rules()[finding.code].fix
    return entry


def write_junit(reports: Sequence[FileReport], fail_on: str) -> str:
    """Write JUnit XML: a test case a file, a failure a finding at or above `fail_on`."""
    least = SEVERITIES.index(fail_on)
    cases, failed = [], 0
    for report in reports:
        failures = [_failure(item) for item in report.findings if SEVERITIES.index(item.severity) >= least]
        failed += bool(failures)
        name = xml_attribute(printable(report.path))
        cases.append(f'<testcase classname="unitcad.check" name={name}>{"".join(failures)}</testcase>')
    head = f'<testsuite name="unitcad check" tests="{len(reports)}" failures="{failed}" errors="0">'
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', f"<testsuites>{head}", *cases, "</testsuite></testsuites>", ""]
    return "\n".join(lines)


def _failure(finding: Finding) -> str:
    rule = rules()[finding.code]
    places = [f"at {text}" for place in finding.locations if (text := str(place))]
    lines = [f"{finding.code} {rule.title}: {finding.message}", *places, f"Fix: {rule.fix}"]
    head = f"type={xml_attribute(finding.code)} message={xml_attribute(printable(with_places(finding, 3)))}"
    return f"<failure {head}>{xml_text(chr(10).join(map(printable, lines)))}</failure>"


SCHEMA = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"
_LEVELS = {"error": "error", "warning": "warning", "info": "note"}


def sarif_log(reports: Sequence[FileReport]) -> dict[str, Any]:
    """Return one run with every rule and a result a finding."""
    index = {code: i for i, code in enumerate(rules())}
    return {
        "$schema": SCHEMA,
        "version": "2.1.0",
        "runs": [
            {
                "tool": {
                    "driver": {
                        "name": "unitcad check",
                        "semanticVersion": __version__,
                        "rules": [_rule(rule) for rule in rules().values()],
                    }
                },
                "columnKind": "unicodeCodePoints",
                "results": [_result(report, finding, index) for report in reports for finding in report.findings],
            }
        ],
    }


def _rule(rule: Rule) -> dict[str, Any]:
    return {
        "id": rule.code,
        "name": "".join(word.capitalize() for word in re.findall(r"[A-Za-z0-9]+", rule.title.replace("'", ""))),
        "shortDescription": {"text": rule.title},
        "fullDescription": {"text": rule.cause},
        "help": {
            "text": f"{rule.cause} Fix: {rule.fix}",
            "markdown": f"{markdown(rule.cause)}\n\n**Fix:** {markdown(rule.fix)}",
        },
        "defaultConfiguration": {"level": _LEVELS[rule.severity]},
    }


def _result(report: FileReport, finding: Finding, index: dict[str, int]) -> dict[str, Any]:
    file = Path(report.path)
    relative = quote(file.as_posix().encode("utf-8", "surrogateescape"), safe="/")
    uri = file.as_uri() if file.is_absolute() else relative
    physical: dict[str, Any] = {"artifactLocation": {"uri": uri}}
    line = first_line(finding)
    if line is not None:
        physical["region"] = {"startLine": max(line, 1)}
    objects = dict.fromkeys(place.object for place in finding.locations if place.object)
    logical = {"logicalLocations": [{"name": name, "kind": "object"} for name in objects]} if objects else {}
    return {
        "ruleId": finding.code,
        "ruleIndex": index[finding.code],
        "level": _LEVELS[finding.severity],
        "message": {"text": f"{with_places(finding, 1)}. Fix: {rules()[finding.code].fix}"},
        "locations": [{"physicalLocation": physical, **logical}],
        "properties": {"count": finding.count, "places": [place.as_dict() for place in finding.locations]},
    }


FORMATS = ("text", "json", "github", "sarif", "junit", "markdown")


def render(reports: Sequence[FileReport], format_: str, fail_on: str = "error", config: str | None = None) -> str:
    """Return all reports in one of FORMATS, ending in a newline; JSON names `config`, the file of settings."""
    if format_ == "json":
        written = _dump(json_report(reports, config))
    elif format_ == "sarif":
        written = _dump(sarif_log(reports))
    else:
        written = _WRITERS[format_](reports, fail_on)
    return _SURROGATE.sub(partial(_escape, format_ in ("json", "sarif")), written)


_WRITERS = {"text": write_text, "github": write_github, "junit": write_junit, "markdown": write_markdown}
_SURROGATE = re.compile("[\ud800-\udfff]")


def _escape(quoted: bool, match: re.Match[str]) -> str:
    """Write characters that UTF-8 cannot encode, such as a byte of a file name, as \\xe4; `quoted`: in JSON."""
    code = ord(match.group())
    text = f"\\x{code - 0xDC00:02x}" if 0xDC80 <= code <= 0xDCFF else f"\\u{code:04x}"
    return text.replace("\\", "\\\\") if quoted else text


def _dump(data: Any) -> str:
    return json.dumps(data, indent=2, allow_nan=False, ensure_ascii=False) + "\n"
