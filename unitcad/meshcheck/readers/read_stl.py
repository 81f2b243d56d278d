"""STL, binary and text, as it is: its content and its faults, before any repair.

Binary: 80 bytes of header, a little-endian uint32 count, records of 50 bytes. Text: the grammar of 3D Systems' 1989
StereoLithography Interface Specification; keywords in either case.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from itertools import islice

import numpy as np

from unitcad.geometry.arrays import Floats
from unitcad.meshcheck.findings import Finding, Location, counted
from unitcad.meshcheck.geometry.mesh import Mesh, weld_exact
from unitcad.meshcheck.readers import rows
from unitcad.meshcheck.readers.rows import NOT_FINITE_BYTES, NUMBER
from unitcad.meshcheck.rules.f_file import (
    F001,
    F002,
    F003,
    F005,
    F006,
    F007,
    F008,
    F009,
    F010,
    F011,
    Deadline,
    Limits,
    Unreadable,
    not_a_number,
)
from unitcad.meshcheck.rules.registry import Rule
from unitcad.meshcheck.rules.v_values import faces_not_finite

RECORD = np.dtype([("normal", "<f4", (3,)), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_TOKENS = 21  # facet normal x y z outer loop (vertex x y z) x 3 endloop endfacet
_WORDS = {0: b"facet", 1: b"normal", 5: b"outer", 6: b"loop", 7: b"vertex", 11: b"vertex", 15: b"vertex"}
_WORDS |= {19: b"endloop", 20: b"endfacet"}
_NUMBERS = [i for i in range(_TOKENS) if i not in _WORDS]
_PRINTABLE = bytes(b for b in range(256) if b in b"\t\n\v\f\r" or (b >= 32 and b != 127))
_BLOCK = 8_000_000


def read_stl(data: memoryview, limits: Limits, deadline: Deadline, findings: list[Finding]) -> Mesh | None:
    """Read an STL file, as `readers.Reader` says."""
    size = len(data)
    head = bytes(data[:2048])
    if _is_text(head, data):
        return _read_text(data, limits, deadline, findings)
    if not head.translate(None, _PRINTABLE) and size != _binary_size(data):
        first = head.split(None, 1)[0][:20].decode("utf-8", "replace") if head.strip() else ""
        raise F005.unreadable(f"text that does not begin with solid but with {first!r}")
    if size < 84:
        raise F001.unreadable(f"{counted(size, 'byte')}: shorter than a binary STL's header of 84")
    if head[:5].lower() == b"solid":
        findings.append(F007.finding("the binary header starts with 'solid'"))
    count = int.from_bytes(data[80:84], "little")
    if more := _attributes(data, count):
        what = f"{counted(more, 'attribute byte')} after each facet: the size is 84 + {count} x (50 + {more})"
        findings.append(F002.finding(f"{what}, and most programs read facets of 50 bytes"))
        limits.check_faces(count)
        records = np.frombuffer(data, np.dtype([*RECORD.descr, ("more", f"V{more}")]), count, 84)
        return _mesh(records["corners"], records["normal"], findings)
    room, rest = divmod(size - 84, 50)
    promise = f"the header promises {counted(count, 'facet')}, the file"
    if count > room:
        findings.append(F002.finding(f"{promise} has room for {room}", count - room))
        if room:
            raise Unreadable()  # geometry rules on the rest would only blame the wrong thing
    elif count < room and rest == 0 and any(data[84 + 50 * count : 84 + 50 * count + 100]):
        findings.append(F002.finding(f"{promise} holds {room}", room - count))
    elif extra := size - _binary_size(data):
        findings.append(F006.finding(f"{counted(extra, 'byte')} after the last facet", extra))
    facets = min(count, room)
    limits.check_faces(facets)
    if facets == 0:
        raise F001.unreadable("the file has no facet")
    records = np.frombuffer(data, RECORD, facets, 84)
    deadline.tick()
    return _mesh(records["corners"], records["normal"], findings)


def _attributes(data: memoryview, count: int) -> int:
    """Return how many bytes of attributes follow each of `count` facets, as the facets' attribute counts say, or 0."""
    more, rest = divmod(len(data) - 84 - 50 * count, max(count, 1))
    if rest or not 0 < more < 1 << 16:
        return 0
    stated = np.ndarray(count, "<u2", data, 84 + 48, (50 + more,))
    return more if (stated == more).all() else 0


