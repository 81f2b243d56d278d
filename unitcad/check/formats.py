"""Reports as text, JSON, GitHub annotations and JUnit XML; SARIF has a module of its own."""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any
from xml.sax.saxutils import escape, quoteattr

from unitcad.check.findings import SEVERITIES, Facts, FileReport, Finding, counted, number, said
from unitcad.check.rulebook import rules
from unitcad.text import printable

FORMATS = ("text", "json", "github", "sarif", "junit")


def render(
    reports: Sequence[FileReport],
    format_: str,
    fail_on: str = "error",
    config: str | None = None,
    baseline: str | None = None,
) -> str:
    """All reports in one of FORMATS, ending in a newline; JSON names the files of settings and of known findings."""
    from unitcad.check.sarif import sarif

    makers: dict[str, Callable[[], str]] = {
        "text": lambda: text(reports),
        "json": lambda: _dump(as_dict(reports, config, baseline)),
        "github": lambda: github(reports),
        "sarif": lambda: _dump(sarif(reports)),
        "junit": lambda: junit(reports, fail_on),
    }
    return _SURROGATE.sub(partial(_escaped, format_ in ("json", "sarif")), makers[format_]())


_SURROGATE = re.compile("[\ud800-\udfff]")


def _escaped(quoted: bool, match: re.Match[str]) -> str:
    """What UTF-8 cannot hold, such as a byte of a file's name that is no text, as \\xe4; quoted for JSON's strings."""
    code = ord(match.group())
    text = f"\\x{code - 0xDC00:02x}" if 0xDC80 <= code <= 0xDCFF else f"\\u{code:04x}"
    return text.replace("\\", "\\\\") if quoted else text


def _dump(data: Any) -> str:
    return json.dumps(data, indent=2, allow_nan=False, ensure_ascii=False) + "\n"


def as_dict(reports: Sequence[FileReport], config: str | None = None, baseline: str | None = None) -> dict[str, Any]:
    """The JSON object: {files: [{path, verdict, findings, facts}], config, baseline}.

    A finding also says how to fix it, and whether the baseline lists it.
    """
    return {"files": [_entry(report) for report in reports], "config": config, "baseline": baseline}


def _entry(report: FileReport) -> dict[str, Any]:
    entry = report.as_dict()
    for shown, found in zip(entry["findings"], report.findings, strict=True):
        shown |= {"fix": rules()[found.code].mend, "known": found.known}
    return entry


def text(reports: Sequence[FileReport]) -> str:
    """A line a finding, one with the size of each file that passed, how to fix what was found, then a count."""
    lines = []
    codes: set[str] = set()
    for report in reports:
        for found in report.findings:
            if not found.known:
                codes.add(found.code)
            lines.append(_line(report, found))
        if report.verdict == "pass" and (size := _size(report.facts)):
            lines.append(f"{printable(report.path)}: passed: {size}")
    fixes = [f"  {code} {rule.title}: {rule.mend}" for code, rule in rules().items() if code in codes]
    if fixes:
        lines += ["How to fix:", *fixes, _EXPLAIN]
    return "\n".join([*lines, _summary(reports)]) + "\n"


def _line(report: FileReport, found: Finding) -> str:
    known = " (known)" if found.known else ""
    return f"{printable(report.path)}: {found.code} {found.severity}{known}: {printable(said(found, 3))}"


_EXPLAIN = "`unitcad check --explain CODE` says what a code means and why it matters."


def _size(facts: Facts) -> str:
    """Sides of the box, volume, shells and triangles, as far as they are known."""
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


def _summary(reports: Sequence[FileReport]) -> str:
    verdicts = Counter(report.verdict for report in reports)
    parts = [
        f"{verdicts[name]} {word}" for name, word in (("error", "failed"), ("warning", "warned")) if verdicts[name]
    ]
    parts.append(f"{verdicts['pass']} passed")
    if known := sum(found.known for report in reports for found in report.findings):
        parts.append(counted(known, "known finding"))
    return f"{counted(len(reports), 'file')}: {', '.join(parts)}"


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
    """Workflow commands: an annotation a finding that is not known, then a line for the log that counts."""
    lines = []
    for report in reports:
        for found in report.findings:
            if found.known:
                lines.append(f"known: {_line(report, found)}")
                continue
            title = f"{found.code} {rules()[found.code].title}"
            line = next((place.line for place in found.locations if place.line is not None), None)
            where = f"file={_property(report.path)}" + (f",line={line}" if line is not None else "")
            text = f"{said(found, 3)}. Fix: {rules()[found.code].mend}"
            lines.append(f"::{_GITHUB[found.severity]} {where},title={_property(title)}::{_data(text)}")
    return "\n".join([*lines, _summary(reports)]) + "\n"


def _data(text: str) -> str:
    """Text of a workflow command: line breaks as the runner decodes them, other control characters shown, not sent."""
    lines = text.replace("%", "%25").replace("\r", "%0D").replace("\n", "%0A")
    return printable(lines)


def _property(text: str) -> str:
    return _data(text).replace(":", "%3A").replace(",", "%2C")


def junit(reports: Sequence[FileReport], fail_on: str) -> str:
    """JUnit XML: a test case a file, a failure a finding at or above `fail_on`, the others in system-out."""
    least = SEVERITIES.index(fail_on)
    cases, failed = [], 0
    for report in reports:
        bad = [found for found in report.findings if not found.known and SEVERITIES.index(found.severity) >= least]
        rest = [found for found in report.findings if found not in bad]
        failed += bool(bad)
        inner = "".join(_failure(found) for found in bad)
        if rest:
            told = "\n".join(
                f"{found.code} {found.severity}{' (known)' if found.known else ''}: {said(found, 3)}" for found in rest
            )
            inner += f"<system-out>{escape(_xml(told))}</system-out>"
        name = f"name={quoteattr(_xml(report.path))}" + _time(report.seconds)
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


def _failure(found: Finding) -> str:
    rule = rules()[found.code]
    places = [f"at {text}" for place in found.locations if (text := str(place))]
    body = "\n".join([f"{found.code} {rule.title}: {found.message}", *places, f"Fix: {rule.mend}"])
    head = f"type={quoteattr(found.code)} message={quoteattr(_xml(said(found, 3)))}"
    return f"<failure {head}>{escape(_xml(body))}</failure>"


def _xml(text: str) -> str:
    """Without the characters that XML 1.0 cannot hold."""
    return "".join(c if c in "\t\n\r" or (c >= " " and not 0xD800 <= ord(c) <= 0xDFFF and c not in "\ufffe\uffff")
                   else "\ufffd" for c in text)  # fmt: skip
