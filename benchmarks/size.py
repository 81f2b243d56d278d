"""The size of the package by room, against its limits: `python -m benchmarks.size` exits with 1 above one.

A token is a token of Python but for comments, docstrings, newlines and indents. The expressions in an f-string count as
code does, so that code which moves into a string is still counted.
"""

from __future__ import annotations

import ast
import io
import sys
import tokenize
from collections import defaultdict
from pathlib import Path

ROOT = Path(__file__).parents[1]
ROOMS = ("accuracy", "arrays", "lab", "search", "serve", "sweeps")
LIMITS = {
    "total": (433_900, 275, 54_600),
    "core": (224_100, 150, 29_200),
    "tests": (302_800, 0, 0),
}
"""Tokens, files and lines, at most; 0: no limit. The core is the package without its rooms and without meshcheck."""
MOST_FILES, LEAST_LINES, MOST_LINES = 45, 25, 900
"""Files of a room at most, and lines of a file that is no entry of a package."""
MOST_INNER = 60
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


def table() -> dict[str, list[int]]:
    """Return tokens, files and lines by room, of the core, of the whole package and of the tests."""
    rows: dict[str, list[int]] = defaultdict(lambda: [0, 0, 0])
    for path in sorted((ROOT / "unitcad").rglob("*.py")):
        parts, source = path.relative_to(ROOT / "unitcad").parts, path.read_text("utf-8")
        room = parts[0] if len(parts) > 1 else "."
        size = tokens(source), 1, source.count("\n")
        for name in (room, *(() if room in (*ROOMS, "meshcheck") else ("core",)), "total"):
            rows[name] = [a + b for a, b in zip(rows[name], size, strict=True)]
    for path in sorted((ROOT / "tests").rglob("*.py")):
        source = path.read_text("utf-8")
        rows["tests"] = [a + b for a, b in zip(rows["tests"], (tokens(source), 1, source.count("\n")), strict=True)]
    return rows


def faults(rows: dict[str, list[int]]) -> list[str]:
    """Return a sentence for each limit that is exceeded."""
    found = []
    for name, limits in LIMITS.items():
        for count, limit, unit in zip(rows[name], limits, ("tokens", "files", "lines"), strict=True):
            if limit and count > limit:
                found.append(f"{name}: {count} {unit}, at most {limit}")
    for name, (_, files, _) in rows.items():
        if name not in LIMITS and files > MOST_FILES:
            found.append(f"{name}: {files} files, at most {MOST_FILES}")
    inner = 0
    for path in sorted((ROOT / "unitcad").rglob("*.py")):
        source = path.read_text("utf-8")
        inner += inner_imports(ast.parse(source))
        lines, least = source.count("\n"), 0 if path.name.startswith("__") else LEAST_LINES
        if not least <= lines <= MOST_LINES:
            found.append(f"{path.relative_to(ROOT)}: {lines} lines; {LEAST_LINES} to {MOST_LINES}")
    if inner > MOST_INNER:
        found.append(f"{inner} imports inside functions, at most {MOST_INNER}")
    return found


def inner_imports(tree: ast.AST) -> int:
    """Return the number of import statements inside a module's functions."""
    functions = (node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef))
    inside = {id(node) for function in functions for node in ast.walk(function) if isinstance(node, _IMPORTS)}
    return len(inside)


def main() -> None:
    """Print the table and the faults."""
    rows = table()
    for name, (count, files, lines) in sorted(rows.items(), key=lambda row: (row[0] in LIMITS, -row[1][0])):
        print(f"{name:12} {count:8} tokens {files:5} files {lines:7} lines")
    broken = faults(rows)
    for fault in broken:
        print(fault, file=sys.stderr)
    sys.exit(bool(broken))


if __name__ == "__main__":
    main()
