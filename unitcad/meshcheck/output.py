"""Reports as text for a person, JSON, annotations of GitHub Actions, Markdown, JUnit XML or SARIF, in UTF-8.

SARIF 2.1.0 is as OASIS defines it and GitHub code scanning reads it.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections import Counter
from collections.abc import Sequence
from functools import partial
from math import dist
from pathlib import Path
from typing import Any
from urllib.parse import quote

from unitcad import __version__
from unitcad.meshcheck.findings import (
    CHANGES,
    SEVERITIES,
    Change,
    Facts,
    FileReport,
    Finding,
    counted,
    first_line,
    number,
    with_places,
)
from unitcad.meshcheck.rules.registry import Rule, rules
from unitcad.text import markdown, printable, xml_attribute, xml_text


def write_text(reports: Sequence[FileReport], fail_on: str) -> str:
    """Return a line a finding, one with the size of each file that passed, how to fix the findings, then a count.

    Known findings are counted only. A file that has changed has a line of the differences.
    """
    lines = []
    codes: set[str] = set()
    for report in reports:
        if report.change is not None:
            lines += _change_lines(report, report.change)
        for finding in report.findings:
            if not finding.known:
                codes.add(finding.code)
                lines.append(finding_line(report, finding))
        if report.change is None and report.verdict == "pass" and (size := _size(report.facts)):
            known = sum(item.known for item in report.findings)
            but = f" but for {counted(known, 'known finding')}" if known else ""
            lines.append(f"{printable(report.path)}: passed{but}: {size}")
    if codes:  # else the rules that no file needed are not loaded
        fixes = [f"  {code} {rule.title}: {rule.fix}" for code, rule in rules().items() if code in codes]
        lines += ["How to fix:", *fixes, _EXPLAIN]
    return "\n".join([*lines, summary(reports, fail_on)]) + "\n"


def write_quiet(reports: Sequence[FileReport], fail_on: str) -> str:
    """Return a line for each finding that fails, then a count."""
    lines = [finding_line(report, item) for report in reports for item in failing(report, fail_on)]
    return "\n".join([*lines, summary(reports, fail_on)]) + "\n"


def failing(report: FileReport, fail_on: str) -> list[Finding]:
    """Return the findings of a file that fail it: those at or above `fail_on` that are not known."""
    least = SEVERITIES.index(fail_on)
    return [item for item in report.findings if not item.known and SEVERITIES.index(item.severity) >= least]


def finding_line(report: FileReport, finding: Finding) -> str:
    """Return a finding in one line: file, code, severity, message and its first places."""
    return f"{printable(report.path)}: {finding.code} {finding.severity}: {printable(with_places(finding, 3))}"


_EXPLAIN = "`unitcad check --explain CODE` says what a code means and why it matters."


def _change_lines(report: FileReport, change: Change) -> list[str]:
    """Return how a file differs from its old version, and a line for each finding that only that one has."""
    if change.kind == "unchanged":
        return []
    path, rows = printable(report.path), differences(report, change)
    lines = [f"{path}: {change_title(change)}{''.join(f'; {name} {old} -> {new}' for name, old, new in rows)}"]
    return lines + [f"{path}: gone: {item.code} {item.severity}: {printable(item.message)}" for item in change.gone]


def change_title(change: Change) -> str:
    """Say what has become of a file."""
    if change.kind != "changed":
        return {"new": "new file", "gone": "file is gone", "unchanged": "unchanged"}[change.kind]
    if change.distance_mm is None or change.error_mm is None:
        return "changed, without two surfaces to compare"
    size = _diagonal(change.old)
    if change.distance_mm <= _SAME * size:
        return f"the same surface, to {number(change.error_mm, 2)} mm" if size else "the same surface"
    return f"surfaces up to {number(change.distance_mm, 3)} mm apart (at most {number(change.error_mm, 2)} mm more)"


_SAME = 1e-6
"""Distance of surfaces that differ by rounding, as part of the diagonal."""


def _diagonal(facts: Facts) -> float:
    return dist(*facts.bbox_mm) if facts.bbox_mm is not None else 0.0


def differences(report: FileReport, change: Change) -> list[tuple[str, str, str]]:
    """Return the facts that differ: each one's name with its old and new value."""
    if change.kind != "changed":
        return []
    values = [_shown(facts) for facts in (change.old, report.facts)]
    return [
        (name, old, new) for (name, old), new in zip(values[0].items(), values[1].values(), strict=True) if old != new
    ]


