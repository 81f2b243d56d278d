"""One rule: its text, and the findings made of it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import islice

from unitcad.check.detail import detail
from unitcad.check.findings import Finding, Location, Unreadable


@dataclass(frozen=True)
class Rule:
    """What is wrong (`title`), how bad it is, why it matters (`cause`), an example, and how to fix it.

    The code is the family's letter and three digits; the severity is error, warning or info. `count_is_size`: the count
    of a finding says by how many bytes, facets or shells the file is wrong, not how often.
    """

    code: str
    severity: str
    title: str
    cause: str
    example: str
    fix: str
    count_is_size: bool = False

    def finding(
        self, message: str, count: int = 1, places: Iterable[Location] = (), severity: str | None = None
    ) -> Finding:
        """Make a finding, with the rule's severity unless another one is given."""
        kept = tuple(islice(places, detail().locations))
        return Finding(self.code, severity or self.severity, message, int(count), kept)

    def unreadable(
        self, message: str, count: int = 1, places: Iterable[Location] = (), severity: str | None = None
    ) -> Unreadable:
        """Make the error that ends the check of a file with such a finding."""
        return Unreadable(self.finding(message, count, places, severity))
