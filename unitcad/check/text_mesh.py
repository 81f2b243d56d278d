"""What a text OBJ, PLY or OFF says of itself, held against its own lines before trimesh reads it.

trimesh takes what is there where a count promises more, index 0 for the last vertex, and whatever Python's `float`
takes for a number.
"""

from __future__ import annotations

import re

from unitcad.check.findings import Finding, Location, counted
from unitcad.check.limits import OutOfTime, Unreadable
from unitcad.check.rulebook import finding

NUMBER = re.compile(rb"[+-]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?", re.IGNORECASE)
_NOT_FINITE = re.compile(rb"[+-]?(?:nan|inf(?:inity)?)", re.IGNORECASE)
_IN_NUMBERS = b"0123456789+-.eEnNaAiIfFtTyY \t\r\n\f\v"  # of a word that may be one, nan and infinity among them
_COMMENT = re.compile(rb"#[^\n]*")
_OFF_START = re.compile(rb"^[ \t\r\n]*[A-Z0-9]*OFF\b", re.IGNORECASE)
_PLY_ELEMENT = re.compile(rb"(?m)^[ \t]*element[ \t]+(\w+)[ \t]+(\d+)[ \t\r]*$")
OBJ_VERTEX = re.compile(rb"(?m)^[ \t]*v[ \t]+([^#\n]*)")
_OBJ_FACE = re.compile(rb"(?m)^[ \t]*f[ \t]+([^#\n]*)")
_OBJ_SHORT = re.compile(rb"(?m)^[ \t]*f(?:[ \t]+[^\s#\\]+){0,2}[ \t]*(?:#[^\n]*)?$")
_PLY_TEXT = re.compile(rb"(?m)^[ \t]*format[ \t]+ascii\b")
_OBJ_ZERO = re.compile(rb"(?m)^[ \t]*f[ \t](?:[^#\n]*[ \t])?[+-]?0+(?=[/\s]|\Z)")


def plain(kind: str, raw: bytes) -> tuple[bytes, list[Finding]]:
    """Text as trimesh reads it: no byte order mark, LF line ends, blanks for tabs. Binary files stay as they are."""
    found = []
    if raw[:3] == b"\xef\xbb\xbf":
        found.append(finding("F009", "a UTF-8 byte order mark at the start"))
        raw = raw[3:]
    if b"\x00" in raw or (kind == "ply" and not _PLY_TEXT.search(raw[:1000])):
        return raw, found
    if b"\r" in raw:
        if b"\n" not in raw:
            found.append(finding("F009", "CR-only line ends"))
        raw = raw.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    return raw.replace(b"\t", b" "), found


def look(kind: str, raw: bytes) -> list[Finding]:
    """Findings that leave a mesh. Raises `Unreadable` for counts that the lines don't reach, index 0, no numbers."""
    numbers = numbers_of(kind, raw)
    if numbers is None:
        return []
    if numbers.translate(None, _IN_NUMBERS):
        _refuse_words(numbers)
    if kind == "obj":
        if match := _OBJ_ZERO.search(raw):
            place = Location(line=raw.count(b"\n", 0, match.end()) + 1)
            raise Unreadable(finding("P011", "a face names vertex 0; OBJ counts from 1", places=[place]))
        return _short_faces([raw.count(b"\n", 0, match.start()) + 1 for match in _OBJ_SHORT.finditer(raw)])
    promised = _promised(kind, raw, numbers)
    if promised is None:
        return []
    rows = [line for line in numbers.split(b"\n") if line.strip()]
    lines = len(rows) - (kind == "off")
    if lines < promised:
        text = f"the header promises {counted(promised, 'line')} of vertices, faces and other elements, not {lines}"
        raise Unreadable(finding("F002", text, promised - lines))
    found = _off_faces(rows[: promised + 1]) if kind == "off" else []
    if lines > promised:
        found += [finding("F006", f"{counted(lines - promised, 'line')} after the last element", lines - promised)]
    return found


def _short_faces(lines: list[int]) -> list[Finding]:
    if not lines:
        return []
    text = f"{counted(len(lines), 'face')} with fewer than three vertices"
    return [finding("F008", text, len(lines), [Location(line=line) for line in lines])]


