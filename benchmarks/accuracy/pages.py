"""The front page, accuracy.md, and beside it a folder with a page and the plots of every suite."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from benchmarks.accuracy.plot import svg
from benchmarks.accuracy.result import Result, Table, kept, markdown, table_lines
from unitcad import files

FOLDER = "accuracy"
PICTURES = ("tessellation", "hankel", "stability", "models")
"""Suites whose plot the front page shows. The others' plots are on their own pages."""
HEAD = """# Accuracy

Errors against exact or independent references, beside what they cost. In a clone, `python -m benchmarks.accuracy`
computes all of it and writes these pages; `accuracy.json` holds the same numbers. Run times are medians, taken in turn
in one run: compare them within a table only, since seconds differ between machines. A star in a table marks the
frontier: nothing in it is both faster and more exact. A plus after a commit: the code that ran had changes that this
commit does not hold.

`unitcad accuracy SPEC` measures error, bound and run time for one spec: its meshes at five tolerances, the response of
the body at five rtols, the inputs that move the results most, and the time that a build saves by what it leaves out.
Without SPEC it checks the bounds of random media and builds random specs.
"""


def write(results: Sequence[Result], folder: Path) -> None:
    """Write accuracy.md, and the page and plots of every result into accuracy/; older plots of these suites go."""
    inside = folder / FOLDER
    inside.mkdir(parents=True, exist_ok=True)
    for result in results:
        names = _plots(result)
        for name, plot in zip(names, result.plots, strict=True):
            files.write(inside / name, svg(plot).encode())
        files.write(inside / f"{result.suite}.md", markdown(result, names).encode())
        for old in set(inside.glob(f"{result.suite}-[0-9]*.svg")) - {inside / name for name in names}:
            old.unlink()
    files.write(folder / "accuracy.md", front(results).encode())


def front(results: Sequence[Result]) -> str:
    """Return the front page: what to pick, the plots of `PICTURES`, and a line on every suite."""
    lines = [HEAD]
    picks = tuple(pick for result in results for pick in result.summary.picks)
    if picks:
        lines += ["## What to pick", "", *table_lines(Table("", ("for", "error", "pick"), picks)), ""]
    drawn = [_drawn(result) for result in results if result.suite in PICTURES and result.summary.plot is not None]
    if drawn:
        cells = [*drawn, *[""] * (len(drawn) % 2)]
        rows = [f"| {left} | {right} |" for left, right in zip(cells[::2], cells[1::2], strict=True)]
        lines += ["## In pictures", "", rows[0], "| --- | --- |", *rows[1:], ""]
    suites = tuple(
        (f"[{r.title}]({FOLDER}/{r.suite}.md)", r.summary.worst or None, _promised(r), _when(r)) for r in results
    )
    lines += ["## Every suite", ""]
    lines += [*table_lines(Table("", ("page", "worst case", "promises", "measured"), suites)), ""]
    return "\n".join(lines)


def _plots(result: Result) -> list[str]:
    return [f"{result.suite}-{i + 1}.svg" for i in range(len(result.plots))]


def _drawn(result: Result) -> str:
    number = result.summary.plot or 0
    title = result.plots[number].title
    return f"[![{title}]({FOLDER}/{_plots(result)[number]})]({FOLDER}/{result.suite}.md)"


def _promised(result: Result) -> str | None:
    """Say how many promises are kept."""
    return kept(result.promises).partition(";")[0] if result.promises else None


def _when(result: Result) -> str:
    """Return date and commit of the measurement."""
    return ", ".join(str(result.measured[name]) for name in ("date", "commit") if name in result.measured)
