"""Messages between the page and the server: JSON of these types, unknown keys refused. Lengths in mm."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from msgspec import Meta, Struct

LARGEST_TEXT = 1_000_000
"""Characters of a spec that the page may send."""
Text = Annotated[str, Meta(max_length=LARGEST_TEXT)]
Path = Annotated[str, Meta(min_length=1, max_length=300)]
FileName = Annotated[str, Meta(pattern=r"^[A-Za-z0-9][A-Za-z0-9 ._-]{0,99}\.toml\Z")]
JobId = Annotated[str, Meta(pattern=r"^[0-9a-f]{16}\Z")]
What = Literal["unit", "moulds", "estimate"]


class Message(Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A message of the page."""


class Edit(Message, frozen=True, kw_only=True):
    """A change of the spec's text: the value at a dotted path, or `remove`: the key goes, and its default counts.

    `toml`: the value is a text in TOML syntax, such as [2, 3].
    """

    path: Path
    value: bool | int | float | str | list[Any] | dict[str, Any] | None = None
    remove: bool = False
    toml: bool = False

    def __post_init__(self) -> None:
        """Refuse a null, which TOML lacks; msgspec reports it as a fault of the message."""
        if not (self.remove and self.value is None) and _has_null(self.value):
            raise ValueError("an edit's value has no null")


def _has_null(value: Any) -> bool:
    inside = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    return value is None or any(map(_has_null, inside))


class Ask(Message, frozen=True, kw_only=True):
    """A question about a spec's text, after `edits`. `page` names the asker: its newer question drops an older one.

    `since` reverts the changes since the text was last accepted, newest first.
    """

    text: Text
    what: What = "unit"
    edits: Annotated[list[Edit], Meta(max_length=50)] = []
    since: Annotated[list[Edit], Meta(max_length=5)] = []
    page: Annotated[str, Meta(pattern=r"^[0-9a-z]{1,32}\Z")] = "0"


class Save(Message, frozen=True, kw_only=True):
    """A request to write the text as a file in the folder; `replace`: a file that is there.

    `known`: the SHA-256 of the file as the page opened or saved it; a file that is still the same is replaced too.
    """

    text: Text
    name: FileName
    replace: bool = False
    known: Annotated[str, Meta(pattern=r"^([0-9a-f]{64})?\Z")] = ""


class Build(Message, frozen=True, kw_only=True):
    """A request for the full build of the text."""

    text: Text


class Sweep(Message, frozen=True, kw_only=True):
    """A request for a batch: the values of one key from `low` to `high`, `count` of them; of a key of words `words`."""

    text: Text
    key: Path
    low: float = 0.0
    high: float = 0.0
    count: Annotated[int, Meta(ge=2, le=50)] = 2
    words: Annotated[list[Annotated[str, Meta(min_length=1, max_length=120)]], Meta(max_length=50)] = []


class Cancel(Message, frozen=True, kw_only=True):
    """A request that a job end."""

    job: JobId


class Fault(Struct, frozen=True, omit_defaults=True):
    """A value that is refused: the sentence, its field, a value that would be accepted, and its line in the text.

    `at` is the field whose change caused it, if that is another one, and `at_nearest` a value accepted there.
    `leave_out`: without the key, and without those of `together`, the text is accepted. `rename`: the right name of an
    unknown key, and its value.
    """

    message: str
    field: str = ""
    nearest: Any = None
    line: int | None = None
    at: str = ""
    at_nearest: float | str | None = None
    leave_out: bool = False
    together: list[str] = []
    rename: tuple[str, Any] | None = None


class Held(Struct, frozen=True):
    """The contents of a cupboard: names by kind, None without one; tables of its own entries by kind and name."""

    names: dict[str, list[str]] | None = None
    own: dict[str, dict[str, dict[str, Any]]] = {}


ALL = Held()
"""Without a cupboard: everything is offered."""


class Field(Struct, frozen=True, omit_defaults=True):
    """A control of the form.

    `value` is the current value, `given` tells whether the text has it, `required` whether it must. A number has its
    documented range from `low` to `high`. `choices` are words, each with its meaning; of kind `words` is a list of
    some of them.
    """

    path: str
    label: str
    kind: Literal["number", "integer", "word", "words", "text", "switch", "toml"]
    value: Any = None
    given: bool = False
    low: float | None = None
    high: float | None = None
    choices: list[tuple[str, str]] = []
    meaning: str = ""
    required: bool = False


class Group(Struct, frozen=True, omit_defaults=True):
    """A table of the form; `optional`: it may be added and removed; `present`: it is there.

    `needs` are its first values, `instead` the table that it replaces.
    """

    path: str
    title: str
    fields: list[Field]
    present: bool = True
    optional: bool = False
    needs: dict[str, Any] = {}
    instead: str = ""


class Answer(Struct, kw_only=True, omit_defaults=True):
    """An answer: the text after its edits, the faults, and the results if there is none.

    `processor_ms` is the time of the processor.
    `also`: the changes that a picked design needed, in words; `picked`: its field.
    `groups` are the form's; `spec` the resolved spec; `figures` are (name, value, unit), `drawings` (caption, SVG).
    """

    text: str
    faults: list[Fault] = []
    also: str = ""
    picked: str = ""
    groups: list[Group] = []
    spec: dict[str, Any] | None = None
    model: dict[str, Any] | None = None
    section: str | None = None
    figures: list[tuple[str, float, str]] = []
    lines: list[str] = []
    warnings: list[str] = []
    checks: list[dict[str, Any]] = []
    drawings: list[tuple[str, str]] = []
    estimate: dict[str, Any] | None = None
    layers: int = 0
    processor_ms: float = 0.0


class JobState(Struct, kw_only=True):
    """How far a job is: its stage, the lines it printed; once it has ended, its exit code, its folder and its page.

    `page` is a path below /files/, with the key of its folder.
    """

    job: str
    title: str
    lines: list[str]
    stage: str = ""
    ended: bool = False
    code: int | None = None
    folder: str | None = None
    page: str | None = None


class Source(Struct, frozen=True):
    """A spec's folder, and its values that name files, by their paths."""

    folder: str
    named: dict[str, str]


Trusted = list[Source]
"""Files that the page's texts may name: all those of one of these specs, and no other."""