def _off_faces(rows: list[bytes]) -> list[Finding]:
    """The counts that the face rows of an OFF begin with. Raises `Unreadable` where a row is shorter than it says."""
    short = 0
    for row in rows[1 + int(rows[0].split()[0][:18]) :]:
        words = row.split()
        size = int(words[0][:18]) if words[0].isdigit() else 0
        if size >= len(words):
            raise Unreadable(finding("F003", f"a face of {counted(size, 'vertex', 'vertices')} names {len(words) - 1}"))
        short += size < 3
    return [finding("F008", f"{counted(short, 'face')} with fewer than three vertices", short)] if short else []


def explained(kind: str, raw: bytes) -> Finding:
    """Why trimesh could not read it, in the format's words."""
    numbers = numbers_of(kind, raw)
    try:
        if numbers is not None:
            _refuse_words(numbers)
        if kind == "obj":
            _refuse_indices(raw)
        elif kind == "off" and numbers is not None:
            _refuse_off_indices(numbers)
    except OutOfTime:
        raise
    except Unreadable as stop:
        return stop.findings[0]
    what = "lines are not those of the format" if numbers is not None else "elements are not those of a mesh"
    return finding("F003", f"cannot be read as {kind.upper()}: its {what}")


def without_comments(raw: bytes) -> bytes:
    """The text of an OFF; trimesh loses the line after one that ends in a comment."""
    return raw if b"\x00" in raw else _COMMENT.sub(b"", raw)


def numbers_of(kind: str, raw: bytes) -> bytes | None:
    """The part that holds only numbers, line by line; None where the file is binary or has no such part."""
    if kind == "obj":
        return b"\n".join(OBJ_VERTEX.findall(raw))
    if kind == "ply":
        head, mark, body = raw.partition(b"end_header")
        return body if mark and _PLY_TEXT.search(head) else None
    match = _OFF_START.match(raw)
    if match is None or b"\x00" in raw or raw[match.end() :].lstrip()[:6].upper() == b"BINARY":
        return None
    return _COMMENT.sub(b"", raw[match.end() :])


def _promised(kind: str, raw: bytes, numbers: bytes) -> int | None:
    """The lines that the header asks for, one an element."""
    if kind == "ply":
        return sum(int(count[:18]) for _, count in _PLY_ELEMENT.findall(raw.partition(b"end_header")[0]))
    head = numbers.split(None, 2)[:2]
    return sum(int(word[:18]) for word in head) if len(head) == 2 and all(map(bytes.isdigit, head)) else None


def _refuse_words(numbers: bytes) -> None:
    for word in numbers.split():
        if not NUMBER.fullmatch(word) and not _NOT_FINITE.fullmatch(word):
            why = " (a decimal comma)" if b"," in word else ""
            raise Unreadable(finding("F004", f"{word[:30].decode('utf-8', 'replace')!r} is not a number{why}"))


def _refuse_indices(raw: bytes) -> None:
    count = len(OBJ_VERTEX.findall(raw))
    for match in _OBJ_FACE.finditer(raw):
        place = [Location(line=raw.count(b"\n", 0, match.start(1)) + 1)]
        for word in match.group(1).split():
            index = word.split(b"/")[0]
            if not re.fullmatch(rb"[+-]?\d{1,18}", index):
                shown = word[:30].decode("utf-8", "replace")
                raise Unreadable(finding("F004", f"{shown!r} is not a vertex's index", places=place))
            if not 1 <= abs(int(index)) <= count:
                raise Unreadable(finding("P011", f"a face names vertex {int(index)} of {count}", places=place))


def _refuse_off_indices(numbers: bytes) -> None:
    rows = [line.split() for line in numbers.split(b"\n") if line.strip()]
    count = int(rows[0][0]) if rows and rows[0][0].isdigit() else 0
    for row in rows[1 + count :]:
        size = int(row[0]) if row[0].isdigit() else 0
        for word in row[1 : 1 + size]:
            if not word.isdigit() or int(word[:18]) >= count:
                shown = word[:30].decode("utf-8", "replace")
                raise Unreadable(finding("P011", f"a face names vertex {shown} of {count}, counted from 0"))
