"""A report of the package's size by room and of its words: `python -m benchmarks.size [--against REF]`.

It is a report, not a law: it exits with 1 only if the package or its tests are 15 % above the sizes of the last
release, or for more imports inside functions than a command's own room, an optional extra and a lazy kernel need.
`--release NAME` takes the sizes of now as those of a release.

A token is a token of Python but for comments, docstrings, newlines and indents. The expressions in an f-string count as
code does, so that code which moves into a string is still counted.
"""

from __future__ import annotations

import argparse
import ast
import io
import os
import subprocess
import sys
import tarfile
import tokenize
import tomllib
from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path

from benchmarks import words

ROOT = Path(__file__).parents[1]
RELEASE = Path(__file__).with_name("release.toml")
"""Tokens of the last release."""
ROOMS = ("accuracy", "arrays", "bodies", "lab", "search", "serve", "sweeps")
SUMS = ("core", "total", "tests")
"""The core is the package without its rooms and without meshcheck."""
MOST_GROWTH = 1.15
"""Tokens of the package and of the tests over those of the last release, at most."""
MOST_INNER = 69
"""Imports inside functions, at most: a command's own room, an optional extra, a kernel that a build may not need."""
_LAYOUT = {
    getattr(tokenize, name)
    for name in (
        "COMMENT",
        "NL",
        "NEWLINE",
        "INDENT",
        "DEDENT",
        "ENCODING",
        "ENDMARKER",
        "FSTRING_MIDDLE",
        "FSTRING_END",
    )
    if hasattr(tokenize, name)
}
_IMPORTS = (ast.Import, ast.ImportFrom)
_START, _END = getattr(tokenize, "FSTRING_START", None), getattr(tokenize, "FSTRING_END", None)


def tokens(source: str) -> int:
    """Return the number of code tokens of a module; the same in every version of Python."""
    tree = ast.parse(source)
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    docstrings = {
        (node.body[0].lineno, node.body[0].col_offset)
        for node in ast.walk(tree)
        if isinstance(node, documented) and ast.get_docstring(node, clean=False) is not None
    }
    count, depth = 0, 0
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == _START:
            count, depth = count + (depth == 0), depth + 1
        elif token.type == _END:
            depth -= 1
        elif not depth and token.type not in _LAYOUT:
            count += token.type != tokenize.STRING or token.start not in docstrings
    for string in _f_strings(tree):
        for node in ast.walk(string):
            if isinstance(node, ast.FormattedValue):
                code = io.StringIO(ast.unparse(node.value))
                count += len(list(tokenize.generate_tokens(code.readline))) - 2
    return count


def _f_strings(node: ast.AST) -> list[ast.JoinedStr]:
    """Return the outermost f-strings below a node."""
    found: list[ast.JoinedStr] = []
    for child in ast.iter_child_nodes(node):
        found += [child] if isinstance(child, ast.JoinedStr) else _f_strings(child)
    return found


def sources(reference: str | None = None) -> dict[str, str]:
    """Return modules of package and tests and the pages by path: those of the checkout, or of a commit."""
    if reference is None:
        folders = ((ROOT / name).rglob("*") for name in ("unitcad", "tests", "docs"))
        paths = [path for folder in folders for path in sorted(folder)] + [ROOT / "README.md"]
        return {p.relative_to(ROOT).as_posix(): p.read_text("utf-8") for p in paths if p.suffix in (".py", ".md")}
    command = ["git", "archive", reference, "unitcad", "tests", "docs", "README.md"]
    archive = subprocess.run(command, cwd=ROOT, capture_output=True, check=True).stdout
    with tarfile.open(fileobj=io.BytesIO(archive)) as tar:
        members = [member for member in tar if member.isfile() and member.name.endswith((".py", ".md"))]
        return {member.name: tar.extractfile(member).read().decode() for member in members}  # type: ignore[union-attr]


def table(files: Mapping[str, str]) -> dict[str, list[int]]:
    """Return tokens, files and lines by room, of the core, of the whole package and of the tests."""
    rows: dict[str, list[int]] = defaultdict(lambda: [0, 0, 0])
    for name, source in files.items():
        if not name.endswith(".py") or not name.startswith(("unitcad/", "tests/")):
            continue
        top, *parts = name.split("/")
        room = parts[0] if len(parts) > 1 else "."
        sums = ("total",) if room in (*ROOMS, "meshcheck") else ("core", "total")
        size = tokens(source), 1, source.count("\n")
        for row in (room, *sums) if top == "unitcad" else ("tests",):
            rows[row] = [a + b for a, b in zip(rows[row], size, strict=True)]
    return dict(sorted(rows.items(), key=lambda row: (row[0] in SUMS, -row[1][0])))


