"""Text of numbers in columns: the longest run of lines with the same count of numeric fields is the data.

Whatever would have to be guessed is refused: a line of another width among the numbers, two delimiters that both fit.
"""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from unitcad import files
from unitcad.geometry.arrays import Floats
from unitcad.lab.readers import Channel, Layout, Unreadable
from unitcad.lab.units import known

ENDINGS = (".csv", ".txt", ".tsv", ".asc", ".dat", ".lvm", ".tab")
HEAD = 1_000_000
"""Characters from a file's beginning in which its header ends."""
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
    start: int = 0
    lines: int = 0
    width: int = 0

    def split(self, line: str) -> list[str]:
        """Return the fields of a line; one delimiter at its end separates nothing. An open quote stays."""
        if self.delimiter == " ":
            fields = [re.sub(r'^"(.*)"$', r"\1", field) for field in line.split()]
        else:
            line = line.strip(" ").removesuffix(self.delimiter)
            fields = _quoted(line, self.delimiter) if '"' in line else line.split(self.delimiter)
            fields = [field.strip() for field in fields or line.split(self.delimiter)]
        if self.decimal == ",":
            fields = [field.replace(".", "?").replace(",", ".") for field in fields]
        return fields

    def numbers(self, line: str) -> list[str] | None:
        """Return a line's fields with a point for the decimal sign; None where one of them is no number."""
        fields = self.split(line)
        return fields if fields and all(map(_NUMBER.fullmatch, fields)) else None


def read(path: Path, layout: Layout) -> list[Channel]:
    """Return the columns of a text file. Raises Unreadable where it has no block of numbers, or an ambiguous one."""
    with open(path, "rb", opener=files.regular()) as file:
        content = file.read()
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise Unreadable(str(path), None, "is UTF-16; save it as UTF-8")
    if b"\0" in content:
        raise Unreadable(str(path), None, "holds zero bytes: it is no text")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = content.decode("latin-1")
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    head = lines[: text.count("\n", 0, HEAD)] if len(text) > HEAD else lines
    block = _block(path, head, layout)
    for i, line in enumerate(lines[layout.skip_lines : block.start], layout.skip_lines):
        fields = block.split(line)
        numbers = [bool(_NUMBER.fullmatch(field.strip('"'))) for field in fields]
        if numbers and numbers[0] and (len(fields) == block.width or (all(numbers) and len(fields) > 1)):
            limit = f"{path.name}: line {i + 1} ({line.strip()[:40]!r}) looks like data, but the block begins at line "
            raise Unreadable("skip_lines", None, f"{limit}{block.start + 1}; correct the file, or skip that line")
    rows = _rows(path, lines, block)
    names, units, step = _header(lines[layout.skip_lines : block.start] or lines[: block.start], block)
    return [
        Channel(column, name or f"column {i}", unit, step)
        for i, (column, name, unit) in enumerate(zip(rows.T, names, units, strict=True), 1)
    ]


def _quoted(line: str, delimiter: str, strict: bool = True) -> list[str]:
    """Return the fields of a line with quotes; none where one is not closed."""
    try:
        return next(csv.reader([line], delimiter=delimiter, strict=strict, skipinitialspace=strict), [])
    except csv.Error:
        return []


