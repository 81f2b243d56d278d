"""STL, binary and text, as it is: what it holds and what is wrong with it, before any repair.

Binary: 80 bytes of header, a little-endian uint32 count, records of 50 bytes. Text: the grammar of 3D Systems' 1989
StereoLithography Interface Specification; keywords in either case.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np

from unitcad.check.detail import SHOWN
from unitcad.check.findings import Finding, Location, counted
from unitcad.check.geometry.triangle_mesh import Mesh, weld_exact
from unitcad.check.readers.rows import NUMBER
from unitcad.check.resource_limits import Deadline, Limits, Unreadable, over_limit
from unitcad.check.rules.f_file import F001, F002, F003, F004, F005, F006, F007, F008, F009, F010
from unitcad.check.rules.rule import Rule
from unitcad.check.rules.v_values import V001
from unitcad.geometry.arrays import Floats

RECORD = np.dtype([("normal", "<f4", (3,)), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_TOKENS = 21  # facet normal x y z outer loop (vertex x y z) x 3 endloop endfacet
_WORDS = {0: b"facet", 1: b"normal", 5: b"outer", 6: b"loop", 7: b"vertex", 11: b"vertex", 15: b"vertex"}
_WORDS |= {19: b"endloop", 20: b"endfacet"}
_NUMBERS = [i for i in range(_TOKENS) if i not in _WORDS]
_NAN_SPELLINGS = re.compile(rb"^[+-]?(nan(\(\w*\))?|inf(inity)?|1\.#(ind|inf|qnan|snan)\w*)$", re.IGNORECASE)
_PRINTABLE = bytes(b for b in range(256) if b in b"\t\n\v\f\r" or (b >= 32 and b != 127))
_BLOCK = 8_000_000


def read_stl(data: memoryview, limits: Limits, deadline: Deadline) -> tuple[list[Mesh], list[Finding]]:
    """Read the mesh of an STL file's bytes and what the file itself breaks. Raises `Unreadable` where no mesh
    remains.
    """
    size = len(data)
    if size == 0:
        raise Unreadable(F001.finding("the file is empty"))
    head = bytes(data[: min(size, 2048)])
    if _is_text(head, data):
        return _read_text(data, limits, deadline)
    if not head.translate(None, _PRINTABLE) and size != 84 + 50 * int.from_bytes(data[80:84], "little"):
        first = head.split(None, 1)[0][:20].decode("utf-8", "replace") if head.strip() else ""
        raise Unreadable(F005.finding(f"text that does not begin with solid but with {first!r}"))
    if size < 84:
        raise Unreadable(F001.finding(f"{counted(size, 'byte')}: shorter than a binary STL's header of 84"))
    count = int.from_bytes(data[80:84], "little")
    findings: list[Finding] = []
    if head[:5].lower() == b"solid":
        findings.append(F007.finding("the binary header starts with 'solid'"))
    room, rest = divmod(size - 84, 50)
    if count > room:
        findings.append(
            F002.finding(f"the header promises {counted(count, 'facet')}, the file has room for {room}", count - room)
        )
    elif count < room and (rest == 0 and any(data[84 + 50 * count : 84 + 50 * count + 100])):
        findings.append(
            F002.finding(f"the header promises {counted(count, 'facet')}, the file holds {room}", room - count)
        )
    elif size > 84 + 50 * count:
        extra = size - 84 - 50 * count
        findings.append(F006.finding(f"{counted(extra, 'byte')} after the last facet", extra))
    facets = min(count, room)
    if count > room and room:
        raise Unreadable(*findings)  # a geometry of what is left would only blame the wrong thing
    if facets > limits.max_faces:
        raise Unreadable(
            *findings, over_limit(f"{counted(facets, 'face')}, more than --max-faces {limits.max_faces}").findings[0]
        )
    if facets == 0:
        raise Unreadable(*findings, F001.finding("the file has no facet"))
    records = np.frombuffer(data, RECORD, facets, 84)
    deadline.tick()
    corners = records["corners"]
    finite = np.isfinite(corners)
    if not finite.all():
        findings.append(_not_finite(np.asarray(finite.all(axis=(1, 2)))))
        return [], findings
    vertices, faces = weld_exact(corners)
    normals = np.ascontiguousarray(records["normal"])
    return [Mesh(vertices, faces, normals, indexed=False, single=True)], findings


def _is_text(head: bytes, data: memoryview) -> bool:
    start = head.lstrip(b"\xef\xbb\xbf\xff\xfe\x00 \t\r\n")[:5].lower()
    if head[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return True
    if start != b"solid" and not head.lstrip().lower().startswith(b"facet"):
        return False
    size = len(data)
    if size >= 84 and size == 84 + 50 * int.from_bytes(data[80:84], "little"):
        return False
    return b"\x00" not in head[:512]


def _not_finite(good: Floats) -> Finding:
    bad = np.flatnonzero(~good)
    return V001.finding(
        f"{counted(len(bad), 'face')} with a vertex that is not finite",
        len(bad),
        (Location(face=int(i)) for i in bad),
    )


@dataclass
class _Text:
    """What has been read of a text STL."""

    corners: list[Floats] = field(default_factory=list)
    normals: list[Floats] = field(default_factory=list)
    facets: int = 0
    solids: int = 0
    nested: int = 0
    nested_at: list[int] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)


def _read_text(data: memoryview, limits: Limits, deadline: Deadline) -> tuple[list[Mesh], list[Finding]]:
    state = _Text()
    raw = _decoded(data.obj if isinstance(data.obj, bytes) else bytes(data), state.findings)
    _walk(raw, state, limits, deadline)
    if state.nested:  # one finding for all of them: a file may have a hundred thousand
        places = [Location(line=line) for line in state.nested_at]
        state.findings.append(F003.finding("solid begins before the last one ended", state.nested, places))
    if not state.facets:
        raise Unreadable(*state.findings, F001.finding("the file has no facet"))
    if state.solids > 1:
        state.findings.append(F010.finding(f"{state.solids} solids in one file", state.solids))
    corners = np.concatenate(state.corners) if state.corners else np.empty((0, 3, 3))
    normals = np.concatenate(state.normals) if state.normals else np.empty((0, 3))
    if not len(corners) or any(item.code == "F004" for item in state.findings):
        return [], state.findings
    with np.errstate(over="ignore"):
        single = corners.astype(np.float32)
    finite = np.isfinite(single)
    if not finite.all():
        state.findings.append(_not_finite(np.asarray(finite.all(axis=(1, 2)))))
        return [], state.findings
    del single
    vertices, faces = weld_exact(corners)
    return [Mesh(vertices, faces, normals, indexed=False)], state.findings


def _decoded(raw: bytes, findings: list[Finding]) -> bytes:
    """Return the text as bytes with LF line ends, whatever it was stored as; oddities become findings."""
    if raw[:2] in (b"\xff\xfe", b"\xfe\xff"):
        findings.append(F009.finding("UTF-16 text with a byte order mark"))
        raw = raw.decode("utf-16", "replace").encode("utf-8")
    elif raw[:3] == b"\xef\xbb\xbf":
        findings.append(F009.finding("a UTF-8 byte order mark at the start"))
        raw = raw[3:]
    if not raw.isascii():
        try:
            raw.decode("utf-8")
        except UnicodeDecodeError as error:
            findings.append(F009.finding(f"bytes that are not UTF-8, first at {error.start}"))
    if b"\r" in raw:
        if b"\n" not in raw:
            findings.append(F009.finding("CR-only line ends"))
        raw = raw.replace(b"\r\n", b"\n").replace(b"\r", b"\n")
    return raw


def _walk(raw: bytes, state: _Text, limits: Limits, deadline: Deadline) -> None:
    """Read solid after solid. Adds findings; never raises for what the text holds but for limits."""
    at, end = 0, len(raw)
    inside = False
    while True:
        at = _skip_blank(raw, at)
        if at >= end:
            break
        deadline.tick()
        line_end = raw.find(b"\n", at)
        line_end = end if line_end < 0 else line_end
        word = raw[at : at + 8].split(None, 1)[0].lower() if raw[at : at + 8].strip() else b""
        if word.startswith(b"solid"):
            if inside:
                state.nested += 1
                if state.nested <= SHOWN:
                    state.nested_at.append(raw.count(b"\n", 0, at) + 1)
            inside, state.solids, at = True, state.solids + 1, line_end
        elif word == b"endsolid":
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
    match = _BLANK.match(raw, at)
    return match.end() if match else at


_BLANK = re.compile(rb"[\s\x00]*")
_END = re.compile(rb"(?im)^[ \t]*(?:endsolid|solid)\b")


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
            return _explain(raw, at, cut, state, limits)
        _take(block, tokens, state, limits)
        at = cut
    return stop


def _take(block: bytes, tokens: list[bytes], state: _Text, limits: Limits) -> None:
    blocks = len(tokens) // _TOKENS
    if state.facets + blocks > limits.max_faces:
        raise over_limit(f"more faces than --max-faces {limits.max_faces}")
    columns = []
    plain = block.isascii() and b"_" not in block  # numpy takes 1_0 for ten, as Python does
    for column in _NUMBERS:
        texts = tokens[column::_TOKENS]
        try:
            columns.append(np.array(texts).astype(np.float64) if plain else _slow_numbers(texts, state))
        except ValueError:
            columns.append(_slow_numbers(texts, state))
    numbers = np.stack(columns, axis=1)
    state.normals.append(numbers[:, :3])
    state.corners.append(numbers[:, 3:].reshape(-1, 3, 3))
    state.facets += blocks


def _slow_numbers(texts: list[bytes], state: _Text) -> Floats:
    values = np.zeros(len(texts))
    for i, text in enumerate(texts):
        if NUMBER.fullmatch(text):
            values[i] = float(text)
        elif _NAN_SPELLINGS.match(text):
            values[i] = np.nan
        else:
            shown = text[:30].decode("utf-8", "replace")
            why = " (a decimal comma)" if b"," in text else ""
            place = [Location(face=state.facets + i)]
            state.findings.append(F004.finding(f"{shown!r} is not a number{why}", places=place))
    return values


def _explain(raw: bytes, at: int, cut: int, state: _Text, limits: Limits) -> int:
    """Read one irregular block token by token up to the first one that breaks the grammar, and end the reading.

    Facets with more or fewer vertices than three (F008) and words in a number's place (F004) break it no further.
    """
    state.corners.clear()  # a mesh of what came before would only blame the wrong thing
    state.normals.clear()
    place, vertices, start = 0, 0, at
    for match in _WORD.finditer(raw, at, cut):
        word, here = match.group().lower(), match.start()
        wanted = (b"vertex",) if place == _LOOP_END and vertices < 3 else _GRAMMAR[place]
        if place in (_VERTEX, _LOOP_END) and word in (b"vertex", b"endloop"):
            place = _VERTEX if word == b"vertex" else _LOOP_END
        elif word != wanted[0] if wanted else word in _KEYWORDS or not _is_number(word):
            if match.end() == len(raw) and (_begins(word, wanted)):
                break  # the text was cut within the word
            shown = word[:30].decode("utf-8", "replace")
            if wanted or word in _KEYWORDS:
                expected = b" or ".join(wanted).decode() or "a number"
                state.findings.append(_at(F003, f"{shown!r} where {expected} belongs", raw, here))
                return -1
            why = " (a decimal comma)" if b"," in word else ""
            state.findings.append(_at(F004, f"{shown!r} is not a number{why}", raw, here))
        if place == 0:
            start, vertices = here, 0
            state.facets += 1
        vertices += place == _VERTEX
        if place == _LOOP_END and vertices != 3:
            state.findings.append(_at(F008, f"a facet with {counted(vertices, 'vertex', 'vertices')}", raw, start))
        place = (place + 1) % len(_GRAMMAR)
        if len(state.findings) > 50 or state.facets > limits.max_faces:
            return -1
    else:
        if place == 0:
            return -1
    if raw[cut:].strip():
        state.findings.append(_at(F003, "the solid ends inside a facet", raw, _skip_blank(raw, cut)))
    else:
        inside = "inside a facet" if place else "before endsolid"
        state.findings.append(_at(F003, f"the text ends {inside}", raw, len(raw.rstrip())))
    return -1


_GRAMMAR: tuple[tuple[bytes, ...], ...] = (
    *((b"facet", b"endsolid"), (b"normal",), (), (), (), (b"outer",), (b"loop",)),
    *((b"vertex",), (), (), (), (b"endloop",), (b"endfacet",)),
)  # what may stand where in a facet; nothing named: a number
_VERTEX, _LOOP_END = 7, 11  # places in it
_KEYWORDS = {words[0] for words in _GRAMMAR if words}
_WORD = re.compile(rb"\S+")


def _begins(word: bytes, wanted: tuple[bytes, ...]) -> bool:
    """Return whether the last word of a text may be the beginning of what belongs there."""
    return any(whole.startswith(word) for whole in wanted) or not (wanted or word in _KEYWORDS)


def _is_number(word: bytes) -> bool:
    return bool(NUMBER.fullmatch(word) or _NAN_SPELLINGS.match(word))


def _at(rule: Rule, message: str, raw: bytes, place: int) -> Finding:
    return rule.finding(message, places=[Location(line=raw.count(b"\n", 0, place) + 1)])