def inner_imports(tree: ast.AST) -> int:
    """Return the number of import statements inside a module's functions."""
    functions = (node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef))
    inside = {id(node) for function in functions for node in ast.walk(function) if isinstance(node, _IMPORTS)}
    return len(inside)


def faults(rows: Mapping[str, list[int]], files: Mapping[str, str]) -> list[str]:
    """Return a sentence for each limit that is exceeded."""
    release = tomllib.loads(RELEASE.read_text("utf-8"))
    found = []
    for name in ("total", "tests"):
        if rows[name][0] > MOST_GROWTH * release[name]:
            growth = f"{rows[name][0] / release[name] - 1:.0%} above {release['release']}"
            found.append(f"{name}: {growth}, at most 15 %; a release sets the sizes: --release NAME")
    inner = sum(
        inner_imports(ast.parse(source))
        for name, source in files.items()
        if name.startswith("unitcad/") and name.endswith(".py")
    )
    if inner > MOST_INNER:
        found.append(f"{inner} imports inside functions, at most {MOST_INNER}")
    return found


def report(files: Mapping[str, str], rows: Mapping[str, list[int]], reference: str | None) -> tuple[str, str]:
    """Return the table in Markdown, with the changes since a commit, and a warning of worse words or ""."""
    older = sources(reference) if reference else {}
    before = table(older) if older else {}
    units = ("tokens", "files", "lines")
    head = [cell for unit in units for cell in ((unit, "change") if before else (unit,))]
    lines = [f"| {' | '.join(['', *head])} |", f"| --- |{' ---: |' * len(head)}"]
    for name in (*rows, *(name for name in before if name not in rows)):
        cells = []
        for now, was in zip(rows.get(name, [0, 0, 0]), before.get(name, [0, 0, 0]), strict=True):
            cells += [f"{now:,}", f"{now - was:+,}" if now != was else ""] if before else [f"{now:,}"]
        lines.append(f"| {' | '.join([name, *cells])} |")
    bad = sum(map(len, words.found(files).values()))
    worse = bad - sum(map(len, words.found(older).values())) if older else 0
    written = sum(len(text.split()) for name, text in words.texts(files) if name.endswith(".md"))
    change = f" ({worse:+})" if worse else ""
    lines += ["", f"Words: {written:,} in pages; {bad:,} long sentences and worst patterns{change}."]
    warning = f"{worse} more long sentences and worst patterns than {reference}: python -m benchmarks.words lists them"
    return "\n".join(lines), warning if worse > 0 else ""


def main() -> None:
    """Print the report and the faults; add the report to the summary of a GitHub job."""
    parser = argparse.ArgumentParser(description="Size of the package by room.")
    parser.add_argument("--against", metavar="REF", help="Commit to compare with, such as main.")
    parser.add_argument("--release", metavar="NAME", help="Write the sizes of now as those of a release.")
    asked = parser.parse_args()
    files = sources()
    rows = table(files)
    if asked.release:
        sizes = "".join(f"{name} = {rows[name][0]}\n" for name in ("total", "tests"))
        head = '# Tokens of the last release; "python -m benchmarks.size --release NAME" writes them.'
        RELEASE.write_text(f'{head}\nrelease = "{asked.release}"\n{sizes}', "utf-8")
    text, warning = report(files, rows, asked.against)
    print(text)
    in_job = os.environ.get("GITHUB_ACTIONS")
    if summary := os.environ.get("GITHUB_STEP_SUMMARY"):
        with open(summary, "a", encoding="utf-8") as file:
            file.write(f"## Size\n\n{text}\n")
    if warning:
        print(f"::warning::{warning}" if in_job else f"warning: {warning}")
    broken = faults(rows, files)
    for fault in broken:
        print(f"::error::{fault}" if in_job else fault, file=sys.stderr)
    sys.exit(bool(broken))


if __name__ == "__main__":
    main()