def _shown(facts: Facts) -> dict[str, str]:
    box = facts.bbox_mm and " x ".join(number(high - low) for low, high in zip(*facts.bbox_mm, strict=True))
    lowest = facts.bbox_mm and f" from ({', '.join(number(value, 4) for value in facts.bbox_mm[0])})"
    volume = None if facts.volume_mm3 is None else f"{number(facts.volume_mm3)} mm3"
    shown = {"volume": volume, "box": box and f"{box} mm{lowest}", "shells": facts.shells, "triangles": facts.triangles}
    return {name: "none" if value is None else str(value) for name, value in shown.items()}


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
    """Return how many files failed, gave warnings and passed; with `fail_on` warning those with one failed too.

    For two versions, also how many files changed, and how many findings are new or gone.
    """
    verdicts = Counter(report.verdict for report in reports)
    warned = "failed by a warning (--fail-on warning)" if fail_on == "warning" else "warned"
    parts = [f"{verdicts[name]} {word}" for name, word in (("error", "failed"), ("warning", warned)) if verdicts[name]]
    changes = [report.change for report in reports if report.change is not None]
    if changes:
        kinds = Counter(change.kind for change in changes)
        new = sum(not item.known for report in reports for item in report.findings)
        parts = [f"{kinds[kind]} {kind}" for kind in CHANGES if kinds[kind]] + parts
        parts.append(f"{counted(new, 'new finding')}, {counted(sum(len(one.gone) for one in changes), 'finding')} gone")
    else:
        parts.append(f"{verdicts['pass']} passed")
        if known := sum(item.known for report in reports for item in report.findings):
            parts.append(counted(known, "known finding"))
    return f"{counted(len(reports), 'file')}: {', '.join(parts)}"


_GITHUB = {"error": "error", "warning": "warning", "info": "notice"}


def write_github(reports: Sequence[FileReport], fail_on: str) -> str:
    """Write workflow commands: an annotation a finding that is not known, then a line for the log that counts."""
    lines = []
    for report in reports:
        for finding in (item for item in report.findings if not item.known):
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
    """Write how many files failed, the differences of versions, a table of findings, the worst first, and fixes."""
    found = [(report, finding) for report in reports for finding in report.findings if not finding.known]
    found.sort(key=lambda pair: -SEVERITIES.index(pair[1].severity))
    lines = ["## unitcad check", "", f"{summary(reports, fail_on)}.", *_changes_table(reports)]
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


def _changes_table(reports: Sequence[FileReport]) -> list[str]:
    """Return a table of the files that differ from their old version."""
    rows = []
    for report in reports:
        if report.change is not None and report.change.kind != "unchanged":
            facts = "; ".join(f"{name} {old} → {new}" for name, old, new in differences(report, report.change))
            gone = ", ".join(item.code for item in report.change.gone)
            rows.append(f"| {_plain(report.path)} | {_plain(change_title(report.change))} | {_plain(facts)} | {gone} |")
    head = ["", "| file | change | old → new | findings gone |", "| --- | --- | --- | --- |"]
    return [*head, *rows[:MOST_ROWS]] if rows else []


def _row(report: FileReport, finding: Finding) -> str:
    rule = f"{finding.code} {rules()[finding.code].title}"
    return f"| {finding.severity} | {_plain(report.path)} | {_plain(rule)} | {_plain(with_places(finding, 3))} |"


def _plain(text: str) -> str:
    """Return text of a file in one line that Markdown shows as it is: a name makes no link, tag, mention or column."""
    line = printable(text.replace("\r", " ").replace("\n", " "))
    shown = line if len(line) <= _MOST_CHARACTERS else line[: _MOST_CHARACTERS - 1] + "…"
    return shown.translate(_MARKS)


def json_report(
    reports: Sequence[FileReport], config: str | None = None, baseline: str | None = None
) -> dict[str, Any]:
    """Return the JSON object: {files: [{path, verdict, findings, facts}], config, baseline}.

    A finding also has its fix and whether it is known, a file of `--diff` its change.
    """
    return {"files": [_entry(report) for report in reports], "config": config, "baseline": baseline}


def _entry(report: FileReport) -> dict[str, Any]:
    entry = report.as_dict()
    for shown in entry["findings"]:
        shown["fix"] = rules()[shown["code"]].fix
    return entry


