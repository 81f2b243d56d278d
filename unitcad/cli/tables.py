"""Tables and spinners on the terminal. They load rich, which no other output needs."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Mapping, Sequence

from rich.console import Console
from rich.table import Column, Table
from rich.text import Text

_NO_TERMINAL = 10_000
"""Characters in a line of a file or pipe."""


def console(stderr: bool = False) -> Console:
    """Return a rich console. Text is shown as it is: a name may hold square brackets, or colons that spell an emoji.

    Only a terminal's width crops a table.
    """
    made = Console(markup=False, emoji=False, highlight=False, stderr=stderr)
    if not made.is_terminal:
        made.width = _NO_TERMINAL
    return made


def print_table(rows: Sequence[Mapping[str, str]], title: str = "", stderr: bool = False) -> None:
    """Print a row a line, on standard output or error; the keys of a row are the heads of the columns."""
    if rows:
        table = Table(*(Column(head, no_wrap=i == 0) for i, head in enumerate(rows[0])), title=title or None)
        for row in rows:
            table.add_row(*row.values())
        console(stderr).print(table)


@contextlib.contextmanager
def spinner(name: str) -> Iterator[Callable[[str], None]]:
    """Show a spinner with the stage; yield the function that sets the stage."""
    # As Text: a spinner reads markup whatever its console's setting.
    with console(stderr=True).status(Text(name)) as status:
        yield lambda stage: status.update(Text(f"{name}: {stage}"))
