"""WAV, by scipy: whole numbers as parts of full scale."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import numpy as np
from scipy.io import wavfile

from unitcad.lab.header import units_in_lines
from unitcad.lab.readers import Channel, Layout, Unreadable
from unitcad.lab.units import Stated, text_of

ENDINGS = (".wav",)
LIBRARY = "scipy"


def read(path: Path, layout: Layout) -> list[Channel]:
    """Return the channels of a WAV file. Raises Unreadable if its header contradicts itself or its length."""
    content = path.read_bytes()
    if content[:4] in (b"RIFF", b"RIFX"):  # the sizes of RF64 are elsewhere
        stated = int.from_bytes(content[4:8], "little" if content.startswith(b"RIFF") else "big") + 8
        if len(content) not in (stated, stated + stated % 2):
            limit = f"states {stated} bytes and has {len(content)}: it was not closed, or is damaged"
            raise Unreadable(str(path), None, limit)
    rate, data = wavfile.read(path)
    data = data.reshape(len(data), -1)
    if rate <= 0 or len(data) < 2:
        raise Unreadable(str(path), None, "has no samples, or states no rate")
    units = units_in_lines(_remarks(content), data.shape[1])
    if data.dtype.kind in "iu":  # parts of the largest number
        small = data.dtype == np.uint8
        data = (data - (128.0 if small else 0.0)) / (128.0 if small else 2.0 ** (8 * data.dtype.itemsize - 1))
        whole = "its numbers are parts of full scale, and its remarks say"
        units = [Stated(doubt=f"{whole} {one.unit}") if one.unit else Stated("FS", one.doubt) for one in units]
    return [
        Channel(data[:, i], f"channel {i + 1}", one.unit, 1 / rate, one.doubt, one.likely)
        for i, one in enumerate(units)
    ]


def _remarks(content: bytes) -> list[str]:
    """Return the lines of the texts in a WAV file's LIST chunks of remarks (INFO)."""
    order: Literal["little", "big"] = "big" if content.startswith(b"RIFX") else "little"
    lines: list[str] = []
    at = 12
    while at + 8 <= len(content):
        size = int.from_bytes(content[at + 4 : at + 8], order)
        if content[at : at + 4] == b"LIST" and content[at + 8 : at + 12] == b"INFO":
            inner, end = at + 12, min(at + 8 + size, len(content))
            while inner + 8 <= end:
                length = int.from_bytes(content[inner + 4 : inner + 8], order)
                text = content[inner + 8 : min(inner + 8 + length, end)]
                lines += str(text_of(text)).splitlines()
                inner += 8 + length + length % 2
        at += 8 + size + size % 2
    return lines
