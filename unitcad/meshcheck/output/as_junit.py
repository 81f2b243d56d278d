"""Reports as JUnit XML, which CI servers show as test results."""

from __future__ import annotations

from collections.abc import Sequence

from unitcad.meshcheck.findings import SEVERITIES, FileReport, Finding, with_places
from unitcad.meshcheck.rules.registry import rules
from unitcad.text import xml_attribute, xml_text


def junit(reports: Sequence[FileReport], fail_on: str) -> str:
    """Write JUnit XML: a test case a file, a failure a finding at or above `fail_on`, the others in system-out."""
    least = SEVERITIES.index(fail_on)
    cases, failed = [], 0
    for report in reports:
        bad = [
            finding for finding in report.findings if not finding.known and SEVERITIES.index(finding.severity) >= least
        ]
        rest = [finding for finding in report.findings if finding not in bad]
        failed += bool(bad)
        inner = "".join(_failure(finding) for finding in bad)
        if rest:
            others = "\n".join(
                f"{item.code} {item.severity}{' (known)' if item.known else ''}: {with_places(item, 3)}"
                for item in rest
            )
            inner += f"<system-out>{xml_text(_xml(others))}</system-out>"
        name = f"name={xml_attribute(_xml(report.path))}" + _time(report.seconds)
        cases.append(f'<testcase classname="unitcad.check" {name}>{inner}</testcase>')
    known = [report.seconds for report in reports if report.seconds is not None]
    total = sum(known) if known else None
    head = f'<testsuite name="unitcad check" tests="{len(reports)}" failures="{failed}" errors="0"{_time(total)}>'
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        + "\n".join([f"<testsuites>{head}", *cases])
        + ("\n</testsuite></testsuites>\n")
    )


def _time(seconds: float | None) -> str:
    return "" if seconds is None else f' time="{seconds:.3f}"'


def _failure(finding: Finding) -> str:
    rule = rules()[finding.code]
    places = [f"at {text}" for place in finding.locations if (text := str(place))]
    body = "\n".join([f"{finding.code} {rule.title}: {finding.message}", *places, f"Fix: {rule.fix}"])
    head = f"type={xml_attribute(finding.code)} message={xml_attribute(_xml(with_places(finding, 3)))}"
    return f"<failure {head}>{xml_text(_xml(body))}</failure>"


def _xml(text: str) -> str:
    """Replace the characters that XML 1.0 cannot hold."""
    return "".join(c if c in "\t\n\r" or (c >= " " and not 0xD800 <= ord(c) <= 0xDFFF and c not in "\ufffe\uffff")
                   else "\ufffd" for c in text)  # fmt: skip
