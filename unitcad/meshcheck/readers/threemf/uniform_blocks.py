"""Fast reading of the vertices and triangles of a 3MF model part.

They are nearly all of a large part. A block whose elements differ only in their numbers is read by numpy, and the
parser gets only its line ends. Every other block goes through the parser.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from unitcad.geometry.arrays import Floats, Ints
from unitcad.meshcheck.readers.rows import NEWLINE, SPACE, numbers_of, table_of

_BLOCK = 1 << 18
_OPEN = re.compile(rb"<(vertices|triangles)>")
_LONGEST_TAG = len(b"<triangles>")
_HEAD = {name: re.compile(rb"[ \t\r\n]*<" + name + rb'[ \t\r\n]+(\w+)="') for name in (b"vertex", b"triangle")}
_WITHIN = re.compile(rb'"[ \t\r\n]+(\w+)="')
_AFTER = re.compile(rb'"[ \t\r\n]*/>[ \t\r\n]*')
_ELEMENTS = {b"vertices": b"vertex", b"triangles": b"triangle"}
_NAMES = {b"vertex": (b"x", b"y", b"z"), b"triangle": (b"v1", b"v2", b"v3", b"p1", b"p2", b"p3", b"pid")}
"""Attributes, of which each element needs the first three."""
_SHORTEST = 1500  # bytes; a shorter block costs the parser less
_LONGEST_GAP = 200  # bytes between two numbers
_MOST_DIGITS = 9  # an index goes to 2^31 - 1; longer ones are left to the parser
_QUOTE = ord('"')


_DIGITS = table_of(b"0123456789")
_IN_NUMBERS = table_of(b"0123456789+-.eE")  # no blanks: each number fills its quotes


@dataclass(frozen=True)
class UniformBlock:
    """The elements of a uniform block.

    columns: the numbers (n,) of each attribute by its name; lines: the line (n,) of each element, 0 for the one on
    which the block begins; line_ends: how many there are in the block.
    """

    columns: dict[str, Floats | Ints]
    lines: Ints
    line_ends: int


class Reader(Protocol):
    """A reader of the elements that the parser reports."""

    def inside(self, fed: int) -> tuple[int, str]:
        """Return the number of open elements and the name of the innermost one if it belongs to the core.

        The name is empty while the parser holds back some of the `fed` bytes.
        """
        ...

    def take(self, name: str, found: UniformBlock) -> bool:
        """Keep the elements of a list; return False where they have to be read one by one."""
        ...


def rest_for_parser(chunks: Iterable[bytes], reader: Reader) -> Iterator[bytes]:
    """Yield what the parser has to read of a part. It must have parsed each piece before it asks for the next one."""
    left, held, at, fed, open_list = iter(chunks), b"", 0, 0, b""  # `at` bytes of `held` are done
    while True:
        if not open_list:
            found = _OPEN.search(held, at)
            if found is None:
                last = held.rfind(b"<", max(len(held) - _LONGEST_TAG, at))  # of a tag that may go on in the next chunk
                cut = len(held) if last < 0 else last
            else:
                cut = found.start()
            if cut > at:
                yield held[at:cut]
                fed, at = fed + cut - at, cut
            if found is None:
                chunk = next(left, b"")
                if not chunk:
                    break
                held, at = held[at:] + chunk, 0
                continue
            depth, _ = reader.inside(fed)
            yield found.group()
            fed, at = fed + len(found.group()), found.end()
            if reader.inside(fed) == (depth + 1, found.group(1).decode()):
                open_list = found.group(1)
            elif at < len(held):  # in a comment, for example: one full of tags would take long, tag by tag
                yield held[at:]
                fed, held, at = fed + len(held) - at, b"", 0
            continue
        while len(held) - at < _BLOCK and held.find(b"</", at) < 0 and (chunk := next(left, b"")):
            held, at = held[at:] + chunk, 0
        end = held.find(b"</", at, at + _BLOCK)
        cut = held.rfind(b"/>", at, end if end >= 0 else at + _BLOCK) + 2
        if cut < 2:
            open_list = b""
            continue
        block, at = held[at:cut], cut
        uniform = read_uniform(block, _ELEMENTS[open_list]) if len(block) >= _SHORTEST else None
        if uniform is not None and reader.take(open_list.decode(), uniform):
            block = b"\n" * uniform.line_ends
            if block:
                yield block
            fed += len(block)
            continue
        yield block
        fed += len(block)
        # A comment or a section of characters may hold what looks like elements.
        if b"<!" in block or b"<?" in block or reader.inside(fed)[1] != open_list.decode():
            open_list = b""
    if at < len(held):
        yield held[at:]


def read_uniform(block: bytes, element: bytes) -> UniformBlock | None:
    """Return the elements of a block, `vertex` or `triangle`, or None where the block is not uniform.

    In a uniform block all text between the numbers repeats, and each attribute is one of the core's.
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
    if len(quotes) % each or _AFTER.fullmatch(block, int(quotes[-1])) is None:
        return None
    quotes = quotes.reshape(-1, each)
    begin, end = quotes[:, ::2] + 1, quotes[:, 1::2]
    if not _same_between(text, quotes, block, head.group()):
        return None
    numbers = _numbers(text, begin, end, whole=element == b"triangle")
    if numbers is None:
        return None
    line_ends = np.flatnonzero(text == NEWLINE)
    first = block.index(b"<")
    starts = np.append(first, quotes[1:, 0] - (int(quotes[0, 0]) - first))
    lines = np.searchsorted(line_ends, starts)
    return UniformBlock({name.decode(): numbers[:, i] for i, name in enumerate(names)}, lines, len(line_ends))


def _same_between(text: Ints, quotes: Ints, block: bytes, head: bytes) -> bool:
    """Tell whether the text between the numbers of the first element, and after it, repeats in the others."""
    opened, closed = quotes.ravel()[::2], quotes.ravel()[1::2]
    width = opened[1:] - closed[:-1]
    each = quotes.shape[1] // 2
    for k in range(each):
        some, gap = closed[:-1][k::each], width[k::each]
        if not len(some):
            continue
        if gap[0] > _LONGEST_GAP or not (gap == gap[0]).all():
            return False
        pattern = text[some[0] : some[0] + gap[0] + 1]
        if k == each - 1:
            after = _AFTER.match(pattern.tobytes())
            if after is None or pattern.tobytes()[after.end() :] != head.lstrip():
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
    values = numbers_of(np.where(inside, text, np.uint8(SPACE)).tobytes(), begin.size, integers=whole)
    return None if values is None else values.reshape(begin.shape)
