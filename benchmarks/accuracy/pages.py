"""The front page, accuracy.md, and a folder with a page and the plots of every suite."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from benchmarks.accuracy.answers import answer, question
from benchmarks.accuracy.plot import svg
from benchmarks.accuracy.result import Result, Table, kept, measured_on, table_lines
from unitcad import files

FOLDER = "accuracy"
HEAD = """# Accuracy

Each suite answers one question with one number, against exact or independent references. In a clone,
`python -m benchmarks.accuracy` runs them and writes these pages and `accuracy.json`. Run times are medians of one run:
compare them within a table only. `unitcad accuracy SPEC` measures errors, bounds and times for your own spec.
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
    """Return the front page: a line for every suite."""
    rows = tuple(
        (
            f"[{question(result)}]({FOLDER}/{result.suite}.md)",
            answer(result) or None,
            _promised(result),
            result.measured.get("date"),
        )
        for result in results
    )
    return "\n".join([HEAD, *table_lines(Table("", ("question", "answer", "promises", "measured"), rows)), ""])


def markdown(result: Result, picture: Sequence[str] | None = None) -> str:
    """Return the suite's page; `picture[i]` is the file of plot i, None links no pictures.

    Question, answer, one plot and one table are shown; method, promises, other plots and tables are folded.
    """
    command = f"python -m benchmarks.accuracy {result.suite} {result.options}".strip()
    lines = [f"# {result.title}", "", f"**{question(result)}** {answer(result)}".rstrip(), ""]
    broken = tuple((p.what, p.value, p.limit) for p in result.promises if not p.ok)
    if broken:
        lines += ["**Broken promises**", "", *table_lines(Table("", ("promise", "value", "limit"), broken)), ""]
    plots = list(zip(result.plots, picture, strict=True)) if picture is not None else []
    first = result.summary.plot or 0
    lines += [line for plot, file in plots[first : first + 1] for line in (f"![{plot.title}]({file})", "")]
    picks = [Table("Choices", ("task", "error", "choice"), result.summary.picks)] if result.summary.picks else []
    tables = [*picks, *result.tables]
    lines += [line for table in tables[:1] for line in _titled(table)]
    lines += ['<details markdown="1">', "<summary>Method, promises and all tables</summary>", "", result.text, ""]
    lines += [f"`{command}`; measured on: {measured_on(result)}.", ""]
    if result.promises:
        lines += [f"{kept(result.promises)}.", ""]
    for plot, file in (*plots[:first], *plots[first + 1 :]):
        lines += [f"![{plot.title}]({file})", ""]
    lines += [line for table in tables[1:] for line in _titled(table)]
    return "\n".join([*lines, "</details>", ""])


def _titled(table: Table) -> list[str]:
    return [f"**{table.title}**", "", *table_lines(table), "", *([table.note, ""] if table.note else [])]


def _plots(result: Result) -> list[str]:
    return [f"{result.suite}-{i + 1}.svg" for i in range(len(result.plots))]


def _promised(result: Result) -> str | None:
    """Return the number of promises, and of broken ones."""
    return kept(result.promises).partition(";")[0] if result.promises else None
