"""Counts of sentences that read badly, in strings and pages: long ones, and patterns that plain English avoids.

`python -m benchmarks.words PATTERN` prints the sentences of one pattern; without an argument, the count of each.
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path

ROOT = Path(__file__).parents[1]
LONG = "long sentences"
MOST_WORDS = 25
PATTERNS = {
    "what": r"\bwhat\b",
    "where": r"\bwhere\b",
    "beside": r"\bbeside\b",
    "stand, lie, hold": r"\b(?:stands?|lies|lie|holds?)\b",
    "sentence that begins with Of": r"^Of\b",
}


def texts(files: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    """Yield name and prose of each module of the package and each page that a person wrote."""
    for name, source in files.items():
        if name.startswith("unitcad/") and name.endswith(".py"):
            yield name, _strings(source)
        elif name.endswith(".md") and name.startswith(("docs/", "README")) and "/evidence/accuracy/" not in name:
            yield name, _prose(source)


def found(files: Mapping[str, str]) -> dict[str, list[str]]:
    """Return the sentences of each pattern, after their file's name."""
    rows: dict[str, list[str]] = {pattern: [] for pattern in (LONG, *PATTERNS)}
    for name, text in texts(files):
        for sentence in re.split(r"(?<=[.!?])\s+|\n\n", text):
            place = f"{name}: {' '.join(sentence.split())}"
            rows[LONG] += [place] * (len(sentence.split()) > MOST_WORDS)
            for pattern, regex in PATTERNS.items():
                rows[pattern] += [place] * len(re.findall(regex, sentence))
    return rows


def _strings(source: str) -> str:
    """Return all strings of three words or more in a module, docstrings included."""
    nodes = ast.walk(ast.parse(source))
    strings = (node.value for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str))
    return "\n\n".join(text for text in strings if len(text.split()) >= 3)


def _prose(markdown: str) -> str:
    """Return a page's text without code and tables."""
    return re.sub(r"(?m)^\|.*$", "", re.sub(r"(?s)```.*?```", "", markdown))


def main() -> None:
    """Print the count of each pattern, or the sentences of one."""
    files = {
        path.relative_to(ROOT).as_posix(): path.read_text("utf-8")
        for path in (*sorted(ROOT.glob("unitcad/**/*.py")), *sorted(ROOT.glob("docs/**/*.md")), ROOT / "README.md")
    }
    rows = found(files)
    if len(sys.argv) > 1:
        print(*rows.get(sys.argv[1]) or [f"none; patterns: {', '.join(rows)}"], sep="\n")
    else:
        print(*(f"{len(places):6} {pattern}" for pattern, places in rows.items()), sep="\n")


if __name__ == "__main__":
    main()
