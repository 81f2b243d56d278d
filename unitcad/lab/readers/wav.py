"""WAV, by scipy: whole numbers as parts of full scale."""

from __future__ import annotations

import struct
import warnings
from pathlib import Path

import numpy as np
from scipy.io import wavfile

from unitcad.lab.readers import Channel, Layout, Unreadable

ENDINGS = (".wav",)
LIBRARY = "scipy"


def read(path: Path, layout: Layout) -> list[Channel]:
    """Return the channels of a WAV file. Raises Unreadable if its header contradicts itself or its length."""

    _expect_consistent(path)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        rate, data = wavfile.read(path)
    data = data.reshape(len(data), -1)
    if rate <= 0 or len(data) < 2:
        raise Unreadable(str(path), None, "has no samples, or states no rate")
    unit = ""
    if data.dtype.kind in "iu":  # parts of the largest number
        unit, small = "FS", data.dtype == np.uint8
        data = (data - (128.0 if small else 0.0)) / (128.0 if small else 2.0 ** (8 * data.dtype.itemsize - 1))
    return [Channel(data[:, i], f"channel {i + 1}", unit, 1 / rate) for i in range(data.shape[1])]


def _expect_consistent(path: Path) -> None:
    """Raise Unreadable if the header contradicts itself or the file."""
    content = path.read_bytes()
    kind, length, at = content[:4], len(content), 12
    if kind not in (b"RIFF", b"RIFX", b"RF64") or content[8:12] != b"WAVE":
        raise Unreadable(str(path), None, "is no WAV file")
    order, whole = ">" if kind == b"RIFX" else "<", kind != b"RF64"  # its sizes are elsewhere
    stated = struct.unpack_from(f"{order}I", content, 4)[0] + 8
    if whole and length not in (stated, stated + stated % 2):
        raise Unreadable(str(path), None, f"states {stated} bytes and has {length}: it was not closed, or is damaged")
    form = None
    while at + 8 <= length:
        name, size = struct.unpack_from(f"{order}4sI", content, at)
        at += 8
        if name == b"fmt " and size >= 16:
            form = struct.unpack_from(f"{order}HHIIHH", content, at)
        elif name == b"data" and form:
            if whole and size > length - at:
                raise Unreadable(str(path), None, f"states {size} bytes of samples and has {length - at}")
            break
        at += size + size % 2
    if form is None:
        raise Unreadable(str(path), None, "has no format chunk before its samples")
    _, channels, rate, second, frame, bits = form
    if bits % 8 or frame != channels * bits // 8 or second != rate * frame or not frame:
        limit = f"its header contradicts itself: {channels} channels, {bits} bits, {frame} bytes a frame"
        raise Unreadable(str(path), None, limit)
