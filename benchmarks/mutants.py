"""Share of planted faults that the tests notice: `python -m benchmarks.mutants [--count N] [--seed S] [--room ROOM]`.

A fault is one small change of a line in a room that judges or draws: a comparison that takes its limit or not, a number
more or less, a sign, an "and" for an "or". The study works in a copy of the repository. Coverage tells the tests that run
a line; a mutant is killed if one of them fails. A line that no test runs counts as a survivor. The tests of a room run
once with coverage, in one process, which takes most of half an hour; each mutant then some seconds to minutes.

Needs `pip install cosmic-ray coverage`, which CI installs each night.
"""

from __future__ import annotations

import argparse
import json
import linecache
import math
import os
import random
import re
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from datetime import date
from itertools import islice
from pathlib import Path

ROOT = Path(__file__).parents[1]
ROOMS = {
    "checks": ("tests/moulds",),
    "moulds": ("tests/moulds",),
    "spec": (
        "tests/test_spec.py",
        "tests/test_spec_keys.py",
        "tests/whole/test_mistakes.py",
        "tests/test_body_files.py",
    ),
    "validation": ("tests/test_spec.py", "tests/whole/test_mistakes.py", "tests/test_designs.py", "tests/moulds"),
}
"""Folders of the package, and the tests that are theirs."""
LOADED = (
    "tests/test_spec.py",
    "tests/test_spec_keys.py",
    "tests/whole/test_mistakes.py",
    "tests/whole/test_reference.py",
    "tests/whole/test_inventory.py",
)
"""Tests of the keys of a spec: their ranges are read when a module loads."""
LEAST = 0.85
"""Share killed that the study asks for."""
MOST_TESTS = 40
"""Test functions tried against a mutant, those that run the fewest lines first."""
LIMIT_S = 300.0
"""Seconds of a mutant's tests; one that takes longer hangs, and is killed."""
_COMPARED = ("Lt_LtE", "LtE_Lt", "Gt_GtE", "GtE_Gt", "Eq_NotEq", "NotEq_Eq")
_BINARY = ("Add_Sub", "Sub_Add", "Mul_Div", "Div_Mul")
OPERATORS = (
    *(f"core/ReplaceComparisonOperator_{name}" for name in _COMPARED),
    *(f"core/ReplaceBinaryOperator_{name}" for name in _BINARY),
    *("core/AddNot", "core/ReplaceAndWithOr", "core/ReplaceOrWithAnd", "core/NumberReplacer"),
    *("core/ReplaceTrueWithFalse", "core/ReplaceFalseWithTrue", "core/ReplaceUnaryOperator_Delete_USub"),
)


@dataclass(frozen=True)
class Mutant:
    """A changed line of a file: its number from 1, the line before and after, and whether a test noticed."""

    file: str
    line: int
    before: str
    after: str
    killed: bool = False
    why: str = ""


def places(source: str) -> list[tuple[str, int]]:
    """Return the operators that change something in a module, each with the numbers of its places from 0."""
    from cosmic_ray.ast import ast_nodes, get_ast
    from cosmic_ray.plugins import get_operator

    nodes = list(ast_nodes(get_ast(source)))
    counts = {name: sum(len(list(get_operator(name)().mutation_positions(one))) for one in nodes) for name in OPERATORS}
    return [(name, number) for name, count in counts.items() for number in range(count)]


def mutant_of(source: str, file: str, operator: str, number: int) -> tuple[Mutant, str] | None:
    """Return the mutant at one place with the module's text; None if it changes no line, or several."""
    from cosmic_ray.mutating import mutate_code
    from cosmic_ray.plugins import get_operator

    new = mutate_code(source, get_operator(operator)(), number) or source
    old, lines = source.splitlines(), new.splitlines()
    changed = [i for i, pair in enumerate(zip(old, lines, strict=False)) if pair[0] != pair[1]]
    if len(lines) != len(old) or len(changed) != 1:
        return None
    i = changed[0]
    return Mutant(file, i + 1, old[i].strip(), lines[i].strip()), new


def tests_by_line(copy: Path, tests: Sequence[str]) -> dict[tuple[str, int], set[str]]:
    """Return, for each line of the package, the test functions that run it."""
    settings = copy / ".mutants.coveragerc"
    settings.write_text("[run]\ndynamic_context = test_function\nsource = unitcad\nrelative_files = true\n")
    env = _env(copy) | {"COVERAGE_FILE": str(copy / ".coverage")}
    run = [sys.executable, "-m", "coverage", "run", f"--rcfile={settings}", "-m", "pytest", *tests]
    subprocess.run(run, cwd=copy, env=env, check=False, stdout=subprocess.DEVNULL)
    from coverage import CoverageData

    data = CoverageData(str(copy / ".coverage"))
    data.read()
    return {
        (file, line): set(filter(None, contexts))
        for file in data.measured_files()
        for line, contexts in data.contexts_by_lineno(file).items()
    }


