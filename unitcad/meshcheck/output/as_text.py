"""Reports as text for a person: a line a finding, how to fix what was found, and a count."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from unitcad.meshcheck.findings import Facts, FileReport, Finding, counted, number, with_places
from unitcad.meshcheck.rules.registry import rules
from unitcad.text import printable


def text(reports: Sequence[FileReport], fail_on: str) -> str:
    """Return a line a finding, one with the size of each file that passed, how to fix what was found, then a count."""
    lines = []
    codes: set[str] = set()
    for report in reports:
        for finding in report.findings:
            if not finding.known:
                codes.add(finding.code)
            lines.append(line(report, finding))
        if report.verdict == "pass" and (size := _size(report.facts)):
            lines.append(f"{printable(report.path)}: passed: {size}")
    if codes:  # else the rules that no file needed are not loaded
        fixes = [f"  {code} {rule.title}: {rule.fix}" for code, rule in rules().items() if code in codes]
        lines += ["How to fix:", *fixes, _EXPLAIN]
    return "\n".join([*lines, summary(reports, fail_on)]) + "\n"


def line(report: FileReport, finding: Finding) -> str:
    """Return a finding in one line: file, code, severity, message and its first places."""
    known = " (known)" if finding.known else ""
    return f"{printable(report.path)}: {finding.code} {finding.severity}{known}: {printable(with_places(finding, 3))}"


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
    if known := sum(finding.known for report in reports for finding in report.findings):
        parts.append(counted(known, "known finding"))
    return f"{counted(len(reports), 'file')}: {', '.join(parts)}"


def statistics(reports: Sequence[FileReport]) -> str:
    """Return how many files each rule hit and how often, most files first.

    A finding that counts bytes is one occurrence.
    """
    files: Counter[str] = Counter()
    times: Counter[str] = Counter()
    for report in reports:
        for finding in report.findings:
            files[finding.code] += 1
            times[finding.code] += 1 if rules()[finding.code].count_is_size else finding.count
    lines = [
        f"{counted(n, 'file ', 'files'):>12} {times[code]:9d} x  {code} {rules()[code].title}"
        for code, n in files.most_common()
    ]
    return "\n".join(lines) + "\n" if lines else "no findings\n"
