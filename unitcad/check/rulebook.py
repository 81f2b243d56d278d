"""The table of rules (rules.toml): severity, title, cause and mend of each code, and who may be selected."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from itertools import islice

from unitcad.check.detail import detail
from unitcad.check.findings import Finding, Location
from unitcad.errors import Refusal

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


@dataclass(frozen=True)
class Rule:
    """One rule: what it is called, how bad it is, where it comes from and how to mend it."""

    code: str
    severity: str
    title: str
    cause: str
    mend: str


@cache
def rules() -> dict[str, Rule]:
    """All rules by code, in the table's order."""
    table = tomllib.loads((files("unitcad.check") / "rules.toml").read_text("utf-8"))
    return {code: Rule(code, **entry) for code, entry in table.items()}


def finding(
    code: str,
    message: str,
    count: int = 1,
    places: Iterable[Location] = (),
    severity: str | None = None,
) -> Finding:
    """A finding of rule `code`, with the rule's severity unless another one is given."""
    kept = tuple(islice(places, detail().locations))
    return Finding(code, severity or rules()[code].severity, message, int(count), kept)


def explain(codes: str) -> str:
    """Rules in words: codes or prefixes of codes, split by commas. Raises `Refusal` for one that begins no code."""
    chosen = check_prefixes("--explain", [part for part in codes.split(",") if part.strip()] or [codes])
    return "\n\n".join(
        f"{rule.code} {rule.title} ({rule.severity})\n\nCause: {rule.cause}\nFix:   {rule.mend}"
        for rule in rules().values()
        if rule.code.startswith(chosen)
    )


def markdown() -> str:
    """docs/checks.md: every rule by family."""
    lines = [
        "# Rules of `unitcad check`",
        "",
        "Made from `unitcad/check/rules.toml` by `python docs/make_checks.py`; a test holds the two together.",
        "Severity: an error fails a run, a warning does with `--fail-on warning`, an info never does.",
        "How to run it in CI: [checks-in-ci.md](checks-in-ci.md).",
        "",
    ]
    for letter, family in FAMILIES.items():
        lines += [f"## {family}", "", "| code | severity | rule | cause | fix |", "| --- | --- | --- | --- | --- |"]
        for rule in rules().values():
            if rule.code.startswith(letter):
                lines.append(f"| {rule.code} | {rule.severity} | {rule.title} | {rule.cause} | {rule.mend} |")
        lines.append("")
    return "\n".join(lines)


def check_prefixes(option: str, prefixes: Sequence[str]) -> tuple[str, ...]:
    """The prefixes in capitals. Raises `Refusal` for one that begins no code."""
    kept = []
    for prefix in prefixes:
        wanted = prefix.strip().upper()
        if not wanted or not any(code.startswith(wanted) for code in rules()):
            near = difflib.get_close_matches(wanted, rules(), n=1, cutoff=0.5)
            raise Refusal(option, prefix, "begins no rule's code", near[0] if near else None)
        kept.append(wanted)
    return tuple(kept)
