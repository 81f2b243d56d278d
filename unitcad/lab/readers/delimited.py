"""Text of numbers in columns: the longest run of lines with the same count of numeric fields is the data.

Whatever would have to be guessed is refused: a line of another width among the numbers, two delimiters that both fit.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from unitcad import files
from unitcad.geometry.arrays import Floats
from unitcad.lab.quantities import known
from unitcad.lab.readers.recording_layout import Layout
from unitcad.lab.recording import Channel, Recording, Unreadable, in_blocks, is_time

ENDINGS = (".csv", ".txt", ".tsv", ".asc", ".dat", ".lvm", ".tab")
HEAD = 1_000_000
"""Bytes from a file's beginning in which its header ends."""
PIECE = 4_000_000
"""Bytes that are read at a time."""
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|[nN][aA][nN]", re.ASCII)
_DIALECTS = (("\t", "."), (";", "."), (",", "."), (" ", "."), ("\t", ","), (";", ","), (" ", ","), (",", ","))
"""Delimiter and decimal sign; the same sign for both only where quotes tell them apart."""
_MAYBE_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2}(?:,\d{3})+", re.ASCII)
_UNIT_ALONE = re.compile(r"[\[(][^\[\]()]*[\])]")
_NAMED_UNIT = re.compile(r"(.*?)\s*[\[(]([^\[\]()]*)[\])]\s*")


@dataclass(frozen=True)
class Block:
    """Where the numbers are: the first line, counted from 0, the count of lines in the head, and of columns."""

    delimiter: str
    decimal: str
    start: int
    lines: int
    width: int

    def fields(self, line: str) -> list[str] | None:
        """Return a line's fields with a point for the decimal sign; None where one of them is no number."""
        fields = _split(line, self.delimiter, self.decimal)
        return fields if fields and all(map(_NUMBER.fullmatch, fields)) else None


def read(path: Path, layout: Layout) -> Recording:
    """Return the recording of a text file. Raises Unreadable where it has no block of numbers, or an ambiguous one."""
    with open(path, "rb", opener=files.regular()) as file:
        head = file.read(HEAD + 1)
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise Unreadable(str(path), None, "is UTF-16; save it as UTF-8")
    if b"\0" in head:
        raise Unreadable(str(path), None, "holds zero bytes: it is no text")
    text = head.removeprefix(b"\xef\xbb\xbf")
    try:
        text.decode("utf-8")
        encoding = "utf-8"
    except UnicodeDecodeError as error:
        encoding = "utf-8" if error.start > len(text) - 4 else "latin-1"
    lines = _lines(text.decode(encoding, "replace"))
    if len(head) > HEAD:
        lines.pop()
    block = _block(path, lines, layout)
    _refuse_broken(path, lines, block, layout.skip_lines)
    header = lines[layout.skip_lines : block.start] or lines[: block.start]
    channels, step = _channels(header, block)
    time = next((i for i, c in enumerate(channels) if is_time(c.name, c.unit)), None)

    def blocks(indices: tuple[int, ...]) -> Iterator[Floats]:
        for rows in _rows(path, block, encoding):
            yield from in_blocks(rows[:, list(indices)])

    return Recording(path, "text", tuple(Channel(c.name, c.unit, step) for c in channels), blocks, time)


def _lines(text: str) -> list[str]:
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def _split(line: str, delimiter: str, decimal: str) -> list[str]:
    """Return the fields of a line; one delimiter at its end separates nothing. Quotes stay where one is not closed."""
    if delimiter == " ":
        fields = [field[1:-1] if _enclosed(field) else field for field in line.split()]
    else:
        line = line.strip(" ").removesuffix(delimiter)
        fields = (_quoted(line, delimiter) if '"' in line else None) or line.split(delimiter)
        fields = [field.strip() for field in fields]
    return [field.replace(".", "?").replace(",", ".") for field in fields] if decimal == "," else fields


def _enclosed(field: str) -> bool:
    return len(field) > 1 and field[0] == field[-1] == '"'


def _quoted(line: str, delimiter: str) -> list[str] | None:
    try:
        return next(csv.reader([line], delimiter=delimiter, strict=True, skipinitialspace=True))
    except (csv.Error, StopIteration):
        return None


