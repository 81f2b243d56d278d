"""Thumbnails and textures of a 3MF package: PNG or JPEG by their bytes, and no CMYK JPEG."""

from __future__ import annotations

from collections.abc import Iterable

_SOF = {0xC0, 0xC1, 0xC2, 0xC3, 0xC5, 0xC6, 0xC7, 0xC9, 0xCA, 0xCB, 0xCD, 0xCE, 0xCF}
_LIMIT = 4_000_000


def image_kind(chunks: Iterable[bytes]) -> tuple[str | None, str | None]:
    """Return `png`, `jpeg` or None, and what is wrong or None. Looks at the first 4 MB; pixels are not decoded."""
    data = b""
    for chunk in chunks:
        if len(data) < _LIMIT:
            data += chunk
    if data.startswith(b"\x89PNG\r\n\x1a\n"):
        return "png", None if data[12:16] == b"IHDR" else "a PNG without a header chunk"
    if data.startswith(b"\xff\xd8"):
        return "jpeg", "a CMYK JPEG" if _components(data) == 4 else None
    return None, None


def _components(data: bytes) -> int | None:
    """Return the number of colour components of a JPEG's frame, or None where no frame header is found."""
    at = 2
    while at + 9 < len(data):
        if data[at] != 0xFF:
            at += 1
            continue
        marker = data[at + 1]
        if marker in _SOF:
            return data[at + 9]
        if marker == 0xFF or 0xD0 <= marker <= 0xD9 or marker == 0x01:
            at += 1 if marker == 0xFF else 2
            continue
        at += 2 + int.from_bytes(data[at + 2 : at + 4], "big")
    return None
