"""A 3MF file as an OPC package: zip entries, part names, content types, relationships. Nothing is unpacked to disk.

Rules from ECMA-376 part 2 (Open Packaging Conventions) and the 3MF core specification, chapter 2. XML is parsed by
expat piece by piece: no DTD, UTF-8 only, no xml:space, no xsi attributes.
"""

from __future__ import annotations

import codecs
import io
import posixpath
import re
import struct
import zipfile
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import unquote
from xml.parsers import expat

from unitcad.geometry.boxes import Tick
from unitcad.meshcheck.findings import Finding, Location, counted
from unitcad.meshcheck.rules.f_file import F003, F006, F009, F011, Deadline, Limits, OutOfTime, Unreadable
from unitcad.meshcheck.rules.p_package import P001, P002, P003, P004, P005, P006, P007, P008
from unitcad.meshcheck.rules.registry import Rule

XML_SPACE = "http://www.w3.org/XML/1998/namespace "
XSI = "http://www.w3.org/2001/XMLSchema-instance "
_DEPTH = 100
_CHUNK = 1 << 20
_SMALL = 5_000_000  # bytes a small part may have


@dataclass
class Element:
    """An element of a small part: "namespace local" and unprefixed attributes as written."""

    name: str
    attributes: dict[str, str]
    children: list[Element] = field(default_factory=list)


def new_parser(start: Callable[[str, list[str]], Any], end: Callable[[str], Any]) -> expat.XMLParserType:
    """Return a parser for `parse`; names are "namespace local", attributes a flat list."""
    parser = expat.ParserCreate(None, " ")
    parser.ordered_attributes = True
    parser.StartElementHandler = start
    parser.EndElementHandler = end
    return parser


def parse(parser: expat.XMLParserType, data: bytes, part: str, tick: Tick) -> None:
    """Parse a part.

    Raises `Unreadable`: P006 for a DTD, F009 (as an error) for another encoding than UTF-8, F003 for XML that is not
    well formed.
    """
    place = [Location(part=part)]

    def refuse(*_: object) -> None:
        raise P006.unreadable("a document type declaration", places=place)

    def declared(_version: str, encoding: str | None, _standalone: int) -> None:
        if encoding is not None and encoding.lower() != "utf-8":
            raise F009.unreadable(f"encoding {encoding!r} instead of UTF-8", places=place, severity="error")

    parser.XmlDeclHandler = declared
    parser.StartDoctypeDeclHandler = refuse
    if data[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE) or b"\x00" in data[:8]:
        raise F009.unreadable("UTF-16 or UTF-32 instead of UTF-8", places=place, severity="error")
    try:
        for at in range(0, len(data), _CHUNK):
            tick()
            parser.Parse(data[at : at + _CHUNK], False)
        parser.Parse(b"", True)
    except expat.ExpatError as error:
        line, at = [Location(part=part, line=error.lineno)], parser.ErrorByteIndex
        if any(byte > 127 for byte in data[at : at + 4]):
            raise F009.unreadable("bytes that are not UTF-8", places=line, severity="error") from error
        raise F003.unreadable(f"XML not well formed: {expat.ErrorString(error.code)}", places=line) from error


def forbidden(name: str) -> str | None:
    """Return why an attribute may stand nowhere in 3MF markup, or None: xml:space and all of xsi."""
    if name.startswith(XML_SPACE) and name != XML_SPACE + "lang":
        return f"attribute xml:{name[len(XML_SPACE) :]}"
    if name.startswith(XSI):
        return f"attribute xsi:{name[len(XSI) :]}"
    return None


def read_small(data: bytes, part: str, tick: Tick) -> Element:
    """Return a whole small part as a tree. Raises `Unreadable` as `parse` does."""
    stack: list[Element] = [Element("", {})]

    def start(name: str, attributes: list[str]) -> None:
        if len(stack) > _DEPTH:
            raise F011.unreadable(f"{part}: elements nest deeper than {_DEPTH}")
        element = Element(name, dict(zip(attributes[::2], attributes[1::2], strict=True)))
        stack[-1].children.append(element)
        stack.append(element)

    parse(new_parser(start, lambda _: stack.pop()), data, part, tick)
    return stack[0].children[0]


CONTENT_TYPES = "[Content_Types].xml"
_PACKAGE = "http://schemas.openxmlformats.org/package/2006/"
_MS = "http://schemas.microsoft.com/3dmanufacturing/2013/01/"
START = _MS + "3dmodel"
TEXTURE = _MS + "3dtexture"
TICKET = _MS + "printticket"
THUMBNAIL = _PACKAGE + "relationships/metadata/thumbnail"
PROPERTIES = _PACKAGE + "relationships/metadata/core-properties"
PRESERVE = _PACKAGE + "relationships/mustpreserve"
KNOWN = {START, TEXTURE, TICKET, THUMBNAIL, PROPERTIES, PRESERVE}
MODEL_TYPE = "application/vnd.ms-package.3dmanufacturing-3dmodel+xml"
RELS_TYPE = "application/vnd.openxmlformats-package.relationships+xml"
_END_RECORD = 22 + (1 << 16)  # bytes of the largest end record, with its comment
_FREE = 1_000_000  # bytes that may inflate at any ratio
_MEDIA = re.compile(r"^[!#$%&'*+\-.^_`|~\w]+/[!#$%&'*+\-.^_`|~\w]+(\s*;.*)?$", re.ASCII)
_ODD = re.compile(r"[\\\x00-\x1f\x7f]|%2f|%5c", re.IGNORECASE)
_SCHEME = re.compile(r"^[A-Za-z][A-Za-z0-9+.\-]*:")


