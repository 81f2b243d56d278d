"""Writes docs/checks.md from the table of rules that `unitcad check --explain` reads."""

from pathlib import Path

from unitcad.check.rules.registry import markdown

if __name__ == "__main__":
    Path(__file__).with_name("checks.md").write_text(markdown(), "utf-8")