def _binary_size(data: memoryview) -> int:
    """Return the size of the binary STL whose header this is."""
    return 84 + 50 * int.from_bytes(data[80:84], "little")


def _mesh(corners: Floats, normals: Floats, findings: list[Finding]) -> Mesh | None:
    """Return the mesh of corners (m, 3, 3); none if one is no float32 number (V001)."""
    with np.errstate(over="ignore"):
        bad = np.flatnonzero(~np.isfinite(corners.astype(np.float32)).all(axis=(1, 2)))
    if len(bad):
        findings.append(faces_not_finite(len(bad), (Location(face=int(i)) for i in bad)))
        return None
    vertices, faces = weld_exact(corners)
    # Zeros are no normals (T013), and most programs write none.
    return Mesh(vertices, faces, np.ascontiguousarray(normals) if normals.any() else None, indexed=False)


def _is_text(head: bytes, data: memoryview) -> bool:
    start = head.lstrip(b"\xef\xbb\xbf\xff\xfe\x00 \t\r\n")[:5].lower()
    if head.startswith(rows.UTF16):
        return True
    if start != b"solid" and not head.lstrip().lower().startswith(b"facet"):
        return False
    return not (len(data) >= 84 and len(data) == _binary_size(data)) and b"\x00" not in head[:512]


@dataclass
class _Text:
    """Content of a text STL as far as it was read."""

    findings: list[Finding]
    corners: list[Floats] = field(default_factory=list)
    normals: list[Floats] = field(default_factory=list)
    facets: int = 0
    solids: int = 0


def _read_text(data: memoryview, limits: Limits, deadline: Deadline, findings: list[Finding]) -> Mesh | None:
    state = _Text(findings)
    _walk(_decode(data.obj if isinstance(data.obj, bytes) else bytes(data), findings), state, limits, deadline)
    if not state.facets:
        raise F001.unreadable("the file has no facet")
    if state.solids > 1:
        findings.append(F010.finding(f"{state.solids} solids in one file", state.solids))
    if not state.corners or any(item.code == "F004" for item in findings):
        return None
    return _mesh(np.concatenate(state.corners), np.concatenate(state.normals), findings)


def _decode(raw: bytes, findings: list[Finding]) -> bytes:
    """Return the text as bytes with LF line ends, whatever it was stored as; oddities become findings."""
    if not raw.isascii() and not raw.startswith(rows.UTF16):
        try:
            raw.decode("utf-8")
        except UnicodeDecodeError as error:
            findings.append(F009.finding(f"bytes that are not UTF-8, first at {error.start}"))
    return rows.plain(raw, findings)


def _walk(raw: bytes, state: _Text, limits: Limits, deadline: Deadline) -> None:
    """Read solid after solid. Adds findings; raises only for limits, never for the text's content."""
    at, end = 0, len(raw)
    inside = False
    while True:
        at = _skip_blank(raw, at)
        if at >= end:
            break
        deadline.tick()
        line_end = raw.find(b"\n", at)
        line_end = end if line_end < 0 else line_end
        word = raw[at : at + 8].split(None, 1)[0].lower()
        if word.startswith(b"solid"):
            if inside:
                state.findings.append(_at(F003, "solid begins before the last one ended", raw, at))
                state.corners.clear()
                return
            inside, state.solids, at = True, state.solids + 1, line_end
        elif _END_SOLID.match(raw, at):
            inside, at = False, line_end
        elif word == b"facet":
            if not inside:
                what = "after endsolid" if state.solids else "without a solid line"
                state.findings.append(_at(F003, f"facets {what}", raw, at))
                state.solids, inside = state.solids + 1, True
            at = _facets(raw, at, state, limits, deadline)
            if at < 0:
                return
        else:
            rule, what = (F003, "unexpected") if inside else (F006, "after endsolid:")
            if rule is F006 and state.facets:
                state.findings.append(_at(rule, f"{counted(end - at, 'byte')} after endsolid", raw, at))
                return
            shown = raw[at : min(line_end, at + 30)].decode("utf-8", "replace")
            state.findings.append(_at(F003, f"{what} {shown!r}", raw, at))
            return
    if inside:
        state.findings.append(_at(F003, "the text ends before endsolid", raw, end))


def _skip_blank(raw: bytes, at: int) -> int:
    return at + len(_BLANK.match(raw, at)[0])  # type: ignore[index]


_BLANK = re.compile(rb"[\s\x00]*")
_END = re.compile(rb"(?im)^[ \t]*(?:end[ \t]*solid|solid)\b")
_END_SOLID = re.compile(rb"(?i)end[ \t]*solid\b")  # some programs write two words


