"""XML as 3MF allows it, parsed by expat piece by piece: no DTD, UTF-8 only, no xml:space, no xsi attributes."""

from __future__ import annotations

import codecs
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any
from xml.parsers import expat

from unitcad.meshcheck.findings import Location
from unitcad.meshcheck.rules.f_file import F003, F009, F011
from unitcad.meshcheck.rules.p_package import P006

XML_SPACE = "http://www.w3.org/XML/1998/namespace "
XSI = "http://www.w3.org/2001/XMLSchema-instance "
_DEPTH = 100
_SMALL = 5_000_000  # bytes a small part may have


@dataclass
class Element:
    """An element of a small part: "namespace local" and unprefixed attributes as written."""

    name: str
    attributes: dict[str, str]
    children: list[Element] = field(default_factory=list)


Start = Callable[[str, list[str]], Any]
End = Callable[[str], Any]


def new_parser() -> expat.XMLParserType:
    """Return a parser that names elements "namespace local"."""
    parser = expat.ParserCreate(None, " ")
    parser.ordered_attributes = True
    parser.buffer_text = True
    return parser


def stream(
    chunks: Iterable[bytes],
    part: str,
    start: Start,
    end: End,
    namespace: Callable[[str | None, str], Any] | None = None,
    parser: expat.XMLParserType | None = None,
) -> None:
    """Feed a part to `start` and `end`; names are "namespace local", attributes a flat list.

    A caller that needs line numbers gives the `parser`, made by `new_parser`. Raises `Unreadable`: P006 for a DTD, F009
    (as an error) for another encoding than UTF-8, F003 for XML that is not well formed.
    """
    place = [Location(part=part)]
    parser = parser or new_parser()

    def refuse(*_: object) -> None:
        raise P006.unreadable("a document type declaration", places=place)

    def declared(_version: str, encoding: str | None, _standalone: int) -> None:
        if encoding is not None and encoding.lower() != "utf-8":
            raise F009.unreadable(f"encoding {encoding!r} instead of UTF-8", places=place, severity="error")

    parser.XmlDeclHandler = declared
    parser.StartDoctypeDeclHandler = refuse
    parser.EntityDeclHandler = refuse
    parser.StartElementHandler = start
    parser.EndElementHandler = end
    parser.StartNamespaceDeclHandler = namespace
    seen, chunk = 0, b""
    try:
        for chunk in chunks:
            if not seen and (chunk[:2] in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE) or b"\x00" in chunk[:8]):
                raise F009.unreadable("UTF-16 or UTF-32 instead of UTF-8", places=place, severity="error")
            parser.Parse(chunk, False)
            seen += len(chunk)
        parser.Parse(b"", True)
    except expat.ExpatError as error:
        line = [Location(part=part, line=error.lineno)]
        at = parser.ErrorByteIndex - seen
        if 0 <= at < len(chunk) and any(byte > 127 for byte in chunk[at : at + 4]):
            raise F009.unreadable("bytes that are not UTF-8", places=line, severity="error") from error
        raise F003.unreadable(f"XML not well formed: {expat.ErrorString(error.code)}", places=line) from error


def forbidden(name: str) -> str | None:
    """Return why an attribute may stand nowhere in 3MF markup, or None: xml:space and all of xsi."""
    if name.startswith(XML_SPACE) and name != XML_SPACE + "lang":
        return f"attribute xml:{name[len(XML_SPACE) :]}"
    if name.startswith(XSI):
        return f"attribute xsi:{name[len(XSI) :]}"
    return None


def read_small(chunks: Iterable[bytes], part: str) -> Element:
    """Return a whole small part as a tree. Raises `Unreadable` as `stream` does, and for parts over 5 MB."""
    stack: list[Element] = [Element("", {})]

    def start(name: str, attributes: list[str]) -> None:
        if len(stack) > _DEPTH:
            raise F011.unreadable(f"{part}: elements nest deeper than {_DEPTH}")
        element = Element(name, dict(zip(attributes[::2], attributes[1::2], strict=True)))
        stack[-1].children.append(element)
        stack.append(element)

    def bounded() -> Iterable[bytes]:
        size = 0
        for chunk in chunks:
            size += len(chunk)
            if size > _SMALL:
                raise F011.unreadable(f"{part}: more than {_SMALL} bytes")
            yield chunk

    stream(bounded(), part, start, lambda _: stack.pop())
    return stack[0].children[0]
