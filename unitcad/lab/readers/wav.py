"""WAV, by scipy: whole numbers as parts of full scale."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from scipy.io import wavfile

from unitcad.lab.readers import Channel, Layout, Unreadable

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
    unit = ""
    if data.dtype.kind in "iu":  # parts of the largest number
        unit, small = "FS", data.dtype == np.uint8
        data = (data - (128.0 if small else 0.0)) / (128.0 if small else 2.0 ** (8 * data.dtype.itemsize - 1))
    return [Channel(data[:, i], f"channel {i + 1}", unit, 1 / rate) for i in range(data.shape[1])]
