"""Rules by their texts, found in the files of this folder: for --explain, the page of the rules and SARIF's list."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from functools import cache
from importlib import import_module
from itertools import islice
from pkgutil import iter_modules
from types import ModuleType

from unitcad.errors import Refusal
from unitcad.meshcheck import rules as folder
from unitcad.meshcheck.findings import MOST_COUNTED, SEVERITIES, Finding, Location, Unreadable, most_locations

_LONGEST = 400  # characters of a message


class Rule:
    """A rule by its text: the fault, how bad it is, why it matters, an example, and how to fix it.

    The text's first line is `CODE severity: title`; the cause, `Example: ...` and `Fix: ...` follow. The code is the
    family's letter and three digits; the severity is error, warning or info. Raises ValueError for another form.
    """

    def __init__(self, text: str) -> None:
        head, _, body = text.strip().partition("\n")
        self.code, self.severity, self.title = head.replace(":", "", 1).split(" ", 2)
        if self.severity not in SEVERITIES:
            raise ValueError(f"{head!r} names none of the severities {', '.join(SEVERITIES)}")
        self.cause, rest = " ".join(body.split()).split(" Example: ")
        self.example, self.fix = rest.split(" Fix: ")

    def finding(
        self, message: str, count: int = 1, places: Iterable[Location] = (), severity: str | None = None
    ) -> Finding:
        """Make a finding, with the rule's severity unless another one is given."""
        kept = tuple(islice(places, most_locations()))
        if len(message) > _LONGEST:  # a name in it may have megabytes
            message = f"{message[: _LONGEST // 2]} … {message[-_LONGEST // 2 :]}"
        return Finding(self.code, severity or self.severity, message, min(int(count), MOST_COUNTED), kept)

    def unreadable(
        self, message: str, count: int = 1, places: Iterable[Location] = (), severity: str | None = None
    ) -> Unreadable:
        """Make the error that ends the check of a file with such a finding."""
        return Unreadable(self.finding(message, count, places, severity))


FAMILIES = {
    "F": "File",
    "P": "3MF package",
    "V": "Values",
    "T": "Topology",
    "G": "Geometry",
    "S": "Scale",
    "D": "Printability",
    "M": "Manifest",
}
_FAMILY_FILE = re.compile(f"[{''.join(FAMILIES).lower()}]_")


@cache
def modules() -> tuple[ModuleType, ...]:
    """Return the files of rules, family by family; a file's name begins with its family's letter."""
    names = sorted(name for _, name, _ in iter_modules(folder.__path__) if _FAMILY_FILE.match(name))
    names.sort(key=lambda name: list(FAMILIES).index(name[0].upper()))
    return tuple(import_module(f"{folder.__name__}.{name}") for name in names)


@cache
def rules() -> dict[str, Rule]:
    """Return all rules by code, family by family. Raises ValueError if two have one code."""
    every: dict[str, Rule] = {}
    for rule in (value for module in modules() for value in vars(module).values() if isinstance(value, Rule)):
        if every.setdefault(rule.code, rule) is not rule:
            raise ValueError(f"two rules have the code {rule.code}")
    return dict(sorted(every.items(), key=lambda item: (list(FAMILIES).index(item[0][0]), item[0])))


def explain(codes: str) -> str:
    """Explain rules: codes or prefixes of codes, split by commas. Raises `Refusal` for one that begins no code."""
    chosen = check_prefixes("--explain", [part for part in codes.split(",") if part.strip()] or [codes])
    return "\n\n".join(
        f"{rule.code} {rule.title} ({rule.severity})\n\n"
        f"Cause:   {rule.cause}\nExample: {rule.example}\nFix:     {rule.fix}"
        for rule in rules().values()
        if rule.code.startswith(chosen)
    )


def check_prefixes(option: str, prefixes: Sequence[str] | None) -> tuple[str, ...]:
    """Return the prefixes in capitals. Raises `Refusal` for one that begins no code."""
    kept = []
    for prefix in prefixes or ():
        wanted = prefix.strip().upper()
        if not wanted or not any(code.startswith(wanted) for code in rules()):
            near = get_close_matches(wanted, rules(), n=1, cutoff=0.5)
            raise Refusal(option, prefix, "unknown code; unitcad list rules lists all", near[0] if near else None)
        kept.append(wanted)
    return tuple(kept)
