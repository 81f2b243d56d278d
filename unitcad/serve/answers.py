"""Answers to the page about a text: of a unit's spec or of an array.

Runs in a worker process, which a hang or a crash ends. A text from the page is data: its files are read and its code is
run only if the spec that the server was started with names the same.
"""

from __future__ import annotations

import re
import time
from collections.abc import Mapping
from importlib import import_module
from typing import Any, cast

import msgspec
from msgspec.structs import replace

from unitcad.documents import parse_toml
from unitcad.errors import NEAREST, UNIT_ALONE, Refusal, UnitcadError, UnknownKey
from unitcad.json_text import parse_message
from unitcad.serve import unit_answers
from unitcad.serve.cupboard_choices import offered, with_entries
from unitcad.serve.form import edited
from unitcad.serve.messages import ALL, Answer, Ask, Edit, Fault, Held, Trusted
from unitcad.serve.remedies import add_remedies, changes_of_pick, in_words
from unitcad.validation import compound_kind


def respond(message: bytes, trusted: bytes, held: bytes = b"{}") -> bytes:
    """Return the answer to an `Ask`, both as JSON; `trusted` is a `Trusted` as JSON, `held` a `Held`."""
    begun = time.process_time()
    ask = parse_message(message, Ask)
    answer = answered(ask, parse_message(trusted, Trusted), parse_message(held, Held))
    answer.processor_ms = round(1e3 * (time.process_time() - begun), 1)
    return msgspec.json.encode(answer)


def answered(ask: Ask, trusted: Trusted, held: Held = ALL) -> Answer:
    """Return the answer to a question. A fault of the text or of a value is in it; nothing is raised for one."""
    try:
        return _answered(ask, trusted, held)
    except RecursionError:
        return Answer(text=ask.text, faults=[Fault("the text: nests too deeply")])


def _answered(ask: Ask, trusted: Trusted, held: Held) -> Answer:
    try:
        text = edited(ask.text, ask.edits)
    except UnitcadError as error:
        return Answer(text=ask.text, faults=[_fault(error)])
    try:
        data = parse_toml(text, "the text")
        if not compound_kind(data):
            text = with_entries(text, data, held)
            data = parse_toml(text, "the text")
    except UnitcadError as error:
        place = re.match(r"the text:(\d+):", str(error))  # the line that tomllib's message names
        fault = _fault(error)
        return Answer(text=text, faults=[replace(fault, line=int(place[1])) if place else fault])
    answer = Answer(text=text, layers=len(data["layers"]) if isinstance(data.get("layers"), list) else 0)
    kind = answers_about(data)
    subject: Any = None
    whole: dict[str, Any] | None = None
    try:
        whole = kind.with_files(data, trusted)
        subject = kind.settled(data, trusted)
        kind.ANSWERS[ask.what](subject, answer)
    except Refusal as error:
        answer.faults = [_fault(error)]
        if whole is not None and subject is None and (along := _with_pick(ask, kind, whole, trusted, held)):
            return along
        if whole is not None and subject is None:
            every = [_fault(one) for one in kind.faults_of(error, whole, text)]
            answer.faults = add_remedies(every, whole, ask.since, kind.judge, kind.makeable)
        elif whole is not None and ask.what == "moulds":
            answer.faults = add_remedies([_fault(error)], whole, ask.since, kind.makeable, kind.makeable)
    except UnitcadError as error:
        answer.faults = [_fault(error)]
    if ask.what == "unit":
        answer.groups = offered(kind.form(data, subject), held, unit=kind is unit_answers)
        answer.spec = kind.as_data(subject) if subject else None
    return answer


def _with_pick(ask: Ask, kind: Any, whole: dict[str, Any], trusted: Trusted, held: Held) -> Answer | None:
    """Return the answer to an ask whose picked design needs other changes, with them; None if none are found."""
    picked = next((edit for edit in reversed(ask.edits) if edit.path in kind.PICKED and not edit.remove), None)
    if picked is None:
        return None
    try:
        before = parse_toml(edited(ask.text, [edit for edit in ask.edits if edit != picked]), "the text")
        sound = kind.sound_with(whole, answers_about(before).settled(before, trusted))
    except UnitcadError:  # refused before
        return None
    changes = changes_of_pick(picked.path, whole, kind.judge, kind.makeable, sound)
    edits = [Edit(path=path, value=cast(Any, value), remove=value is None) for path, value in changes.items()]
    if not edits:
        return None
    answer = _answered(replace(ask, edits=[*ask.edits, *edits]), trusted, held)
    return None if answer.faults else replace(answer, also=in_words(changes), picked=picked.path)


def answers_about(data: Mapping[str, Any]) -> Any:
    """Return the module that answers about plain data: the unit's, or that of the room whose file it is."""
    kind = compound_kind(data)
    return import_module(kind.page) if kind else unit_answers


def resolve(text: bytes, trusted: bytes) -> bytes:
    """Return {"text": the resolved spec as TOML, "asked", "code"} of a text, or {"refused": why}.

    `asked` has only the keys of the text, so that defaults follow other values; `code`: whether it has code. Both
    include the texts of the files that the text may name, and no other code.
    """
    try:
        data = parse_toml(text.decode(), "the text")
        kind = answers_about(data)
        known = parse_message(trusted, Trusted)
        subject: Any = kind.settled(data, known)
        asked, code = kind.asked_toml(text.decode(), data, subject, known), kind.has_code(subject)
    except UnitcadError as error:
        return msgspec.json.encode({"refused": str(error)})
    return msgspec.json.encode({"text": kind.as_toml(subject), "asked": asked, "code": code})


def _fault(error: UnitcadError) -> Fault:
    message = str(error).replace(UNIT_ALONE, "")  # the page shows only the unit, and has no options
    if isinstance(error, Refusal):
        given = error.as_dict()
        if isinstance(error, UnknownKey):
            # The nearest value is a key's name; `remedied` tells whether the text is accepted with it.
            rename = (str(error.nearest), given["value"]) if error.nearest else None
            return Fault(message.partition(NEAREST)[0], error.field, line=error.line, rename=rename)
        return Fault(message, error.field, given["nearest"], error.line)
    return Fault(message)
