"""Reports as text, JSON, GitHub annotations and JUnit XML; SARIF has a module of its own."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any
from xml.sax.saxutils import escape, quoteattr

from unitcad.check.findings import SEVERITIES, FileReport, Finding, counted
from unitcad.check.rulebook import rules

FORMATS = ("text", "json", "github", "sarif", "junit")


def render(reports: Sequence[FileReport], format_: str, fail_on: str = "error") -> str:
    """All reports in one of FORMATS, ending in a newline."""
    from unitcad.check.sarif import sarif

    makers: dict[str, Callable[[], str]] = {
        "text": lambda: text(reports),
        "json": lambda: _dump(as_dict(reports)),
        "github": lambda: github(reports),
        "sarif": lambda: _dump(sarif(reports)),
        "junit": lambda: junit(reports, fail_on),
    }
    return makers[format_]()


def _dump(data: Any) -> str:
    return json.dumps(data, indent=2, allow_nan=False, ensure_ascii=False) + "\n"


def as_dict(reports: Sequence[FileReport]) -> dict[str, Any]:
    """The JSON object: {files: [{path, verdict, findings, facts}]}."""
    return {"files": [report.as_dict() for report in reports]}


def text(reports: Sequence[FileReport]) -> str:
    """A line a finding, then one that counts."""
    lines = []
    for report in reports:
        for found in report.findings:
            lines.append(f"{_plain(report.path)}: {found.code} {found.severity}: {_plain(_said(found))}")
    verdicts = Counter(report.verdict for report in reports)
    parts = [
        f"{verdicts[name]} {word}" for name, word in (("error", "failed"), ("warning", "warned")) if verdicts[name]
    ]
    parts.append(f"{verdicts['pass']} passed")
    lines.append(f"{counted(len(reports), 'file')}: {', '.join(parts)}")
    return "\n".join(lines) + "\n"


def _said(found: Finding) -> str:
    places = ", ".join(shown for place in found.locations[:3] if (shown := str(place)))
    return f"{found.message}{f' (at {places})' if places else ''}"


def _plain(said: str) -> str:
    """Text from a file made safe for a terminal: control characters are shown, not sent."""
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode("ascii") for c in said)


_SIZES = {"F002", "F006", "G005"}  # their count is a number of bytes, facets or shells by which the file is wrong


def statistics(reports: Sequence[FileReport]) -> str:
    """How many files each rule hit and how often, most files first. A finding that counts bytes is one occurrence."""
    files: Counter[str] = Counter()
    times: Counter[str] = Counter()
    for report in reports:
        for found in report.findings:
            files[found.code] += 1
            times[found.code] += 1 if found.code in _SIZES else found.count
    lines = [
        f"{counted(n, 'file ', 'files'):>12} {times[code]:9d} x  {code} {rules()[code].title}"
        for code, n in files.most_common()
    ]
    return "\n".join(lines) + "\n" if lines else "no findings\n"


_GITHUB = {"error": "error", "warning": "warning", "info": "notice"}


def github(reports: Sequence[FileReport]) -> str:
    """Workflow commands: an annotation a finding."""
    lines = []
    for report in reports:
        for found in report.findings:
            title = f"{found.code} {rules()[found.code].title}"
            line = next((place.line for place in found.locations if place.line is not None), None)
            where = f"file={_property(report.path)}" + (f",line={line}" if line is not None else "")
            lines.append(f"::{_GITHUB[found.severity]} {where},title={_property(title)}::{_data(_said(found))}")
    return "\n".join(lines) + "\n" if lines else ""


def _data(said: str) -> str:
    return said.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")


def _property(said: str) -> str:
    return _data(said).replace(":", "%3A").replace(",", "%2C")


def junit(reports: Sequence[FileReport], fail_on: str) -> str:
    """JUnit XML: a test case a file, a failure a finding at or above `fail_on`, the others in system-out."""
    least = SEVERITIES.index(fail_on)
    cases, failed = [], 0
    for report in reports:
        bad = [found for found in report.findings if SEVERITIES.index(found.severity) >= least]
        rest = [found for found in report.findings if found not in bad]
        failed += bool(bad)
        inner = "".join(
            f"<failure type={quoteattr(found.code)} message={quoteattr(_xml(_said(found)))}/>" for found in bad
        )
        if rest:
            said = "\n".join(f"{found.code} {found.severity}: {_said(found)}" for found in rest)
            inner += f"<system-out>{escape(_xml(said))}</system-out>"
        cases.append(f'<testcase classname="unitcad.check" name={quoteattr(_xml(report.path))}>{inner}</testcase>')
    head = f'<testsuite name="unitcad check" tests="{len(reports)}" failures="{failed}" errors="0">'
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        + "\n".join([f"<testsuites>{head}", *cases])
        + ("\n</testsuite></testsuites>\n")
    )


def _xml(said: str) -> str:
    """Without the characters that XML 1.0 cannot hold."""
    return "".join(c if c in "\t\n\r" or (c >= " " and not 0xD800 <= ord(c) <= 0xDFFF and c not in "\ufffe\uffff")
                   else "\ufffd" for c in said)  # fmt: skip
