"""WAV, by scipy: whole numbers as parts of full scale, mapped into memory where the format allows."""

from __future__ import annotations

import struct
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from unitcad import files
from unitcad.geometry.arrays import Floats
from unitcad.lab.readers.recording_layout import Layout
from unitcad.lab.readers.whole import expect_small
from unitcad.lab.recording import ROWS, Channel, Recording, Unreadable

ENDINGS = (".wav",)
FULL_SCALE = "FS"
"""The unit of whole numbers: parts of the largest one."""


def read(path: Path, layout: Layout) -> Recording:
    """Return the channels of a WAV file. Raises Unreadable where its header contradicts itself or its length."""
    from scipy.io import wavfile

    bits = _expect_consistent(path)
    mapped = bits in (8, 16, 32, 64)
    if not mapped:
        expect_small(path, "save it with 16 or 32 bits")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        rate, data = wavfile.read(path, mmap=mapped)
    offset = data.offset if isinstance(data, np.memmap) else None
    data = data.reshape(len(data), -1)
    if rate <= 0 or len(data) < 2:
        raise Unreadable(str(path), None, "holds no samples, or states no rate")
    whole = data.dtype.kind in "iu"
    middle = 128.0 if data.dtype == np.uint8 else 0.0
    largest = 128.0 if data.dtype == np.uint8 else 2.0 ** (8 * data.dtype.itemsize - 1)
    unit = FULL_SCALE if whole else ""
    channels = tuple(Channel(f"channel {i + 1}", unit, 1 / rate, len(data)) for i in range(data.shape[1]))

    def blocks(indices: tuple[int, ...]) -> Iterator[Floats]:
        for start in range(0, len(data), ROWS):
            rows = np.asarray(_rows(path, data, offset, start)[:, list(indices)], float)
            yield (rows - middle) / largest if whole else rows

    return Recording(path, "wav", channels, blocks)


def _rows(path: Path, data: Floats, offset: int | None, start: int) -> Floats:
    """Return a block of rows; of a mapped file by reading it, since touched pages would stay in memory."""
    if offset is None:
        return data[start : start + ROWS]
    width = data.shape[1]
    count = min(ROWS, len(data) - start) * width
    at = offset + start * width * data.dtype.itemsize
    return np.fromfile(path, data.dtype, count, offset=at).reshape(-1, width)


def _expect_consistent(path: Path) -> int:
    """Return the bits of a sample. Raises Unreadable where the header contradicts itself or the file."""
    with open(path, "rb", opener=files.regular()) as file:
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
    return bits
