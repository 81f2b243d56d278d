"""A journal that was damaged: what is left of it is true, and nothing ends in anything but one clear error."""

import json
import os
import random
import time

import pytest
from msgspec.structs import replace

from unitcad.errors import UnitcadError
from unitcad.sweeps.journal import JOURNAL, BatchHead, Journal, JournalEntry

HEAD = BatchHead(batch="0123456789abcdef", name="rings")
VARIANTS = 12


def _entry(index, tries=0):
    row = {"name": f"n{index}", "diameter_mm": 14.0 + index / 7, "mould_checks": tries}
    return JournalEntry(index=index, status="ok", values={"a": index}, row=row)


@pytest.fixture
def whole(tmp_path):
    """A journal of VARIANTS variants, some written twice, two equal to an earlier one."""
    journal = Journal(tmp_path / "whole", HEAD)
    for index in range(VARIANTS):
        journal.add(
            JournalEntry(index=index, same_as=index - 3, values={"a": -index}) if index in (5, 9) else _entry(index)
        )
        if index % 4 == 3:
            journal.add(_entry(index, 1))
    journal.close()
    return (tmp_path / "whole" / JOURNAL).read_bytes()


def _true(index):
    """What may be told of a variant."""
    if index in (5, 9):
        return [replace(_entry(index - 3), index=index, values={"a": -index})]
    return [_entry(index), _entry(index, 1)]


def _open(folder, content):
    """The entries of a journal of that content, opened twice; how many lines were left out."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / JOURNAL).write_bytes(content)
    journal = Journal(folder, HEAD)
    try:
        found, damaged = list(journal.entries()), journal.damaged
        journal.add(_entry(VARIANTS))
    finally:
        journal.close()
    again = Journal(folder, HEAD)
    seen = list(again.entries()), again.damaged
    again.close()
    assert seen == ([*found, _entry(VARIANTS)], 0)
    return found, damaged


def _flipped(content, dice):
    found = bytearray(content)
    for _ in range(dice.randint(1, 8)):
        found[dice.randrange(len(found))] ^= 1 << dice.randrange(8)
    return bytes(found)


def _lines(change):
    """Damage to the list of lines, given the place of one of them after the head."""

    def damaged(content, dice):
        lines = content.splitlines(keepends=True)
        change(lines, dice.randrange(1, len(lines)))
        return b"".join(lines)

    return damaged


def _swap(lines, at):
    lines[at], lines[1] = lines[1], lines[at]


def _glue(lines, at):
    lines[at] = lines[at].rstrip(b"\n")


def _change_a_value(lines, at):
    """A line that is still JSON and says something else."""
    lines[at] = lines[at].replace(b'"mould_checks": 0', b'"mould_checks": 7')


def _block(byte):
    def damaged(content, dice):
        start = dice.randrange(len(content))
        return content[:start] + byte * dice.randint(1, 600) + content[start + dice.randint(0, 600) :]

    return damaged


RANDOM = {
    "cut": lambda content, dice: content[: dice.randrange(len(content))],
    "flipped": _flipped,
    "zeros": _block(b"\0"),
    "junk": _block(b"x"),
    "newlines": _block(b"\n"),
    "line gone": _lines(lambda lines, at: lines.pop(at)),
    "line twice": _lines(lambda lines, at: lines.insert(1, lines[at])),
    "lines swapped": _lines(_swap),
    "lines glued": _lines(_glue),
    "value changed": _lines(_change_a_value),
    "head gone": lambda content, dice: content.partition(b"\n")[2],
}


def _hold_to_truth(folder, content):
    try:
        found, _ = _open(folder, content)
    except UnitcadError as error:
        assert "no journal of a batch" in str(error)
        assert (folder / JOURNAL).read_bytes() == content
        return
    for entry in found:
        assert entry in _true(entry.index), entry


@pytest.mark.parametrize("count", [4, pytest.param(1000, marks=pytest.mark.long)])
@pytest.mark.parametrize("kind", RANDOM)
def test_what_is_left_is_true(kind, count, whole, tmp_path):
    for seed in range(count):
        _hold_to_truth(tmp_path / f"{kind}{seed}", RANDOM[kind](whole, random.Random(f"{kind} {seed}")))


@pytest.mark.parametrize("every", [False, pytest.param(True, marks=pytest.mark.long)])
def test_what_stands_before_a_tear_is_there(every, whole, tmp_path):
    """Also where only the last line's end is missing."""
    first, *rest = whole.splitlines(keepends=True)
    head = len(first)
    ends = (0, 1, 30, head - 1, head, head + 1, head + 99, *range(len(whole) - 4, len(whole) + 1))
    for cut in range(len(whole) + 1) if every else ends:
        lines, complete, position = list(rest), [], head
        while lines and position + len(lines[0]) - 1 <= cut:
            complete.append(lines.pop(0))
            position += len(complete[-1])
        found, damaged = _open(tmp_path / str(cut), whole[:cut])
        assert {entry.index for entry in found} == {json.loads(line)["index"] for line in complete}
        assert damaged == (cut > position)


