"""Changes of a spec that a call or a command asks for, by dotted path."""

# pyright: strict
from __future__ import annotations

import os
from collections.abc import Sequence

from unitcad.arguments import path, texts
from unitcad.errors import WrongArgument, unknown_name
from unitcad.spec.raw import FORMATS
from unitcad.validation import Changes
from unitcad.validation.plain_data import changes_of


def all_changes(
    set: Changes = (),
    *,
    formats: Sequence[str] | str | None = None,
    fit: str | os.PathLike[str] | None = None,
) -> dict[str, object]:
    """Return the changes of `set`, with formats and the file of a lab's fit. Raises Refusal for an unknown format."""
    changes: dict[str, object] = dict(changes_of(set))
    if fit is not None:
        changes["estimate.fit"] = path("fit", fit)
    if formats is not None:
        names = texts("formats", formats)
        for name in names:
            if name not in FORMATS:
                raise unknown_name("formats", name, FORMATS, WrongArgument)
        changes["output.formats"] = names
    return changes
