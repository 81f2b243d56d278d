"""Records of a vibrating motor: lines in noise, written as files of sound."""

import numpy as np
from scipy.io import wavfile

RATE = 2000
TIME = np.arange(2 * RATE) / RATE
FULL = 500.0
"""Micrometres of a file's full scale."""


def noise(size=1.0, seed=1):
    return size * np.random.default_rng(seed).standard_normal(len(TIME))


def wave(size, hertz=121.3, phase=0.0):
    return size * np.cos(2 * np.pi * hertz * TIME + phase)


def write(path, *channels, rate=RATE):
    wavfile.write(path, rate, np.column_stack(channels).astype("<f4") / np.float32(FULL))


def repeats(folder, **lines):
    """Write three records of each line, or of each pair of lines, in noise: its letter and a number."""
    for name, channels in lines.items():
        for i in range(3):
            several = channels if isinstance(channels, tuple) else (channels,)
            seeds = [[i, k, ord(name)] for k in range(len(several))]
            columns = (x * (1 + 0.005 * i) + noise(seed=seed) for x, seed in zip(several, seeds, strict=True))
            write(folder / f"{name}{i}.wav", *columns)
