"""Reports as workflow commands of GitHub Actions: annotations on a pull request."""

from __future__ import annotations

from collections.abc import Sequence

from unitcad.meshcheck.findings import FileReport, first_line, with_places
from unitcad.meshcheck.output.as_text import line, summary
from unitcad.meshcheck.rules.registry import rules
from unitcad.text import printable

_GITHUB = {"error": "error", "warning": "warning", "info": "notice"}


def github(reports: Sequence[FileReport], fail_on: str) -> str:
    """Write workflow commands: an annotation a finding that is not known, then a line for the log that counts."""
    lines = []
    for report in reports:
        for finding in report.findings:
            if finding.known:
                lines.append(f"known: {line(report, finding)}")
                continue
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