def _facets(raw: bytes, at: int, state: _Text, limits: Limits, deadline: Deadline) -> int:
    """Read facets from `at` to the next solid or endsolid, whole blocks at a time; the place after them, or -1."""
    match = _END.search(raw, at)
    stop = match.start() if match else len(raw)
    while at < stop:
        deadline.tick()
        cut = min(at + _BLOCK, stop)
        if cut < stop:
            inner = raw.rfind(b"endfacet", at, cut)
            inner = raw.rfind(b"ENDFACET", at, cut) if inner < 0 else inner
            cut = inner + 8 if inner >= 0 else stop
        block = raw[at:cut]
        tokens = block.lower().split()
        if len(tokens) % _TOKENS or any(set(tokens[i::_TOKENS]) != {word} for i, word in _WORDS.items()):
            _explain(raw, at, cut, tokens, state)
            return -1
        _take(block, tokens, state, limits)
        at = cut
    return stop


def _take(block: bytes, tokens: list[bytes], state: _Text, limits: Limits) -> None:
    if state.facets + len(tokens) // _TOKENS > limits.max_faces:
        raise F011.unreadable(f"more faces than --max-faces {limits.max_faces}")
    columns = [tokens[column::_TOKENS] for column in _NUMBERS]
    try:
        if not block.isascii() or b"_" in block:  # numpy takes 1_0 for ten, as Python does
            raise ValueError
        numbers = np.array(columns).astype(np.float64).T
    except ValueError:
        numbers = np.array([_slow_numbers(column, state) for column in columns]).T
    state.normals.append(numbers[:, :3])
    state.corners.append(numbers[:, 3:].reshape(-1, 3, 3))
    state.facets += len(numbers)


def _slow_numbers(texts: list[bytes], state: _Text) -> Floats:
    values = np.zeros(len(texts))
    for i, text in enumerate(texts):
        if NUMBER.fullmatch(text):
            values[i] = float(text)
        elif NOT_FINITE_BYTES.fullmatch(text):
            values[i] = np.nan
        else:
            state.findings.append(not_a_number(text, [Location(face=state.facets + i)]))
    return values


def _explain(raw: bytes, at: int, cut: int, tokens: list[bytes], state: _Text) -> None:
    """Say which word of a block breaks the grammar; that ends the reading."""
    state.corners.clear()  # a mesh of the text before would only blame the wrong thing
    state.normals.clear()
    wrong = next((i for i, word in enumerate(tokens) if _breaks(i % _TOKENS, word)), len(tokens))
    place = wrong % _TOKENS
    first = wrong - place
    state.facets += first // _TOKENS + 1
    starts = [match.start() for match in islice(_WORD.finditer(raw, at, cut), wrong + 1)]
    wanted = _WORDS.get(place, b"a number") if place else b"facet or endsolid"
    word = tokens[wrong] if wrong < len(tokens) else b""
    if {word, wanted} == {b"vertex", b"endloop"}:
        rest = tokens[first:]
        vertices = rest[: rest.index(b"endloop") if b"endloop" in rest else None].count(b"vertex")
        state.findings.append(_at(F008, f"a facet with {counted(vertices, 'vertex', 'vertices')}", raw, starts[first]))
    elif word and not (starts[-1] + len(word) == len(raw) and any(text.startswith(word) for text in wanted.split())):
        shown = word[:30].decode("utf-8", "replace")
        state.findings.append(_at(F003, f"{shown!r} where {wanted.decode()} belongs", raw, starts[-1]))
    elif raw[cut:].strip():
        state.findings.append(_at(F003, "the solid ends inside a facet", raw, _skip_blank(raw, cut)))
    else:
        inside = "inside a facet" if place else "before endsolid"
        state.findings.append(_at(F003, f"the text ends {inside}", raw, len(raw.rstrip())))


def _breaks(place: int, word: bytes) -> bool:
    """Return whether a word may not stand at its place in a facet; what is no number is found later."""
    return word != _WORDS[place] if place in _WORDS else word in _KEYWORDS


_KEYWORDS = set(_WORDS.values())
_WORD = re.compile(rb"\S+")


def _at(rule: Rule, message: str, raw: bytes, place: int) -> Finding:
    return rule.finding(message, places=[Location(line=_line(raw, place))])


def _line(raw: bytes, place: int) -> int:
    return raw.count(b"\n", 0, place) + 1
