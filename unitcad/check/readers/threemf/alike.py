"""Vertices and triangles of a 3MF model part that are written alike, one after the other, read as numbers at once.

They are nearly all that a large part holds. Where a block of them has the same text but for the digits, it is read in
numpy and the parser gets its line ends alone; any other block goes through the parser, element by element.
"""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from unitcad.geometry.arrays import Bools, Floats, Ints

_BLOCK = 1 << 18
_OPEN = re.compile(rb"<(vertices|triangles)>")
_LONGEST_TAG = len(b"<triangles>")
_HEAD = {name: re.compile(rb"\s*<" + name + rb'\s+(\w+)="') for name in (b"vertex", b"triangle")}
_WITHIN = re.compile(rb'"\s+(\w+)="')
_BEHIND = re.compile(rb'"\s*/>\s*')
_ELEMENTS = {b"vertices": b"vertex", b"triangles": b"triangle"}
_NAMES = {b"vertex": (b"x", b"y", b"z"), b"triangle": (b"v1", b"v2", b"v3", b"p1", b"p2", b"p3", b"pid")}
"""Attributes, of which each element needs the first three."""
_MOST_DIGITS = 9  # an index goes to 2^31 - 1; longer ones are left to the parser
_QUOTE, _NEWLINE, _LESS = b'"\n<'


def _table(characters: bytes) -> Bools:
    table = np.zeros(256, bool)
    table[list(characters)] = True
    return table


_DIGITS = _table(b"0123456789")
_IN_NUMBERS = _table(b"0123456789+-.eE")


@dataclass(frozen=True)
class Alike:
    """Elements of one block.

    columns: the numbers (n,) of each attribute by its name; lines: of each element, counted from that on which the
    block begins.
    """

    columns: dict[str, Floats | Ints]
    lines: Ints
    line_ends: int


class Reader(Protocol):
    """What reads the elements that the parser has."""

    def inside(self, fed: int) -> tuple[int, str]:
        """Return how many elements are open, and which list of the core's was opened last.

        The name is empty for any other, or where the parser has more to come of what it was given, `fed` bytes.
        """
        ...

    def take(self, name: str, found: Alike) -> bool:
        """Keep the elements of a list. Return whether they were kept: others are to be read one by one."""
        ...


def without_alike(chunks: Iterable[bytes], reader: Reader) -> Iterator[bytes]:
    """Yield what of a part is left for the parser; it must have had each piece before the next one is asked for."""
    left, held, fed, open_list = iter(chunks), b"", 0, b""
    while True:
        if not open_list:
            found = _OPEN.search(held)
            if found is None:
                last = held.rfind(b"<", max(len(held) - _LONGEST_TAG, 0))  # of a tag that may go on in the next chunk
                cut = len(held) if last < 0 else last
                piece, held = held[:cut], held[cut:]
            else:
                piece, held = held[: found.start()], held[found.start() :]
            if piece:
                yield piece
                fed += len(piece)
            if found is None:
                chunk = next(left, b"")
                if not chunk:
                    break
                held += chunk
                continue
            depth, _ = reader.inside(fed)
            tag = found.group()
            yield tag
            fed, held = fed + len(tag), held[len(tag) :]
            if reader.inside(fed) == (depth + 1, found.group(1).decode()):
                open_list = found.group(1)
            continue
        while len(held) < _BLOCK and b"</" not in held and (chunk := next(left, b"")):
            held += chunk
        end = held.find(b"</", 0, _BLOCK)
        cut = held.rfind(b"/>", 0, end if end >= 0 else _BLOCK) + 2
        if cut < 2:
            open_list = b""
            continue
        block, held = held[:cut], held[cut:]
        alike = read(block, _ELEMENTS[open_list])
        if alike is not None and reader.take(open_list.decode(), alike):
            block = b"\n" * alike.line_ends
            if block:
                yield block
            fed += len(block)
            continue
        yield block
        fed += len(block)
        # A comment or a section of characters may hold what looks like elements.
        if b"<!" in block or b"<?" in block or reader.inside(fed)[1] != open_list.decode():
            open_list = b""
    if held:
        yield held


def read(block: bytes, element: bytes) -> Alike | None:
    """Return the elements of a block, `vertex` or `triangle`, up to its end; None where they are not alike.

    Alike: between the numbers all have the same text, without another attribute than the core's own.
    """
    if b"\r" in block and block.count(b"\r") != block.count(b"\r\n"):
        return None
    head = _HEAD[element].match(block)
    if head is None:
        return None
    names = [head.group(1)]
    at = head.end()
    while within := _WITHIN.match(block, block.find(b'"', at)):
        names.append(within.group(1))
        at = within.end()
    known = _NAMES[element]
    if len(set(names)) < len(names) or not set(known[:3]) <= set(names) <= set(known):
        return None
    text = np.frombuffer(block, np.uint8)
    quotes = np.flatnonzero(text == _QUOTE)
    each = 2 * len(names)
    if len(quotes) % each or _BEHIND.fullmatch(block, int(quotes[-1])) is None:
        return None
    quotes = quotes.reshape(-1, each)
    begin, end = quotes[:, ::2] + 1, quotes[:, 1::2]
    if not _same_between(text, quotes, block, head.group()):
        return None
    numbers = _numbers(text, begin, end, whole=element == b"triangle")
    if numbers is None:
        return None
    line_ends = np.flatnonzero(text == _NEWLINE)
    first = block.index(b"<")
    starts = np.append(first, quotes[1:, 0] - (int(quotes[0, 0]) - first))
    lines = np.searchsorted(line_ends, starts)
    return Alike({name.decode(): numbers[:, i] for i, name in enumerate(names)}, lines, len(line_ends))


def _same_between(text: Ints, quotes: Ints, block: bytes, head: bytes) -> bool:
    """Tell whether all elements have the text of the first between their numbers, and between two of them."""
    opened, closed = quotes.ravel()[::2], quotes.ravel()[1::2]
    width = opened[1:] - closed[:-1]
    each = quotes.shape[1] // 2
    for k in range(each):
        some, gap = closed[:-1][k::each], width[k::each]
        if not len(some):
            continue
        if not (gap == gap[0]).all():
            return False
        pattern = text[some[0] : some[0] + gap[0] + 1]
        if k == each - 1:
            behind = _BEHIND.match(pattern.tobytes())
            if behind is None or pattern.tobytes()[behind.end() :] != head.lstrip():
                return False
        for i, character in enumerate(pattern.tolist()):
            if not (text[some + i] == character).all():
                return False
    return True


def _numbers(text: Ints, begin: Ints, end: Ints, *, whole: bool) -> Floats | Ints | None:
    """Return the numbers between quotes, shape as `begin`; None where one may be none."""
    size = end - begin
    if size.min() < 1 or (whole and size.max() > _MOST_DIGITS):
        return None
    marks = np.zeros(len(text) + 1, np.int8)
    marks[begin], marks[end] = 1, -1
    inside = np.cumsum(marks[:-1], dtype=np.int8).view(bool)
    if not (_DIGITS if whole else _IN_NUMBERS)[text[inside]].all():
        return None
    words = np.where(inside, text, np.uint8(32)).tobytes()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            values = np.fromstring(words, np.int64 if whole else np.float64, sep=" ")
        except (DeprecationWarning, ValueError):
            return None
    return values.reshape(begin.shape) if values.size == begin.size else None  # "1-2" is two numbers to numpy
