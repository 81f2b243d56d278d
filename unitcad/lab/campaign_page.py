"""The page of a campaign file, measured anew each time that it is loaded; or why it can't be measured."""

from __future__ import annotations

from html import escape
from pathlib import Path

import msgspec

from unitcad.errors import UnitcadError
from unitcad.lab.campaign import read_campaign
from unitcad.lab.measured_files import charts_of, fault_page, page
from unitcad.lab.measuring import measure


def measured(path: bytes) -> bytes:
    """Return {"page": HTML} of a campaign file, or {"refused": why}. Runs in a worker process."""

    file = Path(path.decode())
    try:
        result = measure(read_campaign(file), file.parent)
    except UnitcadError as error:
        return msgspec.json.encode({"refused": str(error)})
    lead = (
        f"<p>Measured from {escape(str(file))} as it is saved. Its recordings are files that it names by "
        f"patterns, so it has no form here: change the file in an editor, then {_AGAIN}.</p>"
    )
    return msgspec.json.encode({"page": page(result, charts_of(result), lead)})


def refused(file: Path, why: str) -> str:
    """Return the page that says why a campaign file can't be measured, as HTML."""
    folder, named = escape(str(file.parent)), escape(file.name)
    lead = f"<p>The file is {named} in {folder}, with its recordings. Change it, then {_AGAIN}.</p>"
    return fault_page(file.name, why, lead)


_AGAIN = '<a href="/">measure again</a>'
