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
    with open(path, "rb") as file:
        head = file.read(12)
        if head[:4] not in (b"RIFF", b"RIFX", b"RF64") or head[8:] != b"WAVE":
            raise Unreadable(str(path), None, "is no WAV file")
        order = ">" if head[:4] == b"RIFX" else "<"
        form, length = None, path.stat().st_size
        stated = struct.unpack(f"{order}I", head[4:8])[0] + 8
        if head[:4] != b"RF64" and length not in (stated, stated + stated % 2):
            raise Unreadable(
                str(path), None, f"states {stated} bytes and has {length}: it was not closed, or is damaged"
            )
        while len(chunk := file.read(8)) == 8:
            name, size = chunk[:4], struct.unpack(f"{order}I", chunk[4:])[0]
            if name == b"fmt ":
                form = struct.unpack(f"{order}HHIIHH", file.read(16))
                size -= 16
            elif name == b"data" and form:
                left = length - file.tell()
                if head[:4] != b"RF64" and size > left:
                    raise Unreadable(str(path), None, f"states {size} bytes of samples and has {left}")
                break
            file.seek(size + size % 2, 1)
    if form is None:
        raise Unreadable(str(path), None, "has no format chunk before its samples")
    _, channels, rate, second, frame, bits = form
    if bits % 8 or frame != channels * bits // 8 or second != rate * frame or not frame:
        raise Unreadable(
            str(path), None, f"its header contradicts itself: {channels} channels, {bits} bits, {frame} bytes a frame"
        )