def _block(path: Path, lines: list[str], layout: Layout) -> Block:
    """Return the longest run of lines of constant width, over all delimiters that may be meant."""
    runs = []
    for delimiter, decimal in _DIALECTS:
        if layout.delimiter not in ("", delimiter) or layout.decimal not in ("", decimal):
            continue
        run = _longest_run(lines, Block(delimiter, decimal, 0, 0, 0), layout.skip_lines)
        if delimiter != decimal or any('"' in line for line in lines[run.start : run.start + run.lines]):
            runs.append(run)
    best = max(runs, key=lambda run: run.lines, default=None)
    if best is None or best.lines < 2:
        raise Unreadable(str(path), None, "holds no block of lines with the same count of numbers")
    others = [run for run in runs if run.lines == best.lines and run.start == best.start]
    shown = lines[best.start].strip()
    if any(o.fields(lines[best.start]) != best.fields(lines[best.start]) for o in others):
        limit = f"line {best.start + 1} ({shown[:40]!r}) may be read in two ways; declare delimiter and decimal"
        raise Unreadable("delimiter", None, f"{path.name}: {limit}")
    if best.delimiter == best.decimal and not layout.decimal:
        _expect_decimals(path, lines[best.start : best.start + best.lines])
    return best


def _expect_decimals(path: Path, lines: list[str]) -> None:
    """Refuse quoted numbers whose commas may all separate thousands."""
    fields = [field.strip() for line in lines for field in _quoted(line.strip(" "), ",") or () if "," in field]
    if fields and all(map(_MAYBE_THOUSANDS.fullmatch, fields)):
        limit = f"{path.name}: the comma in {fields[0]!r} may be a decimal sign or part thousands; declare decimal"
        raise Unreadable("decimal", None, limit)


def _longest_run(lines: list[str], dialect: Block, skip: int) -> Block:
    best, start, width = (0, 0, 0), skip, 0
    for i, line in enumerate(lines[skip:], skip):
        if not line.strip():
            continue
        fields = dialect.fields(line)
        found = len(fields) if fields else 0
        if found != width:
            start, width, count = i, found, 0
        count = count + 1 if i > start else 1
        if width and count > best[1]:
            best = (start, count, width)
    return Block(dialect.delimiter, dialect.decimal, best[0], best[1], best[2])


def _refuse_broken(path: Path, lines: list[str], block: Block, skip: int) -> None:
    """Refuse a file with lines like those of the block before it, which would be lost without a word."""
    for i, line in enumerate(lines[skip : block.start], skip):
        fields = _split(line, block.delimiter, block.decimal)
        numbers = [bool(_NUMBER.fullmatch(field.strip('"'))) for field in fields]
        if numbers and numbers[0] and (len(fields) == block.width or (all(numbers) and len(fields) > 1)):
            limit = f"{path.name}: line {i + 1} ({line.strip()[:40]!r}) looks like data, but the block begins at line "
            raise Unreadable("skip_lines", None, f"{limit}{block.start + 1}; correct the file, or skip that line")


def _rows(path: Path, block: Block, encoding: str) -> Iterator[Floats]:
    """Yield the block's numbers as arrays (lines, columns). Raises Unreadable at a line of another width."""
    number, rest, ended = 0, b"", False
    with open(path, "rb", opener=files.regular()) as file:
        while True:
            piece = file.read(PIECE)
            whole, rest = _whole_lines(rest + piece) if piece else (rest, b"")
            if len(rest) > PIECE:
                raise Unreadable(str(path), None, f"line {number + 1} is longer than {PIECE / 1e6:g} MB")
            lines = _lines(whole.decode(encoding, "replace")) if whole else []
            if lines and not lines[-1]:
                lines.pop()
            skipped = max(0, min(block.start - number, len(lines)))
            kept = lines[skipped:]
            if kept and not ended:
                rows, used = _numbers(kept, block)
                yield rows
                ended, kept, skipped = used < len(kept), kept[used:], skipped + used
            if ended:
                _expect_footer(path, kept, block, number + skipped)
            number += len(lines)
            if not piece:
                return


def _whole_lines(data: bytes) -> tuple[bytes, bytes]:
    end = data.rfind(b"\n") + 1 or data.rfind(b"\r") + 1
    return data[:end], data[end:]


