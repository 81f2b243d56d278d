"""One rule: its text, and the findings made of it."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import islice

from unitcad.meshcheck.detail import detail
from unitcad.meshcheck.findings import SEVERITIES, Finding, Location, Unreadable


class Rule:
    """A rule by its text: what is wrong, how bad it is, why it matters, an example, and how to fix it.

    The text's first line is `CODE severity: title`; the cause, `Example: ...` and `Fix: ...` follow. The code is the
    family's letter and three digits; the severity is error, warning or info. `count_is_size`: the count of a finding
    says by how many bytes, facets or shells the file is wrong, not how often. Raises ValueError for another form.
    """

    def __init__(self, text: str, *, count_is_size: bool = False) -> None:
        head, _, body = text.strip().partition("\n")
        self.code, self.severity, self.title = head.replace(":", "", 1).split(" ", 2)
        if self.severity not in SEVERITIES:
            raise ValueError(f"{head!r} names none of the severities {', '.join(SEVERITIES)}")
        self.cause, rest = " ".join(body.split()).split(" Example: ")
        self.example, self.fix = rest.split(" Fix: ")
        self.count_is_size = count_is_size

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