def tests_of(mutant: Mutant, running: dict[tuple[str, int], set[str]], copy: Path) -> list[str]:
    """Return the tests to try, those that run the fewest lines first.

    A line that runs when its module loads is judged by the tests of the lines that use its name, a spec's by `LOADED`.
    """
    found = running.get((mutant.file, mutant.line), set())
    if not found and mutant.file.startswith("unitcad/spec/") and mutant.before[:1].isalpha():
        return [*LOADED]
    if not found and (name := re.match(r"(\w+)\b.*=", mutant.before)):
        for file, line in running:
            if re.search(rf"\b{name[1]}\b", linecache.getline(str(copy / file), line)):
                found = found | running[file, line]
    lines = Counter(name for names in running.values() for name in names if name in found)
    return sorted(found, key=lambda name: (lines[name], name))


def _node(copy: Path, context: str) -> str:
    """Return pytest's name of a file, or of a test function from coverage's, such as test_skin.test_a_film."""
    if context in LOADED:
        return context
    module, _, function = context.rpartition(".")
    (file,) = (copy / "tests").rglob(f"{module.rpartition('.')[2]}.py")
    if f"def {function}(" not in file.read_text():  # pytest ends with an error for it, as for a mutant
        raise LookupError(f"{file} has no {function}")
    return f"{file.relative_to(copy).as_posix()}::{function}"


def _env(copy: Path) -> dict[str, str]:
    return os.environ | {"PYTHONPATH": str(copy), "PYTHONDONTWRITEBYTECODE": "1"}


def judged(copy: Path, mutant: Mutant, text: str, tests: Sequence[str]) -> Mutant:
    """Return a mutant with the verdict of the tests that run its line."""
    if not tests:
        return replace(mutant, why="no test runs the line")
    path = copy / mutant.file
    before = path.read_text()
    path.write_text(text)
    try:
        run = [
            sys.executable,
            "-m",
            "pytest",
            "-x",
            "-q",
            "-p",
            "no:cacheprovider",
            *(_node(copy, each) for each in tests[:MOST_TESTS]),
        ]
        code = subprocess.run(
            run, cwd=copy, env=_env(copy), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=LIMIT_S
        ).returncode
        why = {0: "no test noticed", 1: "a test failed"}.get(code, "it does not load")
        return replace(mutant, killed=code != 0, why=why)
    except subprocess.TimeoutExpired:
        return replace(mutant, killed=True, why="it hangs")
    finally:
        path.write_text(before)


def ends(killed: int, count: int) -> tuple[float, float]:
    """Return the 95 % range of a share by Wilson's score."""
    z, share = 1.96, killed / count
    middle, half = share + z**2 / (2 * count), z * math.sqrt(share * (1 - share) / count + z**2 / (4 * count**2))
    return (middle - half) / (1 + z**2 / count), (middle + half) / (1 + z**2 / count)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the study and write its report; 1 if the share killed is below `LEAST`, by more than chance."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.mutants", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--count", type=int, default=60, metavar="N", help="mutants to try (default: 60)")
    parser.add_argument("--seed", type=int, default=date.today().toordinal(), metavar="S", help="draw (default: today)")
    parser.add_argument("--room", choices=ROOMS, action="append", help="only this folder of the package; repeatable")
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "mutants.json", metavar="FILE", help="report")
    asked = parser.parse_args(arguments)
    rooms = asked.room or list(ROOMS)
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "unitcad"
        subprocess.run(["git", "clone", "-q", str(ROOT), str(copy)], check=True)
        print(f"coverage of {', '.join(rooms)}", flush=True)
        tests = sorted({test for room in rooms for test in ROOMS[room]})
        running = tests_by_line(copy, tests)
        files = [path for room in rooms for path in sorted((copy / "unitcad" / room).glob("*.py"))]
        every = [(path, *place) for path in files for place in places(path.read_text())]
        random.Random(asked.seed).shuffle(every)
        drawn = (
            mutant_of(path.read_text(), path.relative_to(copy).as_posix(), operator, number)
            for path, operator, number in every
        )
        done = list[Mutant]()
        for mutant, text in islice(filter(None, drawn), asked.count):
            done.append(judged(copy, mutant, text, tests_of(mutant, running, copy)))
            print(f"{len(done)} of {asked.count}: {_line(done[-1])}", flush=True)
    killed = sum(one.killed for one in done)
    low, high = ends(killed, len(done))
    share = killed / len(done)
    report = {
        "rooms": rooms, "seed": asked.seed, "possible": len(every), "tried": len(done), "killed": killed,
        "share": round(share, 3), "range_95": [round(low, 3), round(high, 3)], "least": LEAST,
        "survivors": [asdict(one) for one in done if not one.killed],
    }  # fmt: skip
    asked.out.parent.mkdir(parents=True, exist_ok=True)
    asked.out.write_text(json.dumps(report, indent=2) + "\n")
    text = f"{killed} of {len(done)} mutants killed: {share:.0%} ({low:.0%} to {high:.0%}); asked: {LEAST:.0%}"
    print(text)
    if summary := os.environ.get("GITHUB_STEP_SUMMARY"):
        rows = "".join(f"- `{_line(one)}`\n" for one in done if not one.killed)
        with Path(summary).open("a") as page:
            page.write(f"{text}\n\n{rows}")
    return int(high < LEAST)


def _line(one: Mutant) -> str:
    return f"{'killed' if one.killed else 'SURVIVED'} {one.file}:{one.line}: {one.before} -> {one.after} ({one.why})"


if __name__ == "__main__":
    sys.exit(main())