def _numbers(lines: list[str], block: Block) -> tuple[Floats, int]:
    """Return the numbers of the lines up to the first that doesn't fit, and how many lines those are."""
    rows = None if any('"' in line for line in lines) else _plain_numbers(lines, block)
    if rows is not None:
        return rows, len(lines)
    fields = [block.fields(line) if line.strip() else [] for line in lines]
    misfits = (i for i, found in enumerate(fields) if found is None or len(found) not in (0, block.width))
    used = next(misfits, len(lines))
    numbers = [[float(number) for number in found] for found in fields[:used] if found]
    return np.array(numbers, float).reshape(-1, block.width), used


def _plain_numbers(lines: list[str], block: Block) -> Floats | None:
    """Return the numbers of lines without quotes, fast; None where a line doesn't fit."""
    if block.delimiter == block.decimal:
        return None
    clean = lines
    if block.delimiter not in (" ", "\t"):
        clean = [line.rstrip(" ").removesuffix(block.delimiter) for line in lines]
    elif block.delimiter == "\t":
        clean = [line.removesuffix("\t") for line in lines]
    if block.decimal == ",":
        clean = [line.replace(".", "?").replace(",", ".") for line in clean]
    try:
        rows = np.loadtxt(clean, delimiter=None if block.delimiter == " " else block.delimiter, comments=None, ndmin=2)
        if rows.shape[1] == block.width and not np.isinf(rows).any():
            return rows
    except (ValueError, OverflowError):
        pass
    return None


def _expect_footer(path: Path, lines: list[str], block: Block, number: int) -> None:
    """Refuse further numbers behind the block's end: words alone may follow it."""
    for i, line in enumerate(lines):
        fields = [field.strip('"') for field in _split(line, block.delimiter, block.decimal)]
        if line.strip() and (_NUMBER.fullmatch(fields[0]) or any(map(_NUMBER.fullmatch, fields[1:]))):
            limit = f"line {number + i + 1} ({line.strip()[:40]!r}) does not have {block.width} numbers as those above"
            raise Unreadable(str(path), None, limit)


def _channels(header: list[str], block: Block) -> tuple[list[Channel], float | None]:
    """Return the columns' names and units by the last lines of the header, and the step that it may state, in s."""
    rows = [_words(line, block.delimiter) for line in header if line.strip()][-2:]
    names, units = [f"column {i + 1}" for i in range(block.width)], [""] * block.width
    step = _index_step(rows)
    if step is None:  # a line of more names than columns says not which column each one names
        rows = [row for row in rows if len(row) == block.width]
    if not rows:
        return [Channel(name) for name in names], None
    last = rows[-1][: block.width]
    alone = [bool(_UNIT_ALONE.fullmatch(word)) for word in last]
    units_row = any(last) and all(known(word) or a for word, a in zip(last, alone, strict=True) if word)
    if (len(rows) == 2 and (step is not None or units_row)) or all(alone):
        names = rows[0][: block.width] if len(rows) == 2 else names
        units = [word.strip("[]() ") if known(word) or a else "" for word, a in zip(last, alone, strict=True)]
    elif not any(alone):  # a unit by itself among names: its spaces have split them
        for i, word in enumerate(last):
            parts = _NAMED_UNIT.fullmatch(word)
            names[i], units[i] = (parts[1] or word, parts[2]) if parts else (word, "")
    return [
        Channel(name or f"column {i + 1}", unit) for i, (name, unit) in enumerate(zip(names, units, strict=True))
    ], step


def _words(line: str, delimiter: str) -> list[str]:
    line = line.strip().lstrip("#%").strip()
    if delimiter == " ":
        return line.split()
    line = line.removesuffix(delimiter)
    try:
        return [word.strip() for word in next(csv.reader([line], delimiter=delimiter))]
    except (csv.Error, StopIteration):
        return []


def _index_step(rows: list[list[str]]) -> float | None:
    """Return the step that stands in the header of an oscilloscope whose first column is an index, in s (Rigol)."""
    if (
        len(rows) == 2
        and min(map(len, rows)) > 2
        and rows[0][0] == "X"
        and rows[1][0] == "Sequence"
        and "Increment" in rows[0]
    ):
        at = rows[0].index("Increment")
        if at < len(rows[1]) and _NUMBER.fullmatch(rows[1][at]) and float(rows[1][at]) > 0:
            return float(rows[1][at])
    return None