TEXTS = {
    "empty": b"",
    "newline": b"\n",
    "nonsense": b"nonsense\n",
    "a list": b"[]\n",
    "a number": b"5\n",
    "deep": b"[" * 100_000 + b"\n",
    "not UTF-8": b"\xff\xfe{}\n",
    "a name that is a list": b'{"batch": "0123456789abcdef", "name": []}\n',
    "an integer of 5,000 digits": b'{"batch": ' + b"9" * 5000 + b"}\n",
    "one line without end": b"x" * 3_000_000,
    "other keys": b'{"batch": 5}\n',
}
FORGED = {
    "a huge index": {"index": 10**12, "status": "ok"},
    "a negative index": {"index": -1, "status": "ok"},
    "no index": {"status": "ok"},
    "an index that is a word": {"index": "one", "status": "ok"},
    "no status": {"index": 3},
    "a row that is a list": {"index": 3, "status": "ok", "row": [], "values": {}},
    "equal to itself": {"index": 3, "same_as": 3, "values": {}},
    "equal to nobody": {"index": 3, "same_as": 10**9, "values": {}},
    "equal to a word": {"index": 3, "same_as": "one"},
    "a list": [],
    "a number": 5,
}


@pytest.mark.parametrize("kind", TEXTS)
def test_what_is_no_journal_is_refused_or_begun_anew(kind, tmp_path):
    _hold_to_truth(tmp_path / "out", TEXTS[kind])


@pytest.mark.parametrize("kind", FORGED)
def test_a_line_that_we_did_not_write_is_left_out(kind, whole, tmp_path):
    start = time.monotonic()
    found, damaged = _open(tmp_path / "out", whole + json.dumps(FORGED[kind]).encode() + b"\n")
    assert time.monotonic() - start < 5
    assert (len(found), damaged) == (VARIANTS, 1)


def test_lines_of_another_batch_are_left_out(whole, tmp_path):
    other = Journal(tmp_path / "other", replace(HEAD, batch="f" * 16))
    other.add(_entry(2, 7))
    other.close()
    foreign = (tmp_path / "other" / JOURNAL).read_bytes().splitlines(keepends=True)[1]
    found, damaged = _open(tmp_path / "out", whole + foreign)
    assert damaged == 1
    assert found[2] == _entry(2)


@pytest.mark.parametrize("kind", ["folder", "pipe", "link"])
def test_what_is_not_a_file_is_refused(kind, whole, tmp_path):
    out = tmp_path / "out"
    out.mkdir()
    (tmp_path / "elsewhere").write_bytes(whole)
    match kind:
        case "folder":
            (out / JOURNAL).mkdir()
        case "pipe":
            os.mkfifo(out / JOURNAL)
        case "link":
            (out / JOURNAL).symlink_to(tmp_path / "elsewhere")
    with pytest.raises(UnitcadError, match=JOURNAL):
        Journal(out, HEAD)
    assert (tmp_path / "elsewhere").read_bytes() == whole