def write_junit(reports: Sequence[FileReport], fail_on: str) -> str:
    """Write JUnit XML: a test case a file with one failure at most, which lists all findings that fail, and its time."""
    cases, failed = [], 0
    for report in reports:
        bad = failing(report, fail_on)
        failed += bool(bad)
        inner = _failure(bad) if bad else ""
        if rest := [item for item in report.findings if item not in bad]:
            known = [f"{item.code} {'known' if item.known else item.severity}: {with_places(item, 3)}" for item in rest]
            inner += f"<system-out>{xml_text(chr(10).join(map(printable, known)))}</system-out>"
        name = xml_attribute(printable(report.path))
        cases.append(f'<testcase classname="unitcad.check" name={name}{_time(report.seconds)}>{inner}</testcase>')
    times = [report.seconds for report in reports if report.seconds is not None]
    counts = f'tests="{len(reports)}" failures="{failed}" errors="0"{_time(sum(times) if times else None)}'
    head = f'<testsuite name="unitcad check" {counts}>'
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', f"<testsuites>{head}", *cases, "</testsuite></testsuites>", ""]
    return "\n".join(lines)


def _time(seconds: float | None) -> str:
    return "" if seconds is None else f' time="{seconds:.3f}"'


def _failure(findings: Sequence[Finding]) -> str:
    """Return the failure of a test case: the first finding as its message, all of them in its text."""
    lines = []
    for finding in findings:
        rule = rules()[finding.code]
        places = [f"at {text}" for place in finding.locations if (text := str(place))]
        lines += [f"{finding.code} {rule.title}: {finding.message}", *places, f"Fix: {rule.fix}"]
    more = f"; and {counted(len(findings) - 1, 'more finding')}" if len(findings) > 1 else ""
    codes = ",".join(finding.code for finding in findings)
    head = f"type={xml_attribute(codes)} message={xml_attribute(printable(with_places(findings[0], 3) + more))}"
    return f"<failure {head}>{xml_text(chr(10).join(map(printable, lines)))}</failure>"


SCHEMA = "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json"
_LEVELS = {"error": "error", "warning": "warning", "info": "note"}


def sarif_log(reports: Sequence[FileReport]) -> dict[str, Any]:
    """Return one run with every rule and a result a finding; known ones are unchanged and suppressed."""
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
    region = {"startLine": max(first_line(finding) or 1, 1)}  # GitHub wants one of binary files, too
    physical = {"artifactLocation": {"uri": uri}, "region": region}
    objects = dict.fromkeys(place.object for place in finding.locations if place.object)
    logical = {"logicalLocations": [{"name": name, "kind": "object"} for name in objects]} if objects else {}
    return {
        "ruleId": finding.code,
        "ruleIndex": index[finding.code],
        "level": _LEVELS[finding.severity],
        "message": {"text": f"{with_places(finding, 1)}. Fix: {rules()[finding.code].fix}"},
        "locations": [{"physicalLocation": physical, **logical}],
        "partialFingerprints": fingerprints(report.path, finding),
        "properties": {"count": finding.count, "places": [place.as_dict() for place in finding.locations]},
        **(_UNCHANGED if finding.known else {}),
    }


_UNCHANGED = {"baselineState": "unchanged", "suppressions": [{"kind": "external", "status": "accepted"}]}


def fingerprints(path: str, finding: Finding) -> dict[str, str]:
    """Return what tells a result from others: its file, as seen from the working directory, and its rule.

    A part that is exported again keeps them. GitHub reads the second one.
    """
    whole, here = os.path.abspath(path), os.getcwd()
    seen = os.path.relpath(whole, here) if whole.startswith(os.path.join(here, "")) else path
    name = Path(seen).as_posix().encode("utf-8", "surrogateescape")
    digest = hashlib.sha256(name + b"\n" + finding.code.encode()).hexdigest()
    return {"fileAndRule/v1": digest, "primaryLocationLineHash": f"{digest[:16]}:1"}


FORMATS = ("text", "json", "github", "sarif", "junit", "markdown")


def render(
    reports: Sequence[FileReport],
    format_: str,
    fail_on: str = "error",
    config: str | None = None,
    baseline: str | None = None,
    *,
    quiet: bool = False,
) -> str:
    """Return all reports in one of FORMATS, ending in a newline.

    JSON names `config` and `baseline`, the files of settings and of known findings. `quiet` is for text.
    """
    if format_ == "json":
        written = _dump(json_report(reports, config, baseline))
    elif format_ == "sarif":
        written = _dump(sarif_log(reports))
    elif format_ == "text" and quiet:
        written = write_quiet(reports, fail_on)
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