@dataclass(frozen=True)
class Relation:
    """One relationship: `target` is a part name (lower case, no leading slash)."""

    kind: str
    target: str


@dataclass
class Package:
    """The parts of a package by lower-case name, and its faults so far."""

    archive: zipfile.ZipFile
    limits: Limits
    deadline: Deadline
    parts: dict[str, zipfile.ZipInfo] = field(default_factory=dict)
    findings: list[Finding] = field(default_factory=list)
    defaults: dict[str, str] = field(default_factory=dict)
    overrides: dict[str, str] = field(default_factory=dict)
    spent: int = 0
    strict: bool = False

    def add(self, rule: Rule, message: str, part: str | None = None, severity: str | None = None) -> None:
        """Add a finding about a part."""
        places = [Location(part=self.shown(part))] if part else ()
        self.findings.append(rule.finding(message, places=places, severity=severity))

    def add_lenient(self, rule: Rule, message: str, part: str | None = None) -> None:
        """Add a finding that real programs' files have: a warning unless the package is checked strictly."""
        self.add(rule, message, part, None if self.strict else "warning")

    def read(self, name: str, most: int | None = None) -> bytes:
        """Return a part's bytes, at most so many. Raises `Unreadable`."""
        info = self.parts[name]
        place = [Location(part=info.filename)]
        if info.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            raise P008.unreadable(f"{info.filename} is packed with method {info.compress_type}", places=place)
        if most is not None and info.file_size > most:
            raise F011.unreadable(f"{info.filename}: more than {most} bytes")
        self.spent += info.file_size
        if self.spent > self.limits.max_package_bytes:
            raise F011.unreadable(f"the package inflates beyond {self.limits.max_package_bytes} bytes")
        self.deadline.tick()
        try:
            with self.archive.open(info) as stream:  # its own `read` of all takes the square of the time
                return b"".join(iter(lambda: stream.read(_CHUNK), b""))
        except (
            zipfile.BadZipFile,
            zlib.error,
            EOFError,
            OSError,
            NotImplementedError,
            RuntimeError,
            ValueError,
        ) as error:
            raise F003.unreadable(f"{info.filename} cannot be unpacked: {error}", places=place) from error

    def shown(self, name: str) -> str:
        """Return a part's name as the package writes it; `parts` has it in lower case, since OPC compares names so."""
        return self.parts[name].filename.lstrip("/") if name in self.parts else name

    def content_type(self, name: str) -> str | None:
        """Return the part's content type by override or default, without parameters, in lower case."""
        content_type = self.overrides.get(name) or self.defaults.get(posixpath.splitext(name)[1][1:])
        return content_type.split(";")[0].strip().lower() if content_type else None

    def relations(self, name: str) -> list[Relation]:
        """Return the relationships of a part ("" for the package), their faults added to the findings."""
        folder, base = posixpath.split(name)
        rels = posixpath.join(folder, "_rels", f"{base}.rels")
        if rels not in self.parts:
            return []
        root = self.xml(rels, P002)
        if root is None:
            return []
        if root.name != f"{_PACKAGE}relationships Relationships":
            self.add(P002, "the root is not Relationships", rels)
            return []
        return list(self._read_relations(root, folder, rels))

    def xml(self, name: str, rule: Rule) -> Element | None:
        """Return a small XML part as a tree, or None with a finding (of `rule`, or of a rule on XML)."""
        try:
            return read_small(self.read(name, _SMALL), self.shown(name), self.deadline.tick)
        except OutOfTime:
            raise
        except Unreadable as stop:
            self.findings += [
                rule.finding(item.message, places=item.locations) if item.code == F003.code else item
                for item in stop.findings
            ]
            return None

    def _read_relations(self, root: Element, folder: str, rels: str) -> Iterator[Relation]:
        ids: set[str] = set()
        for child in root.children:
            attributes = child.attributes
            kind, target, id_ = (attributes.get(key, "") for key in ("Type", "Target", "Id"))
            if child.name != f"{_PACKAGE}relationships Relationship" or not (kind and target and id_):
                self.add(P002, "a relationship needs Id, Type and Target", rels)
                continue
            if id_ in ids:
                self.add(P002, f"relationship Id {id_!r} twice", rels)
            ids.add(id_)
            if attributes.get("TargetMode", "Internal") != "Internal" or _SCHEME.match(target) or target[:2] == "//":
                self.add(P007, f"target {target!r}", rels)
                continue
            path = target if target.startswith("/") else posixpath.join("/", folder, target)
            part = posixpath.normpath(unquote(path)).lstrip("/").lower()
            if kind in KNOWN and part not in self.parts:
                rule = P003 if kind == START and rels == "_rels/.rels" else P002
                add = self.add_lenient if kind == THUMBNAIL else self.add
                add(rule, f"target {target!r} is not in the package", rels)
                continue
            yield Relation(kind, part)


