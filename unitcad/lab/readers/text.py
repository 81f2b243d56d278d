"""Text of numbers in columns: the longest run of lines with the same columns of numbers is the data.

A guess is refused: a line of another width among the numbers, two delimiters that both fit. Columns of words among the
numbers are skipped. An empty cell, and the sign that an instrument writes for a value beyond its range, are no number.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from unitcad import files
from unitcad.geometry.arrays import Floats
from unitcad.lab.header import beside, quoted, read_header
from unitcad.lab.readers import Channel, Layout, Unreadable
from unitcad.lab.units import Stated

ENDINGS = (".csv", ".txt", ".tsv", ".asc", ".dat", ".lvm", ".tab")
HEAD = 1_000_000
"""Characters from a file's beginning in which its header ends."""
_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?|[nN][aA][nN]", re.ASCII)
_OVER_RANGE = re.compile(r"[+-]?(?:∞|inf(?:inity)?|f{4,}|-{3,}|\*{3,}|#{3,})", re.ASCII | re.IGNORECASE)
"""Signs for a value beyond the range: of PicoScope, Keyence, and spreadsheets."""
_CLOCK = re.compile(r"(?:\d[\d/.-]*[ T])?(\d{1,2}):(\d\d):(\d\d(?:\.\d+)?)", re.ASCII)
"""A time of day, perhaps after a date."""
_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2}(?:,\d{3})+(?:\.\d*)?(?:[eE][+-]?\d+)?", re.ASCII)
_DIALECTS = (("\t", "."), (";", "."), (",", "."), (" ", "."), ("\t", ","), (";", ","), (" ", ","), (",", ","))
"""Delimiter and decimal sign; the same sign for both only if quotes separate them."""


@dataclass(frozen=True)
class Block:
    """The numbers' place: the first line, counted from 0, the count of lines in the head, and the kind of each column.

    A kind is n for numbers, t for words, and empty if all cells of the column are.
    """

    delimiter: str
    decimal: str
    start: int = 0
    lines: int = 0
    kinds: tuple[str, ...] = ()

    @property
    def width(self) -> int:
        return len(self.kinds)

    def split(self, line: str) -> list[str]:
        """Return the fields of a line; one delimiter at its end separates nothing. An open quote stays."""
        if self.delimiter == " ":
            fields = [re.sub(r'^"(.*)"$', r"\1", field) for field in line.split()]
        else:
            line = line.strip(" ").removesuffix(self.delimiter)
            fields = quoted(line, self.delimiter) if '"' in line else line.split(self.delimiter)
            fields = [field.strip() for field in fields or line.split(self.delimiter)]
        if self.decimal == ",":  # each sign becomes the other one
            fields = [field.translate(_SWAPPED) for field in fields]
        return [field.replace(",", "") if "," in field and _THOUSANDS.fullmatch(field) else field for field in fields]

    def row(self, line: str, width: int = 0) -> tuple[list[str], tuple[str, ...]]:
        """Return a line's fields with a point for the decimal sign, and their kinds; none without a number.

        A delimiter at the end of a line of `width` - 1 fields precedes an empty field.
        """
        fields = self.split(line)
        if len(fields) == width - 1 and self.delimiter != " " and line.endswith(self.delimiter):
            fields.append("")
        kinds = tuple("n" if _is_number(field) else "t" if field else "" for field in fields)
        return (fields, kinds) if any(map(_NUMBER.fullmatch, fields)) else ([], ())

    def numbers(self, line: str) -> list[float]:
        """Return the numbers of a line."""
        return [_value(field) for field, kind in zip(*self.row(line), strict=True) if kind == "n"]


_SWAPPED = str.maketrans(",.", ".,")


def _is_number(field: str) -> bool:
    return any(kind.fullmatch(field) for kind in (_NUMBER, _OVER_RANGE, _CLOCK))


def _value(field: str) -> float:
    """Return the number in a field; NaN for an empty one and for the sign of a value beyond the range."""
    if clock := _CLOCK.fullmatch(field):
        return 3600 * float(clock[1]) + 60 * float(clock[2]) + float(clock[3])
    return float(field) if _NUMBER.fullmatch(field) else np.nan


def read(path: Path, layout: Layout) -> list[Channel]:
    """Return the columns of a text file. Raises Unreadable if it has no block of numbers, or an ambiguous one."""
    lines = beside(_text(path).replace("\r\n", "\n").replace("\r", "\n").split("\n"))
    sizes = np.cumsum([len(line) + 1 for line in lines])
    head = lines[: max(int(np.searchsorted(sizes, HEAD)), 1)] if sizes[-1] > HEAD else lines
    block = _block(path, head, layout)
    for i, line in enumerate(lines[layout.skip_lines : block.start], layout.skip_lines):
        fields = block.split(line)
        numbers = [_is_number(field) for field in fields]
        if fields[:1] and numbers[0] and (len(fields) == block.width or (all(numbers) and len(fields) > 1)):
            limit = f"{path.name}: line {i + 1} ({line.strip()[:40]!r}) looks like data, but the block begins at line "
            raise Unreadable("skip_lines", None, f"{limit}{block.start + 1}; correct the file, or skip that line")
    rows = _rows(path, lines, block)
    header = read_header(lines[layout.skip_lines : block.start] or lines[: block.start], block.delimiter, block.width)
    clocks = [bool(_CLOCK.fullmatch(field)) for field in block.row(lines[block.start], block.width)[0]]
    shown = [i for i, kind in enumerate(block.kinds) if kind == "n" and not (header.index and i == 0)]
    units = [Stated("s") if clock else one for clock, one in zip(clocks, header.units, strict=True)]
    return [
        Channel(rows[:, i], header.names[i] or f"column {i + 1}", one.unit, header.step_s, one.doubt, one.likely)
        for i in shown
        for one in [units[i]]
    ]


