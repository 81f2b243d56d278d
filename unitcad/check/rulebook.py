"""Findings of rules by their code."""

from __future__ import annotations

from collections.abc import Iterable

from unitcad.check.findings import Finding, Location
from unitcad.check.rules.registry import rules


def finding(
    code: str, message: str, count: int = 1, places: Iterable[Location] = (), severity: str | None = None
) -> Finding:
    """Make a finding of rule `code`, with the rule's severity unless another one is given."""
    return rules()[code].finding(message, count, places, severity)