def _block(path: Path, lines: list[str], layout: Layout) -> Block:
    """Return the longest run of lines of constant width, over all delimiters that may be meant."""
    runs = []
    for delimiter, decimal in _DIALECTS:
        if layout.delimiter not in ("", delimiter) or layout.decimal not in ("", decimal):
            continue
        run = _longest_run(lines, Block(delimiter, decimal), layout.skip_lines)
        if delimiter != decimal or any('"' in line for line in lines[run.start : run.start + run.lines]):
            runs.append(run)
    best = max(runs, key=lambda run: run.lines, default=None)
    if best is None or best.lines < 2:
        raise Unreadable(str(path), None, "holds no block of lines with the same count of numbers")
    first = lines[best.start]
    others = [run for run in runs if run.lines == best.lines and run.start == best.start]
    if any(other.numbers(first) != best.numbers(first) for other in others):
        limit = f"line {best.start + 1} ({first.strip()[:40]!r}) may be read in two ways; declare delimiter and decimal"
        raise Unreadable("delimiter", None, f"{path.name}: {limit}")
    if best.delimiter == best.decimal and not layout.decimal:
        quoted = [_quoted(line.strip(" "), ",") for line in lines[best.start : best.start + best.lines]]
        fields = [field.strip() for line in quoted for field in line if "," in field]
        if fields and all(map(_MAYBE_THOUSANDS.fullmatch, fields)):
            limit = f"{path.name}: the comma in {fields[0]!r} may be a decimal sign or part thousands; declare decimal"
            raise Unreadable("decimal", None, limit)
    return best


def _longest_run(lines: list[str], dialect: Block, skip: int) -> Block:
    best, start, width, count = dialect, skip, 0, 0
    for i, line in enumerate(lines[skip:], skip):
        if not line.strip():
            continue
        found = len(dialect.numbers(line) or ())
        if found != width:
            start, width, count = i, found, 0
        count += 1
        if width and count > best.lines:
            best = Block(dialect.delimiter, dialect.decimal, start, count, width)
    return best


def _rows(path: Path, lines: list[str], block: Block) -> Floats:
    """Return the block's numbers (lines, columns). Raises Unreadable for numbers behind its end: words may follow."""
    plain = block.delimiter != block.decimal and not any('"' in line for line in lines)
    if plain:
        clean = [line.rstrip(" ").removesuffix(block.delimiter.strip(" ")) for line in lines[block.start :]]
        if block.decimal == ",":
            clean = [line.replace(".", "?").replace(",", ".") for line in clean]
        try:
            found = np.loadtxt(clean, delimiter=block.delimiter.strip(" ") or None, comments=None, ndmin=2)
            if found.shape[1] == block.width and not np.isinf(found).any():
                return found
        except (ValueError, OverflowError):
            pass  # a line that does not fit
    rows: list[list[float]] = []
    ended = False
    for i, line in enumerate(lines[block.start :], block.start):
        if not line.strip():
            continue
        fields = block.numbers(line)
        ended = ended or fields is None or len(fields) != block.width
        if not ended and fields:
            rows.append(list(map(float, fields)))
            continue
        fields = [field.strip('"') for field in block.split(line)]
        if _NUMBER.fullmatch(fields[0]) or any(map(_NUMBER.fullmatch, fields[1:])):
            limit = f"line {i + 1} ({line.strip()[:40]!r}) does not have {block.width} numbers as those above"
            raise Unreadable(str(path), None, limit)
    return np.array(rows, float)


def _header(header: list[str], block: Block) -> tuple[list[str], list[str], float | None]:
    """Return the columns' names and units by the last lines of the header, and the step that it may state, in s."""
    rows = [_words(line, block.delimiter) for line in header if line.strip()][-2:]
    names, units, step = [""] * block.width, [""] * block.width, None
    if len(rows) == 2 and rows[0][:1] == ["X"] and rows[1][:1] == ["Sequence"] and "Increment" in rows[0][1:]:
        # An oscilloscope whose first column is an index (Rigol).
        value = (rows[1] + [""] * len(rows[0]))[rows[0].index("Increment")]
        step = float(value) if _NUMBER.fullmatch(value) and float(value) > 0 else None
    if step is None:  # a line of more names than columns says not which column each one names
        rows = [row for row in rows if len(row) == block.width]
    if not rows:
        return names, units, None
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
    return names, units, step


def _words(line: str, delimiter: str) -> list[str]:
    line = line.strip().lstrip("#%").strip()
    if delimiter == " ":
        return line.split()
    return [word.strip() for word in _quoted(line.removesuffix(delimiter), delimiter, strict=False)]
