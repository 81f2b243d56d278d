"""Reports as Markdown: the summary of a CI job."""

from __future__ import annotations

from collections.abc import Sequence

from unitcad.meshcheck.findings import SEVERITIES, FileReport, Finding, with_places
from unitcad.meshcheck.output.as_text import summary
from unitcad.meshcheck.rules.registry import rules
from unitcad.text import printable

MOST_ROWS = 500
"""Rows of the table; GitHub takes a summary of 1 MiB."""
_MOST_CHARACTERS = 300
_MARKS = str.maketrans({mark: f"\\{mark}" for mark in "\\`*_[]|~#$@!"} | {"<": "&lt;", ">": "&gt;", "&": "&amp;"})


def markdown(reports: Sequence[FileReport], fail_on: str) -> str:
    """Write how many files failed, a table of all findings, the worst first, and how to fix what was found."""
    found = [(report, finding) for report in reports for finding in report.findings]
    found.sort(key=lambda pair: (pair[1].known, -SEVERITIES.index(pair[1].severity)))
    lines = ["## unitcad check", "", f"{summary(reports, fail_on)}."]
    if found:
        lines += ["", "| | file | rule | finding |", "| --- | --- | --- | --- |"]
        lines += [_row(report, finding) for report, finding in found[:MOST_ROWS]]
    if len(found) > MOST_ROWS:
        lines += ["", f"{len(found) - MOST_ROWS:,} more findings are in the log."]
    codes = {finding.code for _, finding in found if not finding.known}
    if codes:
        lines += ["", "How to fix:", ""]
        lines += [
            f"- {code} {_plain(rule.title)}: {_plain(rule.fix)}" for code, rule in rules().items() if code in codes
        ]
    return "\n".join(lines) + "\n"


def _row(report: FileReport, finding: Finding) -> str:
    severity = "known" if finding.known else finding.severity
    rule = f"{finding.code} {rules()[finding.code].title}"
    return f"| {severity} | {_plain(report.path)} | {_plain(rule)} | {_plain(with_places(finding, 3))} |"


def _plain(text: str) -> str:
    """Return text of a file in one line that Markdown shows as it is: a name makes no link, tag, mention or column."""
    line = printable(text.replace("\r", " ").replace("\n", " "))
    shown = line if len(line) <= _MOST_CHARACTERS else line[: _MOST_CHARACTERS - 1] + "…"
    return shown.translate(_MARKS)
