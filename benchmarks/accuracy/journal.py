"""A journal of a long study, from which it resumes."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, TypeVar

from unitcad.errors import UnitcadError
from unitcad.pipeline.plan import code_version

J = TypeVar("J")


def journalled(jobs: Sequence[J], compute: Callable[[Sequence[J]], Iterator[Any]], journal: Path) -> Iterator[Any]:
    """Yield what `compute` yields for the jobs, all JSON-ready, each a line of `journal` as soon as it is there.

    What this code wrote into the journal before is read from there. Raises UnitcadError for a file that is no journal.
    """
    names = [hashlib.sha256(f"{code_version()} {json.dumps(job)}".encode()).hexdigest()[:16] for job in jobs]
    known: dict[str, Any] = {}
    if journal.exists():
        # A last line without its end was cut off by the interruption.
        whole, end, cut = journal.read_bytes().rpartition(b"\n")
        for line in whole.splitlines():
            try:
                name, data = json.loads(line)
            except (ValueError, TypeError):
                raise UnitcadError(f"{journal}: is not a journal of this study; move it away") from None
            known[name] = data
        if cut:
            os.truncate(journal, len(whole + end))
    journal.parent.mkdir(parents=True, exist_ok=True)
    fresh = compute([job for job, name in zip(jobs, names, strict=True) if name not in known])
    with journal.open("ab") as file:
        for name in names:
            if name not in known:
                known[name] = next(fresh)
                file.write(json.dumps([name, known[name]]).encode() + b"\n")
                file.flush()
            yield known[name]
