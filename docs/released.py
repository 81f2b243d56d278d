"""The names that the last release had, as docs/reference/inventory.md lists them."""

import re
from pathlib import Path

PAGE = Path(__file__).parent / "reference" / "inventory.md"


def listed(page: str) -> list[str]:
    """Return the lines of a page of the inventory."""
    return re.findall(r"(?m)^- `(.+?)`(?:: .*)?$", page)


def listed_ranges(page: str) -> dict[str, str]:
    """Return the range of each key for which a page of the inventory has one."""
    return dict(re.findall(r"(?m)^- `(.+?)`: (.+)$", page))


def released() -> set[str]:
    """Return the lines of the last release."""
    return set(listed(PAGE.read_text("utf-8")))