def open_package(data: memoryview, limits: Limits, deadline: Deadline, *, strict: bool = False) -> Package:
    """Open a package and check its entries, names and content types. Raises `Unreadable` if it is no zip."""
    try:
        archive = zipfile.ZipFile(io.BytesIO(data))
    except (zipfile.BadZipFile, ValueError, OSError, EOFError, NotImplementedError) as error:
        raise F003.unreadable(f"the zip cannot be read: {error}") from error
    package = Package(archive, limits, deadline, strict=strict)
    entries = archive.infolist()
    if why := _contradicts(data, archive):
        raise F003.unreadable(f"the zip's end record contradicts its directory: {why}")
    if len(entries) > limits.max_entries:
        raise F011.unreadable(f"{counted(len(entries), 'zip entry', 'zip entries')}, more than {limits.max_entries}")
    end = _end_record(data)
    if more := len(data) - end - 22 - int.from_bytes(data[end + 20 : end + 22], "little"):
        package.add(F006, f"{counted(more, 'byte')} after the end of the zip")
    bombs = []
    for info in entries:
        name = info.filename
        segments = [unquote(segment) for segment in name.removesuffix("/").split("/")]
        if _ODD.search(name) or _SCHEME.match(name) or any(not part or part.endswith(".") for part in segments):
            package.add(P005, f"{info.filename!r} is no plain relative name", info.filename)
        if not info.filename or info.is_dir():
            continue
        if info.flag_bits & 1:
            raise P008.unreadable(f"{info.filename} is encrypted", places=[Location(part=info.filename)])
        key = unquote(info.filename).lower().lstrip("/")
        if key in package.parts:
            package.add(P004, f"{info.filename!r} is there twice", info.filename)
            continue
        package.parts[key] = info
        if info.file_size > _FREE and info.file_size > limits.ratio * max(info.compress_size, 1):
            bombs.append(f"{info.filename} inflates {info.file_size / max(info.compress_size, 1):.0f} to one")
    if bombs:
        raise Unreadable(*package.findings, P008.finding(bombs[0], len(bombs)))
    _content_types(package)
    return package


def _end_record(data: memoryview) -> int:
    """Return the place of the end record, which `zipfile` has found before."""
    return max(len(data) - _END_RECORD, 0) + bytes(data[-_END_RECORD:]).rfind(b"PK\x05\x06")


def _contradicts(data: memoryview, archive: zipfile.ZipFile) -> str | None:
    """Return how the end record differs from the directory that was read; None if it does not, or for a zip64."""
    at = _end_record(data)
    on_disk, total, size, offset = struct.unpack_from("<HHII", data, at + 8)
    if 0xFFFF in (on_disk, total) or 0xFFFFFFFF in (size, offset):
        return None
    there = len(archive.infolist())
    if not on_disk == total == there:
        return f"{counted(total, 'entry', 'entries')}, {on_disk} on this disk, and {there} in the directory"
    return None if offset == archive.start_dir else f"it begins at byte {offset}, and lies at {archive.start_dir}"


def _content_types(package: Package) -> None:
    key = CONTENT_TYPES.lower()
    if key not in package.parts:
        package.add(P001, f"{CONTENT_TYPES} is missing")
        return
    root = package.xml(key, P001)
    if root is None:
        return
    space = f"{_PACKAGE}content-types "
    if root.name != f"{space}Types":
        package.add(P001, "the root is not Types", CONTENT_TYPES)
        return
    for child in root.children:
        kind = child.attributes.get("ContentType", "")
        if not _MEDIA.match(kind):
            package.add(P001, f"content type {kind!r} is none", CONTENT_TYPES)
        if child.name == f"{space}Default":
            name, table = child.attributes.get("Extension", "").lower(), package.defaults
        elif child.name == f"{space}Override":
            name, table = unquote(child.attributes.get("PartName", "")).lower(), package.overrides
            if not name.startswith("/"):
                package.add(P001, f"part name {name!r} does not begin with a slash", CONTENT_TYPES)
            name = name.lstrip("/")
        else:
            package.add(P001, f"unknown element {child.name.split()[-1]!r}", CONTENT_TYPES)
            continue
        if not name:
            package.add(P001, "an entry without Extension or PartName", CONTENT_TYPES)
        elif name in table:
            package.add(P001, f"{name!r} has a type twice", CONTENT_TYPES)
        table[name] = kind
    if "_rels/.rels" in package.parts and package.content_type("_rels/.rels") not in (RELS_TYPE, None):
        package.add(P001, "the extension rels has another type than relationships", CONTENT_TYPES)
