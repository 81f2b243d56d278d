"""Reports as JSON for programs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from unitcad.meshcheck.findings import FileReport
from unitcad.meshcheck.rules.registry import rules


def as_dict(reports: Sequence[FileReport], config: str | None = None, baseline: str | None = None) -> dict[str, Any]:
    """Return the JSON object: {files: [{path, verdict, findings, facts}], config, baseline}.

    A finding also says how to fix it, and whether the baseline lists it.
    """
    return {"files": [_entry(report) for report in reports], "config": config, "baseline": baseline}


def _entry(report: FileReport) -> dict[str, Any]:
    entry = report.as_dict()
    for shown, finding in zip(entry["findings"], report.findings, strict=True):
        shown |= {"fix": rules()[finding.code].fix, "known": finding.known}
    return entry
