"""Writes docs/checks.md from the table of rules that `unitcad check --explain` reads."""

from pathlib import Path

from unitcad.meshcheck.rules.registry import FAMILIES, rules


def markdown() -> str:
    """Write docs/checks.md: every rule by family."""
    lines = [
        "# Rules of `unitcad check`",
        "",
        "Made from the files of `unitcad/meshcheck/rules/` by `python docs/make_checks.py`; a test compares the two.",
        "Severity: an error fails a run, a warning does with `--fail-on warning`, an info never does.",
        "How to run it in CI: [checks-in-ci.md](checks-in-ci.md).",
        "",
    ]
    head = ["| code | severity | rule | cause | example | fix |", "| --- | --- | --- | --- | --- | --- |"]
    for letter, family in FAMILIES.items():
        lines += [f"## {family}", "", *head]
        for rule in rules().values():
            if rule.code.startswith(letter):
                cells = (rule.code, rule.severity, rule.title, rule.cause, rule.example, rule.fix)
                lines.append(f"| {' | '.join(cells)} |")
        lines.append("")
    return "\n".join(lines)


if __name__ == "__main__":
    Path(__file__).with_name("checks.md").write_text(markdown(), "utf-8")
