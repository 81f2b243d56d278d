"""The words of casting procedures: a TOML file a construction, read on first use. Code chooses sentences, gives facts."""

from __future__ import annotations

from functools import cache, partial
from importlib.resources import files

from unitcad.documents import parse_toml
from unitcad.errors import UnitcadError
from unitcad.text import some


@cache
def sentences(file: str) -> dict[str, str]:
    """Return the sentences of a file of the package as "step.sentence"; a line break is a space."""
    tables = parse_toml((files("unitcad") / file).read_text("utf-8"), file)
    return {f"{step}.{name}": " ".join(text.split()) for step, table in tables.items() for name, text in table.items()}


def written(file: str, *names: str, **facts: str | int) -> str:
    """Return the sentences of these names in a row, each {fact} in its place; "" names none.

    Raises UnitcadError for a sentence that the file lacks, and for a {fact} that the code does not give.
    """
    found = []
    for name in filter(None, names):
        if name not in sentences(file):
            raise UnitcadError(f"{file}: has no sentence {name}")
        try:
            found.append(sentences(file)[name].format_map(facts))
        except (LookupError, ValueError, AttributeError):
            given = some(f"{{{fact}}}" for fact in facts) if facts else "none"
            raise UnitcadError(f"{file}: {name}: a fact in braces is not known; facts of this step: {given}") from None
    return " ".join(found)


say = partial(written, "casting/procedure.toml")
"""Write sentences of a mould set on one flat base."""
