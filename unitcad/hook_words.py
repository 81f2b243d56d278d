"""The words of a hook runner: options of its configuration, then names of files, which may look like options."""

from __future__ import annotations

import os
from collections.abc import Collection

HOOK = "--hook"
"""The option of commands that a hook runner calls."""


def options_ended(words: list[str], valued: Collection[str]) -> list[str]:
    """Return a hook's words with "--" before the first file name.

    A hook runner appends names to the options of its configuration. A word that begins with "-" is a name if there is
    such a file. `valued`: the options whose next word is their value.
    """
    first = 0
    while first < len(words) and words[first].startswith("-") and not os.path.isfile(words[first]):
        first += 2 if words[first] in valued else 1
    return words if "--" in words[:first] else [*words[:first], "--", *words[first:]]