def _text(path: Path) -> str:
    """Return a file's text, in UTF-8, UTF-16, GBK, or Latin-1. Raises Unreadable for a file of other bytes."""
    with open(path, "rb", opener=files.regular()) as file:
        content = file.read()
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        return content.decode("utf-16", "replace")
    if b"\0" in content:
        raise Unreadable(str(path), None, "has zero bytes: it is no text")
    for encoding in ("utf-8-sig", "gb2312"):
        # Latin-1 text has single bytes above ASCII, such as its sign of micro; Chinese characters are pairs.
        if encoding == "gb2312" and any(len(run) % 2 for run in re.findall(rb"[\x80-\xff]+", content)):
            continue
        try:
            return content.decode(encoding)
        except UnicodeDecodeError:
            continue
    return content.decode("latin-1")


def _block(path: Path, lines: list[str], layout: Layout) -> Block:
    """Return the longest run of lines of the same columns, over all delimiters that may be meant."""
    runs = []
    for delimiter, decimal in _DIALECTS:
        if layout.delimiter not in ("", delimiter) or layout.decimal not in ("", decimal):
            continue
        for run in _longest_runs(lines, Block(delimiter, decimal), layout.skip_lines):
            if delimiter != decimal or any('"' in line for line in lines[run.start : run.start + run.lines]):
                runs.append(run)
    # Words are columns only if a delimiter without them explains less than half of the lines.
    whole = max((run for run in runs if "t" not in run.kinds), key=lambda run: run.lines, default=None)
    longest = max(runs, key=lambda run: run.lines, default=None)
    best = whole if whole and longest and 2 * whole.lines >= longest.lines else longest
    if best is None or best.lines < 2:
        raise Unreadable(str(path), None, "needs two lines or more of the same count of numbers")
    if not layout.decimal:
        in_quotes = [quoted(line.strip(" "), best.delimiter) for line in lines[best.start :] if '"' in line]
        fields = [field.strip() for line in in_quotes for field in line if "," in field]
        if fields and all(_THOUSANDS.fullmatch(field) and "." not in field for field in fields):
            limit = f"{path.name}: the comma in {fields[0]!r} may be a decimal sign or part thousands; declare decimal"
            raise Unreadable("decimal", None, limit)
    first = lines[best.start]
    others = [run for run in runs if run.lines == best.lines and run.start == best.start]
    others = [run for run in others if ("t" in run.kinds) <= ("t" in best.kinds)]
    if any(str(other.numbers(first)) != str(best.numbers(first)) for other in others):
        limit = f"line {best.start + 1} ({first.strip()[:40]!r}) may be read in two ways; declare delimiter and decimal"
        raise Unreadable("delimiter", None, f"{path.name}: {limit}")
    return best


def _longest_runs(lines: list[str], dialect: Block, skip: int) -> list[Block]:
    """Return the longest run of lines with numbers in the same columns, and the longest one without words."""
    best: dict[bool, Block] = {}
    start, count, kinds, open_end = skip, 0, (), False
    for i, line in enumerate(lines[skip:], skip):
        if not line.strip():
            continue
        fresh = dialect.row(line, len(kinds))[1]
        if open_end and len(fresh) == len(kinds) + 1:  # the run began with lines whose last cell is empty
            kinds = (*kinds, "")
        if fresh != kinds:
            if len(fresh) != len(kinds) or any({*two} == {"n", "t"} for two in zip(fresh, kinds, strict=True)):
                start, count, kinds, open_end = i, 0, fresh, dialect.delimiter != " "
            else:
                kinds = tuple(one or other for one, other in zip(kinds, fresh, strict=True))
        open_end = open_end and line.endswith(dialect.delimiter)
        count += 1
        words = kinds.count("t")
        if kinds and words <= kinds.count("n") and (bool(words) not in best or count > best[bool(words)].lines):
            best[bool(words)] = Block(dialect.delimiter, dialect.decimal, start, count, kinds)
    return list(best.values())


def _rows(path: Path, lines: list[str], block: Block) -> Floats:
    """Return the block's numbers (lines, columns). Raises Unreadable for numbers behind its end: words may follow."""
    plain = block.delimiter != block.decimal and "t" not in block.kinds and not any('"' in line for line in lines)
    if plain:
        clean = [line.rstrip(" ").removesuffix(block.delimiter.strip(" ")) for line in lines[block.start :]]
        if block.decimal == ",":
            clean = [line.translate(_SWAPPED) for line in clean]
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
        fields, kinds = block.row(line, block.width)
        pairs = zip(kinds, block.kinds, strict=False)
        ended = ended or len(kinds) != block.width or any(one == "t" and other != "t" for one, other in pairs)
        if not ended:
            rows.append([np.nan if kind == "t" else _value(field) for field, kind in zip(fields, kinds, strict=True)])
            continue
        fields = [field.strip('"') for field in block.split(line)]
        if any(map(_NUMBER.fullmatch, fields)):
            limit = f"line {i + 1} ({line.strip()[:40]!r}) does not have {block.width} numbers as those above"
            raise Unreadable(str(path), None, limit)
    return np.array(rows, float)
