"""Running suites, and keeping their results in accuracy.json, from which `pages` writes the pages."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Sequence
from dataclasses import replace
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

from benchmarks.accuracy import pages
from benchmarks.accuracy.result import Result, Say, from_dict
from unitcad import files
from unitcad.documents import read_json
from unitcad.errors import UnitcadError, unknown_name
from unitcad.extras import missing_extra

MODULES = {
    "tessellation": "tessellation",
    "kernels": "kernel_agreement",
    "moulds": "mould_margins",
    "hankel": "hankel",
    "stability": "stability",
    "models": "edge_levels",
    "fem": "unit_elements",
    "skin": "skin_curve",
    "design": "proposal_reliability",
    "extremes": "extremes",
    "left-out": "left_out",
    "measure": "measure",
    "speed": "speed",
}
"""Suites in the order of the pages, and the module of each, whose function `run(quick, say)` returns its result."""
SUITES = tuple(MODULES)

_REFERENCE = {"flint": "test", "mpmath": "test"}
_ELEMENTS = {"skfem": "fem", "threadpoolctl": "fem"}
NEEDS = {
    "hankel": {**_REFERENCE, "libdlf": "fem"},
    "stability": _REFERENCE,
    "models": _ELEMENTS,
    "fem": _ELEMENTS,
    "skin": _ELEMENTS,
}
"""What a suite imports beyond the core: each module, and the extra that installs it."""

JOURNALS = {"extremes": Path("out") / "extremes.jsonl", "stability": Path("out") / "stability.jsonl"}
"""What the long study of a suite has so far, from which it resumes."""


def chosen(names: Sequence[str]) -> tuple[str, ...]:
    """Return the suites called `names`, or all of them. Raises Refusal for an unknown one."""
    for name in names:
        if name not in SUITES:
            raise unknown_name("SUITE", name, SUITES)
    return tuple(name for name in SUITES if not names or name in names)


def check(name: str) -> None:
    """Check, before the work, that a suite's packages are installed. Raises Missing with all that are not."""
    lacking = {module: extra for module, extra in NEEDS.get(name, {}).items() if find_spec(module) is None}
    if lacking:
        extras = ",".join(sorted(set(lacking.values())))
        raise missing_extra(extras, f"the suite {name} needs {' and '.join(lacking)}")


def run(name: str, quick: bool, say: Say, count: int | None = None, seed: int = 0) -> Result:
    """Return one suite's result. Raises Missing without an extra or a folder that it needs.

    `count`: how many specs the extremes take, how many random media the stability; both keep a journal in out/ and
    resume from it. `seed`: of the media.
    """
    check(name)
    if count is not None and name == "extremes":
        from benchmarks.accuracy import extremes

        return replace(extremes.study(count, say, journal=JOURNALS[name]), options=f"--specs {count}")
    if count is not None and name == "stability":
        from benchmarks.accuracy import stability

        result = stability.study(count, say, seed, JOURNALS[name])
        return replace(result, options=f"--media {count} --seed {seed}")
    result = import_module(f"benchmarks.accuracy.{MODULES[name]}").run(quick, say)
    return replace(result, options="--quick" if quick else "")


def ready(folder: Path) -> list[Result]:
    """Check, before the work, that `folder` can take results, and return those in it.

    Raises UnitcadError for a folder that can't be written, or whose accuracy.json is not ours.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise UnitcadError(f"-o {folder}: is no folder that can be written ({error.strerror})") from None
    return read(folder)


def write(results: Sequence[Result], folder: Path) -> None:
    """Put results into a folder's accuracy.json beside those there, and write the pages and plots of all.

    Raises UnitcadError as `ready` does.
    """
    known = {result.suite: result for result in (*ready(folder), *results)}
    ordered = [known[name] for name in SUITES if name in known]
    text = json.dumps({"suites": [result.as_dict() for result in ordered]}, indent=1, allow_nan=False)
    files.write(folder / "accuracy.json", (text + "\n").encode())
    pages.write(ordered, folder)


def read(folder: Path) -> list[Result]:
    """Return the results in a folder's accuracy.json, none without the file. Raises UnitcadError if it holds others."""
    file = folder / "accuracy.json"
    try:
        return [from_dict(data) for data in read_json(file)["suites"]]
    except files.NotThere:
        return []
    except (UnitcadError, ValueError, KeyError, TypeError) as error:
        raise UnitcadError(f"{file}: is not a result of these suites ({error}); write elsewhere with -o") from None
